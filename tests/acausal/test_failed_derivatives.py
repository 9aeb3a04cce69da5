"""Derivatives of runs and searches that fail: under `jit` they raise as the run does, or are not a number."""

from collections.abc import Callable
from typing import Any, Self

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _models import oscillator, rc

from acausal import Component, Equations, Events, Param, Scalar, Var, eq, initialise, refuse, simulate


class Fall(Component):
    """x falls from 1 at the rate k, must not be below the limit, and its root is no number below zero."""

    k: Param[Scalar, "1/s"]
    limit: Param[Scalar, ""]
    x: Var[Scalar, ""] = 1.0
    root: Var[Scalar, ""] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(fall=eq(d.x, -self.k), root=eq(self.root, jnp.sqrt(self.x)))

    def events(self) -> Events:
        return dict(low=refuse(self.x < self.limit, "x is below its limit"))


def charged(R: Scalar, save: Any = "end", **options: Any) -> Any:
    return simulate(eqx.tree_at(lambda m: m.r.R, rc(), R), 0.1, save=save, **options)


def fallen(k: Scalar, limit: float) -> Scalar:
    return simulate(Fall(k=k, limit=limit), 1.0, save="end").final.x


LOOKS: dict[str, tuple[Callable[[Any], Any], float, float, str]] = {  # a point that is fine, one that fails, and why
    "never_stopped": (lambda R: charged(R, until=lambda s: s.c.v - 3.0).t1, 100.0, 200.0, "never met"),
    "too_many_steps": (lambda R: charged(R, max_steps=20).final.c.v, 100.0, 0.1, "maximum number of steps"),
    "bad_parameter": (lambda R: charged(R).final.c.v, 100.0, -100.0, "must be nonnegative"),
    "saved values": (lambda R: charged(R, save=jnp.linspace(0.0, 0.1, 3))["c.v"][1], 100.0, -100.0, "nonnegative"),
    "refused": (lambda k: fallen(k, 0.5), 0.4, 2.0, "cannot do what is asked"),
    "not_finite": (lambda k: fallen(k, -9.0), 0.4, 2.0, "infinite or not a number"),
}
MODES = {"grad": jax.grad, "jacfwd": jax.jacfwd, "hessian": jax.hessian, "batch": lambda f: jax.vmap(jax.grad(f))}
CASES = [(name, mode) for name in LOOKS for mode in ("grad", "jacfwd")]
CASES += [("never_stopped", "hessian"), ("never_stopped", "batch")]


@pytest.mark.thorough
@pytest.mark.parametrize(("name", "mode"), CASES)
def test_a_derivative_raises_under_jit_as_the_run_does(name: str, mode: str) -> None:
    look, fine, wrong, message = LOOKS[name]
    derivative = eqx.filter_jit(MODES[mode](look))
    points = jnp.asarray([[fine, fine], [fine, wrong]] if mode == "batch" else [fine, wrong])
    assert np.all(np.isfinite(derivative(points[0])))
    with pytest.raises(RuntimeError, match=message):
        derivative(points[1])


@pytest.mark.thorough
@pytest.mark.parametrize("mode", [jax.grad, jax.jacfwd])
def test_checks_leave_derivatives_as_they_are(mode: Any) -> None:
    look = LOOKS["bad_parameter"][0]
    np.testing.assert_allclose(jax.jit(mode(look))(100.0), mode(look)(100.0), rtol=1e-12)


@pytest.mark.parametrize("mode", [lambda f: f, jax.grad, jax.jacfwd])
def test_where_there_is_no_start_derivatives_are_no_numbers(mode: Any) -> None:
    def stretched(c: Scalar) -> Scalar:
        model = oscillator(c=c)
        both = lambda s, d: dict(one=eq(s.link.s_rel, 2.0), other=eq(s.link.s_rel, c))  # noqa: E731
        return initialise(model, both, free="all").link.s_rel

    derivative = jax.jit(mode(stretched))
    assert np.isfinite(derivative(2.0))
    assert np.isnan(derivative(3.0))
