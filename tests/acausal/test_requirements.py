"""Requirements of components on their parameters: checked when a component is built, and by all that takes a model."""

from collections.abc import Callable
from typing import Any, Self

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from acausal import Array as Parts
from acausal import (
    Component,
    Connections,
    Equations,
    ModelError,
    Param,
    ParameterError,
    Record,
    Requirements,
    Result,
    Scalar,
    Var,
    check,
    connect,
    eq,
    initialise,
    linearise,
    positive,
    repeat,
    replace,
    require,
    simulate,
)
from components.electrical import Capacitor, Ground, Resistor


class Band(Record):
    """Two bounds."""

    low: Param[Scalar, "1"]
    high: Param[Scalar, "1"]

    def requirements(self) -> Requirements:
        return (require(self.low < self.high, "low must be below high"),)


class Decay(Component):
    """T dx/dt = -x."""

    T: Param[Scalar, "s", positive]
    band: Band
    x: Var[Scalar, "m"] = 1.0

    def equations(self, d: Self) -> Equations:
        return dict(decay=eq(self.T * d.x, -self.band.high * self.x))


class Many(Component):
    """Decays one by one, which are checked together, a row of them, and a circuit that relates its parts."""

    single: tuple[Decay, ...]
    row: Parts[Decay]
    resistor: Resistor
    capacitor: Capacitor
    ground: Ground = Ground()

    def connections(self) -> Connections:
        return (
            connect(self.resistor.p, self.capacitor.p),
            connect(self.resistor.n, self.capacitor.n, self.ground.p),
        )

    def requirements(self) -> Requirements:
        slow = self.resistor.R * self.capacitor.C >= 1e-3
        return (require(slow, "resistor.R times capacitor.C must be at least 1e-3"),)


def decay() -> Decay:
    return Decay(T=1.0, band=Band(low=0.0, high=1.0))


def many() -> Many:
    resistor, capacitor = Resistor(R=10.0), Capacitor(C=1e-3)
    single = tuple(decay() for _ in range(12))
    return Many(single=single, row=repeat(decay(), 3), resistor=resistor, capacitor=capacitor)


CASES: dict[str, tuple[Callable[[Any], Any], Any, str]] = {
    "a range": (lambda m: m.single[7].T, -1.0, "single[7].T must be positive and finite, got -1.0 s."),
    "a relation in a record": (
        lambda m: m.single[3].band.low,
        2.0,
        "single[3].band.low must be below high, got band.low = 2.0, band.high = 1.0.",
    ),
    "a member of an array": (
        lambda m: m.row.item.band.high,
        np.array([1.0, -1.0, 1.0]),
        "row[1].band.low must be below high, got band.low = 0.0, band.high = -1.0.",
    ),
    "a relation of parts": (
        lambda m: m.resistor.R,
        0.5,
        "resistor.R times capacitor.C must be at least 1e-3, got resistor.R = 0.5 ohm, capacitor.C = 0.001 F.",
    ),
    "no number": (
        lambda m: m.row.item.band.low,
        np.array([0.0, 0.0, np.nan]),
        "row[2].band.low must be a finite number",
    ),
}
ENTRIES: dict[str, Callable[[Any], Any]] = {
    "simulate": lambda m: simulate(m, 0.1, save="end"),
    "initialise": lambda m: initialise(m, steady=True),
    "linearise": linearise,
}


@pytest.mark.parametrize("entry", ENTRIES)
@pytest.mark.parametrize("case", CASES)
def test_every_entry_refuses(case: str, entry: str) -> None:
    where, value, message = CASES[case]
    with pytest.raises(ParameterError) as caught:
        ENTRIES[entry](eqx.tree_at(where, many(), jnp.asarray(value)))
    assert str(caught.value).startswith(message)


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        ("single[7].T", -1.0, "single[7].T must be positive and finite, got -1.0 s."),
        ("single[7].T", np.inf, "single[7].T must be positive and finite, got inf s."),
        ("single[7].x", np.inf, "single[7].x must be a finite number, got inf m."),
        ("single[3].band.low", 2.0, "single[3].band.low must be below high, got low = 2.0, high = 1.0."),
        ("row.item.T", np.array([1.0, -1.0, 1.0]), "row.item.T must be positive and finite, got [ 1. -1.  1.] s."),
        ("resistor.R", 0.5, "resistor.R times capacitor.C must be at least 1e-3."),
    ],
)
def test_replace_refuses_like_a_constructor(path: str, value: Any, message: str) -> None:
    with pytest.raises(ParameterError) as caught:
        replace(many(), {path: value})
    assert str(caught.value) == message


def test_replace_sets_all_values_before_it_checks_them() -> None:
    shifted = replace(many(), {"single[3].band.low": 2.0, "single[3].band.high": 3.0})
    assert float(shifted.single[3].band.low) == 2.0


def test_replace_takes_any_traced_value() -> None:
    """A search may try a value outside the range; the run reports it as its result."""
    assert float(jax.jit(lambda T: replace(many(), {"single[7].T": T}).single[7].T)(-1.0)) == -1.0


@pytest.mark.parametrize("case", CASES)
def test_check_lists_them(case: str) -> None:
    where, value, message = CASES[case]
    problems = check(eqx.tree_at(where, many(), jnp.asarray(value))).problems
    assert len(problems) >= 1
    assert message.partition(" must")[2].partition(",")[0].rstrip(".") in problems[0]


@eqx.filter_jit
def _result(model: Any, throw: bool) -> Any:
    return simulate(model, 0.1, save="end", throw=throw).result


@pytest.mark.thorough
@pytest.mark.parametrize("case", CASES)
def test_under_jit_it_is_a_result(case: str) -> None:
    where, value, message = CASES[case]
    bad = eqx.tree_at(where, many(), jnp.asarray(value))
    assert _result(bad, False) == Result.bad_parameter
    with pytest.raises(RuntimeError) as caught:
        _result(bad, True)
    assert message.partition(", got")[0] in str(caught.value)
    assert _result(many(), False) == Result.reached_end


@pytest.mark.thorough
def test_derivatives_of_a_start_or_a_linear_system_without_one_are_not_numbers() -> None:
    where = CASES["a relation of parts"][0]
    at = lambda R: eqx.tree_at(where, many(), R)  # noqa: E731
    A = jax.jit(lambda R: linearise(at(R)).A)
    v = jax.jit(lambda R: initialise(at(R), steady=True).capacitor.v)
    assert np.all(np.isfinite(A(10.0)))
    assert not np.any(np.isfinite(A(0.5))[np.asarray(A(10.0)) != 0.0])
    assert np.isfinite(v(10.0))
    assert not np.isfinite(v(0.5))


def test_what_is_wrong_is_told_where_it_is_built() -> None:
    with pytest.raises(ParameterError, match=r"^Band.low must be below high, got low = 1.0, high = 1.0\.$"):
        Band(low=1.0, high=1.0)
    assert jax.jit(lambda low: Band(low=low, high=1.0).low)(2.0) == 2.0


@pytest.mark.thorough
def test_a_trial_that_is_differentiated_is_a_result() -> None:
    """As for an optimiser, which steps back from it."""

    def time(low: Any) -> Any:
        model = Decay(T=1.0, band=Band(low=low, high=1.0))
        sol = simulate(model, 1.0, until=lambda s: s.x - 0.5, save="end", throw=False)
        return sol.t1, sol.result == Result.bad_parameter

    for low, expected in ((0.0, np.log(2.0)), (2.0, np.inf)):
        t1, slope, is_bad = jax.jvp(time, (low,), (1.0,), has_aux=True)
        np.testing.assert_allclose((t1, slope), (expected, 0.0), rtol=1e-6, atol=1e-9)
        assert is_bad == (low > 1.0)
        assert jax.grad(time, has_aux=True)(low)[0] == pytest.approx(0.0, abs=1e-9)


class OfVariables(Component):
    x: Var[Scalar, "m"] = 1.0
    T: Param[Scalar, "s"] = 1.0

    def equations(self, d: Self) -> Equations:
        return dict(decay=eq(self.T * d.x, -self.x))

    def requirements(self) -> Requirements:
        return () if self.x is None else (require(self.x > 0.0, "x must be positive"),)


@pytest.mark.thorough
def test_requirements_are_about_parameters() -> None:
    with pytest.raises(ModelError, match=r"OfVariables.requirements uses x, which is not a parameter"):
        simulate(OfVariables(), 1.0)
