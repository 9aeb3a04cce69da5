"""Values of parameters that a component cannot have are no designs, whether or not a run looks at them."""

from typing import Any, Self

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from acausal import (
    Component,
    Equations,
    Param,
    ParameterError,
    Requirements,
    Scalar,
    SimulationError,
    Var,
    eq,
    nonnegative,
    positive,
    require,
)
from acausal.design import Normal, Sample, Tolerance, Uniform, choose, optimise, percentile_of, sweep


class Lag(Component):
    """A lag whose gain must be below its limit."""

    T: Param[Scalar, "s", positive]
    k: Param[Scalar, "1", nonnegative] = 0.0
    most: Param[Scalar, "1"] = 5.0
    x: Var[Scalar, "1", positive] = 1.0

    def requirements(self) -> Requirements:
        return (require(self.k < self.most, "k must be below most"),)

    def equations(self, d: Self) -> Equations:
        return dict(lag=eq(self.T * d.x, self.k - self.x))


def lag(**values: Any) -> Lag:
    return Lag(**{"T": 1.0, "x": 1.0, **values})


def total(model: Lag) -> Any:
    return model.T + model.k


PATHS = {"T": lambda v: v > 0.0, "k": lambda v: 0.0 <= v < 5.0, "x": lambda v: v > 0.0, "most": lambda v: v > 1.0}
RUNS: list[Any] = [None, lambda m: jax.tree.map(jnp.asarray, m)]


@pytest.mark.thorough
@pytest.mark.parametrize("path", PATHS)
@settings(max_examples=10, deadline=None)
@given(values=st.lists(st.floats(-10.0, 10.0), min_size=2, max_size=5, unique=True).filter(lambda v: max(v) > 1.5))
def test_what_is_computed_is_in_range(path: str, values: list[float]) -> None:
    values = [4.0, *values]
    good = [PATHS[path](value) for value in values]
    found = sweep(lag(k=1.0), {path: values}, lambda m: m.T + m.k + m.most + m.x)
    np.testing.assert_array_equal(found["code"] == 0, good)
    np.testing.assert_array_equal(np.isfinite(found["result"]), good)
    rows = [{path: value, "figures": {"price": abs(value)}} for value in values]
    choice = choose(lag(k=1.0), {"lag": rows}, lambda model, figures: figures["lag"]["price"])
    np.testing.assert_array_equal(choice.is_feasible, good)


def test_a_run_without_a_solution_is_held_to_ranges_of_what_it_is_given() -> None:
    found = sweep(lag(), {"T": [-1.0, 1.0]}, lambda doubled: doubled, run=lambda m: 2.0 * m.T)
    assert (found["code"] == 0).values.tolist() == [False, True]


def test_a_run_may_set_what_its_model_lacks() -> None:
    """A requirement is checked of the model that a run makes, not of the one that it begins with."""
    found = sweep(lag(), {"k": [4.0, 6.0]}, lambda top: top, run=lambda m: 2.0 * m.k)
    assert (found["code"] == 0).all()


@pytest.mark.thorough
def test_members_of_a_tolerance_are_in_range() -> None:
    study = Tolerance(lag(), {"T": Normal(std=0.5)}, total)
    found = study.sobol_sequence(256)["result"]
    assert np.min(found.samples) > 0.0
    assert found.failed == {"bad_parameter": 256 - len(found.samples)}
    assert 0 < found.failed["bad_parameter"] < 20
    with pytest.raises(ParameterError, match=r"T must be positive .* the worst case goes from -500 to 2500 ms"):
        study.worst_case()
    low = study.worst_case(sigmas=1.0).low
    assert low == pytest.approx(0.5)
    with pytest.raises(SimulationError, match="with the means of its parameters: A parameter or start value is out"):
        Tolerance(lag(), {"T": Uniform(-3.0, -1.0)}, total).first_order()
    assert np.isnan(percentile_of(lag(), {"T": Normal(std=0.5)}, total, 50.0)(lag()))
    assert float(percentile_of(lag(), {"T": Normal(std=0.1)}, total, 50.0)(lag())) == pytest.approx(1.0, abs=0.01)


def test_samples_are_in_range() -> None:
    found = sweep(lag(), Sample({"k": (0.0, 10.0)}, 64), total)
    np.testing.assert_array_equal(found["code"] == 0, found["k"] < 5.0)


@pytest.mark.thorough
def test_optima_are_in_range() -> None:
    """Without bounds of their own, searches end where a component ends."""
    found = optimise(lag(k=1.0), {"k": (0.0, None)}, lambda m: (m.k - 9.0) ** 2)
    assert float(found.model.k) < 5.0
