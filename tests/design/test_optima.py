"""Optima in closed form, with their certificates."""

import math
import pickle
from pathlib import Path
from typing import Any

import jax.numpy as jnp
import numpy as np
import pytest
from _problems import Box, GearedLoad, Valleys
from scipy.optimize import minimize_scalar

from acausal import Component, ModelError, Param, ParameterError, Scalar, SimulationError, about, replace, save
from acausal.design import Design, optimise
from acausal.design._compute.evaluator import Evaluator

TIME = {"time": (lambda m: m.time, "ms")}
SPEED = {"motor speed": (lambda m: m.motor_speed, "<= 200 rad/s")}
METHODS = ("SLSQP", "trust-constr")


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("start", [18.9 / 3, 18.9 * 3])
def test_ratio_of_least_time(method: Any, start: float) -> None:
    design = optimise(GearedLoad(ratio=start), {"ratio": (2.0, 100.0)}, TIME, method=method)
    assert design.status == "optimal"
    assert design.values["ratio"] == pytest.approx(math.sqrt(0.02 / 5.6e-5), rel=1e-6)
    assert design.objective == pytest.approx(0.2253850597809006, rel=1e-12)
    assert design.kkt_residual < 1e-9
    assert design.active == ()
    # T = 2 sqrt(angle (J_load / N + N J_motor) / torque): with log(N) from 0 to 1, T'' / T is log(50)^2 / 2.
    np.testing.assert_allclose(design.curvature.eigenvalues, [math.log(50.0) ** 2 / 2], rtol=1e-6)


@pytest.mark.parametrize("method", METHODS)
def test_limit_of_the_motor_speed(method: Any) -> None:
    design = optimise(GearedLoad(), {"ratio": (2.0, 100.0)}, TIME, constraints=SPEED, method=method)
    assert design.status == "optimal"
    assert design.values["ratio"] == pytest.approx(15.203135446552093, rel=1e-6)
    assert design.multipliers == pytest.approx({"motor speed": 0.00011030415918090985}, rel=1e-5)
    assert design.curvature.verdict.startswith("a vertex")
    slopes = {row.parameter: row.per_unit for row in design.sensitivities.rows}
    for name in ("J_load", "torque"):
        times = [_time_at_limit(name, 1.0 + sign * 1e-5) for sign in (1.0, -1.0)]
        value = getattr(GearedLoad(), name)
        assert slopes[name] == pytest.approx((times[0] - times[1]) / (2e-5 * float(value)), rel=1e-5)


def _time_at_limit(name: str, factor: float) -> float:
    model = replace(GearedLoad(), {name: float(getattr(GearedLoad(), name)) * factor})
    return optimise(model, {"ratio": (2.0, 100.0)}, TIME, constraints=SPEED, sensitivities=False).objective


def test_optimum_on_a_bound() -> None:
    design = optimise(GearedLoad(), {"ratio": (2.0, 12.0)}, TIME, constraints=SPEED)
    assert design.status == "optimal"
    assert design.values["ratio"] == 12.0
    (active,) = design.active
    assert (active.name, active.side) == ("ratio", "upper bound")
    # dT/dN = (J_motor - J_load / N^2) angle / torque * 2 / T
    model = design.model
    slope = (model.J_motor - model.J_load / 144.0) * model.angle / model.torque * 2.0 / model.time
    assert active.multiplier == pytest.approx(-float(slope), rel=1e-9)


def test_conflict_is_named_with_the_least_infeasible_design() -> None:
    limits = SPEED | {"time": (lambda m: m.time, "<= 0.2 s")}
    design = optimise(GearedLoad(), {"ratio": (2.0, 50.0)}, {"duration": lambda m: m.time}, constraints=limits)
    assert design.status == "infeasible"
    assert set(design.conflict) == {"motor speed", "time"}
    assert sum(design.conflict.values()) == pytest.approx(1.0)
    # Both are broken by the same fraction.
    assert [result.margin for result in design.results] == pytest.approx([design.results[0].margin] * 2, rel=1e-6)
    assert "in conflict: time" in str(design)


@pytest.mark.parametrize(("equation", "other"), [("== 0.5 m", ">= 0.8 m"), ("== 0.8 m", "<= 0.5 m")])
def test_an_equation_in_conflict_has_its_share_in_either_direction(equation: str, other: str) -> None:
    """Both are broken by t of their size at x = 8/13: 2 x - 1 = 1 - x/0.8. The shares are inverse to the slopes."""
    limits = {"one": (lambda m: m.x, equation), "other": (lambda m: m.x, other)}
    design = optimise(Valleys(x=0.4), {"x": (0.0, 2.0)}, lambda m: m.height, constraints=limits)
    assert design.status == "infeasible"
    assert design.values["x"] == pytest.approx(8.0 / 13.0, rel=1e-6)
    share = 5.0 / 13.0 if equation.endswith("0.5 m") else 8.0 / 13.0
    assert design.conflict == pytest.approx({"one": share, "other": 1.0 - share}, rel=1e-6)


@pytest.mark.parametrize("sense", ["==", ">="])
def test_box_of_least_area(sense: str) -> None:
    design = optimise(
        Box(), {"base": (0.1, 10.0), "height": (0.1, 10.0)}, lambda m: m.area,
        constraints={"volume": (lambda m: m.volume, f"{sense} 0.5 m3")},
    )  # fmt: skip
    assert design.status == "optimal"
    assert design.values == pytest.approx({"base": 1.0, "height": 0.5}, rel=1e-6)
    assert design.multipliers["volume"] == pytest.approx(-4.0 if sense == "==" else 4.0, rel=1e-5)
    assert design.curvature.eigenvalues.shape == (1,)


def test_starts_find_both_valleys() -> None:
    design = optimise(Valleys(), {"x": (-2.0, 2.0)}, lambda m: m.height, starts=6)
    ends = [found.values["x"] for found in design.optima()]
    np.testing.assert_allclose(ends, np.sort(np.roots([4.0, 0.0, -4.0, 0.1]))[[0, 2]], atol=1e-7)
    assert design.status == "optimal"
    assert "other optima" in str(design)


def test_scenarios_are_run_each_and_named() -> None:
    design = optimise(
        GearedLoad(), {"ratio": (2.0, 100.0)}, lambda s: s["light"].time + s["heavy"].time,
        scenarios={"light": {"J_load": 0.01}, "heavy": {"J_load": 0.04}},
        constraints={"speed": (lambda s: {name: m.motor_speed for name, m in s.items()}, "<= 210 rad/s")},
    )  # fmt: skip

    def time(ratio: float) -> float:
        return float(sum(replace(GearedLoad(), {"ratio": ratio, "J_load": J}).time for J in (0.01, 0.04)))

    assert {result.limit.name for result in design.results} == {"speed[light]", "speed[heavy]"}
    assert list(design.multipliers) == ["speed[light]"]
    free = optimise(
        GearedLoad(), {"ratio": (2.0, 100.0)}, lambda s: s["light"].time + s["heavy"].time,
        scenarios={"light": {"J_load": 0.01}, "heavy": {"J_load": 0.04}},
    )  # fmt: skip
    best = minimize_scalar(time, (10.0, 30.0), tol=1e-10)
    assert free.objective == pytest.approx(best.fun, rel=1e-12)  # pyright: ignore[reportAttributeAccessIssue]


def test_what_cannot_be_computed_is_stepped_back_from() -> None:
    def time(m: GearedLoad) -> Any:
        return jnp.where(m.ratio > 19.5, jnp.inf, m.time)

    design = optimise(GearedLoad(ratio=50.0), {"ratio": (2.0, 100.0)}, {"time": time})
    assert design.values["ratio"] == pytest.approx(math.sqrt(0.02 / 5.6e-5), rel=1e-6)
    assert design.failed
    assert "stepped back from: time is inf" in str(design)
    with pytest.raises(SimulationError, match="4 designs spread between the bounds all fail alike: time is nan"):
        optimise(GearedLoad(), {"ratio": (2.0, 100.0)}, {"time": lambda m: m.time * jnp.nan})


def test_an_interrupted_search_keeps_its_best_and_can_be_resumed(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    problem: dict[str, Any] = dict(constraints={"volume": (lambda m: m.volume, ">= 0.5 m3")})
    free = {"base": (0.1, 10.0), "height": (0.1, 10.0)}
    evaluate = Evaluator._evaluate

    def interrupted(self: Evaluator, x: np.ndarray) -> Any:
        if self.evaluations == 5:
            raise KeyboardInterrupt
        return evaluate(self, x)

    with monkeypatch.context() as patch:
        patch.setattr(Evaluator, "_evaluate", interrupted)
        design = optimise(Box(), free, lambda m: m.area, **problem)
    assert design.status == "interrupted"
    assert design.total_evaluations == 5
    design.save(tmp_path / "design")
    loaded = Design.load(tmp_path / "design")
    assert loaded.values == design.values
    written = about(tmp_path / "design")
    assert written["kind"] == "Design"
    assert written["values"]["base"] == {"value": design.values["base"], "unit": "m"}
    resumed = optimise(Box(), free, lambda m: m.area, start=tmp_path / "design", **problem)
    np.testing.assert_array_equal(resumed.history[0].x, design.x)
    assert resumed.values == pytest.approx({"base": 1.0, "height": 0.5}, rel=1e-6)


def test_the_print_shows_all_with_units() -> None:
    design = optimise(GearedLoad(), {"ratio": (2.0, 100.0)}, TIME, constraints=SPEED)
    text = str(design)
    assert text.startswith("time 228.047 ms: optimal, KKT residual ")
    for part in (
        "motor speed     200  <= 200 rad/s     0 %",
        "multiplier [ms]",
        "0.110304  per rad/s",
        "J_load",
    ):
        assert part in text
    assert repr(design) == "<Design of GearedLoad: optimal, time 228.047 ms>"


def test_picture_has_a_panel_each_for_objective_variables_and_margins() -> None:
    figure = optimise(GearedLoad(), {"ratio": (2.0, 100.0)}, TIME, constraints=SPEED).plot()
    assert [panel.get_ylabel() for panel in figure.axes] == ["time [ms]", "between its bounds", "margin [%]"]


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        (dict(minimise={}), "nothing to minimise"),
        (dict(minimise=3.0), "objective: give a function"),
        (dict(minimise={"a": lambda m: m.time, "b": lambda m: m.time}), "pareto takes two"),
        (dict(minimise={"motor speed": lambda m: m.time}), "name of the objective and of a constraint"),
        (dict(minimise=lambda m: float(m.time)), "objective cannot be differentiated"),
        (dict(minimise=lambda m: m.time > 3.0), "must return real numbers"),
        (dict(minimise=lambda m: "now"), "must return real numbers"),
        (dict(minimise=lambda m: ()), "returned no number"),
        (dict(minimise=lambda m: (m.time, m.time)), "objective must return one number, but returned 2"),
        (dict(minimise=lambda m: m.angle), "objective does not depend on"),
        (dict(minimise=lambda m: jnp.round(m.time)), "objective does not depend on"),
        (dict(constraints={"a": lambda m: m.time}), "a: a constraint must be a function and a limit"),
        (dict(constraints={"a": (lambda m: m.time, "below 3")}), "'below 3' is not a limit"),
        (dict(constraints={"a": (lambda m: m.time, "<= 3 furlong/moon")}), "the unit 'furlong/moon' is not known"),
        (dict(constraints={"a": (lambda m: m.time, "<= x")}), "a must be a real number, .* got 'x'"),
        (dict(constraints={"a": (lambda m: m.time, "<= inf s")}), "a: a limit must be finite, got '<= inf s'"),
        (dict(constraints=[(lambda m: m.time, "<= 3 s")]), "constraints must be a dictionary of limits by name"),
        (dict(scenarios={}), "scenarios must be a dictionary of at least one change by name"),
        (dict(run=3.0), "run must be a function"),
        (dict(method="simplex"), "method='simplex' is not known"),
        (dict(starts=0), "starts"),
        (dict(start={"ratios": 3.0}), "'ratios' is not a free parameter. Did you mean ratio"),
        (dict(start={"ratio": 300.0}), "ratio is 300, outside its bounds 2 to 100"),
        (dict(start=3.0), "start must be a dictionary"),
        (dict(scenarios={"a": {"J": 3.0}}), "no parameter or start value 'J'"),
    ],
)
def test_wrong_problems_are_told(changes: dict[str, Any], said: str) -> None:
    problem: dict[str, Any] = dict(minimise=lambda m: m.time, constraints=SPEED) | changes
    with pytest.raises((ModelError, ParameterError), match=said):
        optimise(GearedLoad(), {"ratio": (2.0, 100.0)}, **problem)


def test_a_file_that_holds_something_else(tmp_path: Path) -> None:
    (tmp_path / "other").write_bytes(pickle.dumps(3.0))
    with pytest.raises(ModelError, match="holds no readable design"):
        Design.load(tmp_path / "other")
    save(tmp_path / "model", GearedLoad())
    with pytest.raises(ModelError, match="holds a GearedLoad instead of a design"):
        Design.load(tmp_path / "model")


def test_a_search_may_start_where_the_slope_is_zero() -> None:
    """From the top of the hill of -x^2 it goes on to a bound; the bottom of x^2 is an optimum."""
    model = replace(Valleys(), {"x": 0.0})
    assert optimise(model, {"x": (-1.0, 1.0)}, lambda m: m.x**2).status == "optimal"
    design = optimise(model, {"x": (-1.0, 1.0)}, lambda m: -(m.x**2))
    assert design.status == "optimal"
    assert abs(design.values["x"]) == 1.0


class Slope(Component):
    """A plane and a parabola, for whichever function a test has of them."""

    x: Param[Scalar, "m"] = 1.5
    y: Param[Scalar, "m"] = 0.5


@pytest.mark.parametrize(
    "function", [lambda m: m.x, lambda m: -jnp.exp(m.x), lambda m: m.x * m.y], ids=["line", "exponential", "saddle"]
)
def test_what_falls_for_ever_is_said(function: Any) -> None:
    design = optimise(Slope(), {"x": None, "y": (-5.0, 5.0)}, function, sensitivities=False)
    assert design.status == "unbounded"
    assert "it decreases without limit" in str(design)


def test_limits_that_say_the_same_are_named_and_what_does_not_matter() -> None:
    design = optimise(
        Slope(), {"x": (-5.0, 5.0), "y": (-5.0, 5.0)}, lambda m: (m.x - 3.0) ** 2, sensitivities=False,
        constraints={"near": (lambda m: m.x, "<= 1 m"), "double": (lambda m: 2.0 * m.x, "<= 2 m")},
    )  # fmt: skip
    assert design.status == "optimal"
    assert design.not_unique == ("near (<=)", "double (<=)")
    assert design.idle == ("y",)
    # Whatever the choice, together they buy 2 (3 - x) per unit of x.
    assert design.multipliers["near"] + 2.0 * design.multipliers["double"] == pytest.approx(4.0, rel=1e-9)
    assert "without effect: y" in str(design)


def test_a_limit_that_nothing_moves_has_no_price() -> None:
    """A limit on a parameter that is not free, just met, leaves the multiplier of the other limit unique."""
    design = optimise(
        Slope(), {"x": (-5.0, 5.0)}, lambda m: (m.x - 3.0) ** 2, sensitivities=False,
        constraints={"near": (lambda m: m.x, "<= 1 m"), "given": (lambda m: m.y, "<= 0.5 m")},
    )  # fmt: skip
    assert design.status == "optimal"
    assert design.not_unique == ()
    assert design.unmoved == ("given",)
    assert design.multipliers == pytest.approx({"near": 4.0}, rel=1e-9)
    assert "active with a zero gradient: given" in str(design)


@pytest.mark.thorough
def test_limits_that_are_broken_up_to_the_edge_of_what_can_be_computed() -> None:
    """1 + sqrt(x) <= 1/2 is broken least at x = 0, beyond which nothing can be computed: no optimum is there."""
    design = optimise(
        Slope(x=0.5), {"x": (-1.0, 1.0)}, lambda m: (m.x - 0.5) ** 2, sensitivities=False,
        constraints={"root": (lambda m: 1.0 + jnp.sqrt(m.x), "<= 0.5")},
    )  # fmt: skip
    assert design.status == "not converged"
    assert 0.0 <= design.values["x"] < 0.02
    assert "the search found no feasible design" in str(design)
    assert "This one has the smallest violation: root (10" in str(design)


def test_a_limit_of_zero_may_be_met_at_the_start() -> None:
    design = optimise(
        Slope(x=1.0, y=1.0), {"x": (-5.0, 5.0), "y": (-5.0, 5.0)}, lambda m: m.x**2 + (m.y - 3.0) ** 2,
        constraints={"alike": (lambda m: m.x - m.y, "== 0 m")}, sensitivities=False,
    )  # fmt: skip
    assert design.values == pytest.approx({"x": 1.5, "y": 1.5}, rel=1e-9)
