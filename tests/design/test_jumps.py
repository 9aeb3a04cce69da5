"""Functions with jumps, whose derivatives vanish or lack a part: nothing is claimed that only derivatives support."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from acausal import Component, Param, Scalar, replace
from acausal.design import Experiment, Tolerance, Uniform, identify, optimise


class Pair(Component):
    """Two numbers."""

    x: Param[Scalar, "1"] = 0.5
    y: Param[Scalar, "1"] = 0.7


FREE: Any = {"x": (0.0, 1.0), "y": (-1.0, 1.0)}
TABLE = jnp.array([4.0, 3.0, 3.0, 1.0, 2.0, 5.0, 7.0, 8.0, 9.0, 9.0, 9.0])
OBJECTIVES = {
    "round": lambda m: jnp.round(10.0 * m.x) + m.y**2,
    "steps wider than a trial step": lambda m: jnp.round(3.0 * m.x) + m.y**2,
    "with a slope": lambda m: jnp.round(10.0 * m.x) + (m.x - 0.5) ** 2 + m.y**2,
    "stopped": lambda m: jax.lax.stop_gradient((m.x - 0.3) ** 2) + m.y**2,
    "sign": lambda m: jnp.sign(m.x - 0.3) + m.y**2,
    "factor": lambda m: (1.0 + jnp.floor(10.0 * m.x)) * (1.0 + m.y**2),
    "table": lambda m: TABLE[jnp.floor(10.0 * m.x).astype(int)] + m.y**2,
    "count": lambda m: jnp.sum(jnp.linspace(0.0, 1.0, 11) < m.x) + m.y**2,
    "of both": lambda m: jnp.floor(5.0 * (m.x + m.y)) + (m.x - m.y) ** 2,
    "along a valley": lambda m: jnp.floor(5.0 * (m.x + m.y) + 0.01) + 100.0 * (m.x - m.y) ** 2,
}


def solved(function: Any, *, start: float = 0.5, **options: Any) -> Any:
    return optimise(replace(Pair(), {"x": start}), FREE, function, sensitivities=False, **options)


@pytest.mark.parametrize(
    "name", ["round", *(pytest.param(n, marks=pytest.mark.thorough) for n in OBJECTIVES if n != "round")]
)
def test_an_objective_that_jumps_has_no_certificate(name: str) -> None:
    design = solved(OBJECTIVES[name])
    assert design.status == "not converged"
    assert design.idle == ()
    text = str(design).splitlines()[0]
    assert "because derivatives do not describe the results: objective changes by " in text
    assert "optimal" not in text
    assert "minimum" not in text
    assert not any("without effect" in line for line in str(design).splitlines())


def test_the_change_is_stated_with_both_ends() -> None:
    design = solved(OBJECTIVES["with a slope"])
    (sentence,) = design.unexplained
    assert sentence == "objective changes by -0.99 from x = 0.5 to x = 0.4, but its derivatives explain 0.01 of this"


LIMITS = {
    "floor": (lambda m: m.x + m.y**2, (lambda m: jnp.floor(10.0 * m.x), ">= 3"), 0.1),
    "ceil": (lambda m: m.y**2 - m.x, (lambda m: jnp.ceil(10.0 * m.x), "<= 5"), 0.8),
    "equation": (lambda m: (m.x - 0.05) ** 2 + m.y**2, (lambda m: jnp.round(10.0 * m.x), "== 2"), 0.9),
    "far": (lambda m: (m.x - 0.05) ** 2 + m.y**2, (lambda m: jnp.floor(2.0 * m.x), ">= 1"), 0.1),
    "met": (lambda m: m.y**2, (lambda m: jnp.floor(10.0 * m.x), ">= 3"), 0.55),
}


@pytest.mark.thorough
@pytest.mark.parametrize("name", LIMITS)
def test_a_limit_in_steps_is_neither_in_conflict_nor_met_at_an_optimum(name: str) -> None:
    objective, limit, start = LIMITS[name]
    design = solved(objective, start=start, constraints={"steps": limit})
    assert design.status == "not converged"
    assert not design.conflict
    assert any(sentence.startswith("steps changes by") for sentence in design.unexplained)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("function", "idle"),
    [
        (lambda m: (m.x - 0.3) ** 2 + m.y**2, ()),
        (lambda m: m.y**2 - m.x, ()),
        (lambda m: m.y**2, ("x",)),
        (lambda m: jnp.cos(40.0 * m.x) + m.x + m.y**2, ()),
        (lambda m: 1000.0 + 1e-3 * m.y**2 + 1e-9 * jnp.sin(300.0 * m.x), ()),
        (lambda m: (m.x + m.y - 0.8) ** 2, ()),
        (lambda m: jnp.maximum(m.x - 0.6, 0.0) ** 2 + m.y**2, ()),
    ],
    ids=["parabola", "bound", "idle", "valleys", "rounding errors", "ridge", "dead zone"],
)
def test_smooth_functions_keep_their_certificate(function: Any, idle: tuple[str, ...]) -> None:
    design = solved(function)
    assert design.unexplained == ()
    assert design.status == "optimal"
    assert design.idle == idle


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("x", "said"),
    [(lambda m: jnp.round(10.0 * m.x), True), (lambda m: 0.0 * m.x, False), (lambda m: jnp.minimum(m.x, 0.2), False)],
)
def test_a_fit_says_which_predictions_change_without_a_derivative(x: Any, said: bool) -> None:
    times = np.arange(1.0, 6.0)
    measured = 5.0 + 0.7 * times + 0.01 * np.array([1.0, -1.0, 0.5, -0.5, 0.2])
    fit = identify(Pair(), FREE, Experiment(lambda m: {"a": x(m) + m.y * times}, {"a": measured}, {"a": 0.01}))
    assert fit.rank <= 1
    assert bool(fit.unexplained) == said
    sentence = "experiment 1: a changes from x = 0.5 to 0, but its derivatives are zero"
    assert (sentence in str(fit)) == said


@pytest.mark.thorough
def test_a_tolerance_says_which_parameters_its_derivatives_miss() -> None:
    scatter = {"x": Uniform(0.3, 0.7), "y": Uniform(0.6, 0.8)}
    results: Any = {"steps": lambda m: jnp.round(10.0 * m.x) + m.y, "smooth": lambda m: m.y**2}
    study = Tolerance(Pair(), scatter, results)
    for found in (study.first_order(), study.second_order()):
        assert [name for name, spread in found.items() if spread.unexplained] == ["steps"]
        assert "steps changes by 1 within a standard deviation of x, but its derivatives are zero" in str(found)
    steps, smooth = (study.worst_case(name) for name in results)
    assert (steps.low, steps.high) == pytest.approx((3.6, 7.8))
    assert steps.jumps == ("x",)
    assert "steps jumps with x" in str(steps)
    assert smooth.jumps == ()


@pytest.mark.thorough
def test_a_tolerance_notices_jumps_between_which_the_result_has_a_slope() -> None:
    results: Any = {
        "steps": lambda m: jnp.round(10.0 * m.x) + 0.01 * m.x + 0.1 * m.y,
        "curved": lambda m: (m.x - 0.5) ** 4 + jnp.exp(2.0 * m.x) + jnp.sin(3.0 * m.y),
        "dead zone": lambda m: jnp.maximum(m.x - 0.6, 0.0) ** 2,
    }
    spreads = Tolerance(Pair(), {"x": Uniform(0.01, 0.99), "y": Uniform(0.6, 0.8)}, results).first_order()
    assert [name for name, spread in spreads.items() if spread.unexplained] == ["steps"]
    (sentence,) = spreads["steps"].unexplained
    assert "within a standard deviation of x, but its derivatives explain 0.0028" in sentence
