"""Equations solved for an unknown that occurs once, by inverse operations."""

from collections.abc import Callable
from typing import Any, Self

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from acausal import Component, Equations, Param, Scalar, Var, eq, positive, simulate, structure
from acausal._reduce.forms import POSITIVE, parameter, solved_for, variable
from acausal._reduce.jaxpr import as_function

FORMS = [variable(0), variable(1), parameter(POSITIVE)]  # of x, y and the positive parameter p
VALUES = 0.7, -3.0, 2.5


def inverse_of(law: Callable[..., Any]) -> Any:
    return solved_for(jax.make_jaxpr(law)(1.0, 1.0, 1.0), FORMS, 0)


@pytest.mark.parametrize(
    "law",
    [
        lambda x, y, p: y - 1.0 / x,
        lambda x, y, p: p / x - y,
        lambda x, y, p: y + 2.0 / (p * (1.0 - x)),
        lambda x, y, p: -(1.0 / (3.0 + p / x)) / y + p,
        lambda x, y, p: (y + p) - (p / (x - y)) * 4.0,
    ],
)
def test_root(law: Callable[..., Any]) -> None:
    """The residual x - f(y, p) is linear in x, and has the root of the law."""
    inverse = inverse_of(law)
    x, y, p = VALUES
    residual = as_function(inverse)(x, y, p)
    np.testing.assert_allclose(law(x - residual, y, p), 0.0, atol=1e-14)


@pytest.mark.parametrize(
    "law",
    [
        lambda x, y, p: x - p / x,  # x occurs twice
        lambda x, y, p: p - y / x,  # has no root if y is zero, where x = y / p is zero
        lambda x, y, p: p - y * (p / x),
        lambda x, y, p: y - jnp.sin(x),  # many roots
        lambda x, y, p: y - jnp.where(p > 1.0, 1.0 / x, p),
    ],
)
def test_without_inverse(law: Callable[..., Any]) -> None:
    assert inverse_of(law) is None


def test_array_that_is_summed_has_no_inverse() -> None:
    closed = jax.make_jaxpr(lambda x, y: y - 1.0 / jnp.sum(x))(jnp.ones(3), 1.0)
    assert solved_for(closed, FORMS[:2], 0) is None


class Leak(Component):
    """A reluctance that decays, and its permeance."""

    T: Param[Scalar, "s", positive] = 2.0
    R: Var[Scalar, "1/H"] = 1e7
    G: Var[Scalar, "H"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(decay=eq(d.R, -self.R / self.T), permeance=eq(self.R, 1.0 / self.G))


@pytest.mark.thorough
def test_reciprocal_needs_no_guess() -> None:
    """G = 1e-7 exp(t / T), and its derivative by T. Newton's method from the guess 0 would divide by zero."""
    assert structure(Leak()).blocks[-1].kind == "explicit"

    def end(T: jax.Array) -> jax.Array:
        return simulate(Leak(T=T), 1.0, rtol=1e-9, save="end")["G"][-1]

    value, slope = jax.jvp(end, (jnp.asarray(2.0),), (jnp.asarray(1.0),))
    np.testing.assert_allclose(value, 1e-7 * np.exp(0.5), rtol=1e-7)
    np.testing.assert_allclose(slope, -value / 4.0, rtol=1e-6)
