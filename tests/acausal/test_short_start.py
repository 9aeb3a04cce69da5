"""The end of a run less some rounding is one operation, and as good as the hundred of diffrax."""

from typing import Self

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from acausal import Component, Equations, Param, Scalar, Var, eq, simulate
from acausal._diffrax_private import Before


class Decay(Component):
    """x' = -k x."""

    k: Param[Scalar, "1/s"] = 1.0
    x: Var[Scalar, ""] = 1.0

    def equations(self, d: Self) -> Equations:
        return dict(decay=eq(d.x, -self.k * self.x))


@pytest.mark.parametrize("number", [1.0, 1.9999, -3.0, 0.0, 1e-300, 1e300])
def test_less_by_about_so_many_ulps(number: float) -> None:
    found = float(jnp.asarray(number) - Before(number, 100).__jax_array__())
    expected = number
    for _ in range(100):
        expected = np.nextafter(expected, -np.inf)
    least = max(number - expected, 100 * np.finfo(float).tiny)  # denormal numbers count as zero
    assert least <= found <= 2.1 * least


def test_steps_are_those_of_diffrax() -> None:
    ours, theirs = (simulate(Decay(), 2.0, adjoint=adjoint) for adjoint in (None, diffrax.ForwardMode()))
    np.testing.assert_array_equal(ours.ts, theirs.ts)


@pytest.mark.parametrize("differentiated", [False, True])
def test_no_operation_of_the_hundred_is_left(differentiated: bool) -> None:
    def end(k: Scalar) -> Scalar:
        return simulate(Decay(k=k), 2.0, save="end").final.x

    function = jax.grad(end) if differentiated else end
    assert "nextafter" not in str(jax.make_jaxpr(function)(1.0))
