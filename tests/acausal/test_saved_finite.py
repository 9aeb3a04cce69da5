"""Values that are saved are finite, or the run fails."""

from typing import Any, Self

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from acausal import (
    Component,
    Discrete,
    Equations,
    Events,
    Param,
    Result,
    Scalar,
    SimulationError,
    Var,
    at,
    eq,
    prefer,
    simulate,
    when,
)

END = 2.0 * np.pi
NEGATIVE = np.linspace(0.0, END, 11)  # the sine is below -1/2 at some of them
POSITIVE = np.array([0.0, 1.0, 3.0, 6.0])


class Wave(Component):
    """A sine x, and the logarithm of x + level, on which nothing depends."""

    level: Param[Scalar, ""] = 0.5
    T: Param[Scalar, "s"] = 1.0
    x: Var[Scalar, "", prefer] = 0.0
    v: Var[Scalar, "", prefer] = 1.0
    log: Var[Scalar, ""] = 0.0
    due: Discrete[Scalar, "s"] = np.inf  # never

    def equations(self, d: Self) -> Equations:
        return dict(
            sine=eq(self.T * d.x, self.v),
            cosine=eq(self.T * d.v, -self.x),
            law=eq(self.log, jnp.log(self.x + self.level)),
        )

    def events(self) -> Events:
        return dict(never=at(self.due, v=0.0))


@pytest.mark.thorough
@pytest.mark.parametrize("save", ["steps", "dense", NEGATIVE], ids=["steps", "dense", "times"])
def test_a_saved_value_that_is_not_finite_is_a_failure(save: Any) -> None:
    assert simulate(Wave(), END, save=save, throw=False).result == Result.not_finite
    with pytest.raises(SimulationError, match=r"At t = (3\.[7-9]|[45])\S* s: .*not a number\. The first one is log"):
        simulate(Wave(), END, save=save)
    assert simulate(Wave(level=1.5), END, save=save).result == Result.reached_end


@pytest.mark.parametrize("save", ["end", POSITIVE], ids=["end", "times"])
def test_what_is_not_saved_does_not_count(save: Any) -> None:
    assert simulate(Wave(), END, save=save).result == Result.reached_end


class Falling(Component):
    """A height that is set back just below zero, and its square root."""

    speed: Param[Scalar, "m/s"] = 1.0
    least: Param[Scalar, "m"] = -0.1
    h: Var[Scalar, "m", prefer] = 1.0
    root: Var[Scalar, ""] = 1.0

    def equations(self, d: Self) -> Equations:
        return dict(fall=eq(d.h, -self.speed), root=eq(self.root, jnp.sqrt(self.h), check_units=False))

    def events(self) -> Events:
        return dict(back=when(self.h < self.least, h=1.0))


@pytest.mark.thorough
def test_a_value_just_before_an_event_counts_where_it_is_shown() -> None:
    first = simulate(Falling(), 1.2, save="steps", dt0=2.0, throw=False)
    assert np.isnan(first.root).sum() == 1
    assert first.result == Result.not_finite
    assert simulate(Falling(), 1.2, save=np.array([0.9, 1.15])).result == Result.reached_end


@pytest.mark.thorough
def test_it_raises_under_jit_and_in_derivatives() -> None:
    def last(level: Scalar) -> Scalar:
        return simulate(eqx.tree_at(lambda m: m.level, Wave(), level), END, save=NEGATIVE).x[-2]

    for function in (last, jax.grad(last), jax.jacfwd(last)):
        compiled = eqx.filter_jit(function)
        assert np.isfinite(compiled(jnp.asarray(1.5)))
        with pytest.raises(RuntimeError, match="infinite or not a number"):
            compiled(jnp.asarray(0.5))


@pytest.mark.thorough
def test_members_of_a_batch_fail_alone() -> None:
    def result(level: Scalar) -> Any:
        return simulate(eqx.tree_at(lambda m: m.level, Wave(), level), END, save=NEGATIVE, throw=False).result

    found = jax.vmap(result)(jnp.array([0.5, 1.5]))
    np.testing.assert_array_equal(found == Result.reached_end, [False, True])


@pytest.mark.thorough
@pytest.mark.parametrize(
    "function", [lambda s: jnp.log(s.x + 0.5), lambda s: {"x": s.x, "root": jnp.sqrt(0.5 - s.x)}, lambda s: s.x / 0.0]
)
def test_integrals_that_are_not_finite_are_named(function: Any) -> None:
    with pytest.raises(SimulationError, match=r"At t = \S* s: .*all variables are finite here.*`integrals`"):
        simulate(Wave(level=1.5), END, integrals=function, save="end")


@pytest.mark.thorough
@pytest.mark.parametrize("within", [lambda f: f, jax.jit])
def test_a_function_without_a_value_in_a_part_of_the_run_has_no_peak(within: Any) -> None:
    """The sine falls below -1/2 after its largest value, and rises again."""

    @within
    def peaks(t1: Any) -> Any:
        return simulate(Wave(level=1.5), t1, save="end", peaks=lambda s: {"log": jnp.log(s.x + 0.5), "x": s.x}).peaks

    found = peaks(END)
    assert np.isnan(found["log"].value)
    assert found["x"].value == pytest.approx(1.0, abs=1e-5)
    assert peaks(3.0)["log"].value == pytest.approx(np.log(1.5), abs=1e-5)
