"""Values that events set while start values are searched for: they have derivatives, modes have none."""

from typing import Self

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from acausal import Component, Discrete, Equations, Events, Param, Scalar, Var, initialise, prefer, when
from acausal import eq as equals
from acausal._evaluate.building import system_of
from acausal._integrate.start.start_modes import sets_values


class Latched(Component):
    """At rest x = u; beyond 2, what was measured there and u are latched, and by that the second latch."""

    u: Param[Scalar, "1"]
    T: Param[Scalar, "s"] = 1.0
    x: Var[Scalar, "1", prefer] = 0.0
    z: Var[Scalar, "1", prefer] = 0.0
    latch: Discrete[Scalar, "1"] = 0.0
    second: Discrete[Scalar, "1"] = 1.0
    mode: Discrete[Scalar, "1"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(
            follow=equals(self.T * d.x, (1.0 + self.mode) * self.u - self.x),
            store=equals(self.T * d.z, self.second * self.latch - self.z),
        )

    def events(self) -> Events:
        return dict(
            beyond=when(self.x > 2.0, latch=2.0 * self.u + self.x**2, mode=1.0),
            far=when(self.z > 5.0, second=self.x * self.latch),
        )


def rest(u: Scalar) -> Scalar:
    return initialise(Latched(u=u), steady=True).z


@pytest.mark.thorough
def test_derivatives_of_what_is_latched() -> None:
    """The latch takes 2 u + u^2, measured in the mode before, and the second one x times that, with x = 2 u then; below
    the threshold nothing is latched. To second order, in both modes, under `jit` and `vmap`.
    """
    u = jnp.array([1.5, 3.0])
    exact = lambda u: 2.0 * u * (2.0 * u + u**2) ** 2  # noqa: E731
    found = jax.jit(jax.vmap(lambda u: (rest(u), jax.jacfwd(rest)(u), jax.grad(rest)(u))))(u)
    np.testing.assert_allclose(found[0], [0.0, exact(3.0)], rtol=1e-10, atol=1e-12)
    for slopes in found[1:]:
        np.testing.assert_allclose(slopes, [0.0, jax.grad(exact)(3.0)], rtol=1e-9, atol=1e-12)
    second = jax.jit(jax.jacfwd(jax.grad(rest)))(3.0)
    assert float(second) == pytest.approx(float(jax.hessian(exact)(3.0)), rel=1e-8)


class Switched(Component):
    """An event that chooses one of two numbers by what is measured."""

    x: Var[Scalar, "s"] = 1.0
    mode: Discrete[Scalar, "1"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(decay=equals(d.x, self.mode))

    def events(self) -> Events:
        return dict(low=when(self.x < 0.0, mode=jnp.where(jnp.abs(self.x) > 1.0, 1.0, -1.0)))


@pytest.mark.thorough
def test_modes_take_the_shorter_way() -> None:
    """Values without derivatives are not differentiated."""
    for model, expected in ((Switched(), False), (Latched(u=1.0), True)):
        assert sets_values(system_of(model)) is expected
