"""A closed loop that comes to rest where two edges of its valve meet, and is moved from there."""

from typing import Any, Self

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from acausal import Component, Equations, Param, Scalar, Time, Var, eq, simulate
from components._limit import limited

RTOL = 1e-9 * 1.1 ** np.arange(100.0)


class Loop(Component):
    """A spool at s meters the pressure p that moves x to what is demanded, which begins to fall at `start`."""

    t: Time[Scalar, "s"] = 0.0
    start: Param[Scalar, "s"] = 8.0
    gain: Param[Scalar, "1"] = 20.0
    x: Var[Scalar, "1"] = 0.0
    z: Var[Scalar, "1"] = 0.0
    s: Var[Scalar, "1"] = 0.0
    v: Var[Scalar, "1"] = 0.0
    p: Var[Scalar, "1"] = 0.0

    def equations(self, d: Self) -> Equations:
        lack = 0.012 - 0.001 * jnp.maximum(self.t - self.start, 0.0) ** 3 - self.x
        swing = 314.0 * (self.gain * (lack + self.z) - self.s) - 1.6 * self.v
        supply = limited(self.s, 0.0, 1.0) * jnp.sqrt(jnp.abs(4.0 - self.p) + 1e-6)
        drain = limited(-self.s, 0.0, 1.0) * jnp.sqrt(jnp.abs(self.p) + 1e-6)
        flow = 0.5 * (self.p - 1.0 - 100.0 * self.x)
        rates = dict(x=(d.x, flow), z=(d.z, 0.5 * lack), s=(d.s, self.v), v=(d.v, 314.0 * swing))
        rates |= dict(p=(d.p, 1000.0 * (supply - drain - flow)))
        return {name: eq(left, right, check_units=False) for name, (left, right) in rates.items()}


def end(rtol: Any, gain: Any = 20.0, start: Any = 8.0) -> tuple[Any, Any, Any]:
    solution = simulate(Loop(gain=gain, start=start), 10.0, rtol=rtol, save="end", throw=False, max_steps=20_000)
    return solution.final.x, solution.ts[-1], solution.stats["num_steps"]


@pytest.fixture(scope="module")
def exact() -> float:
    return float(end(1e-12)[0])


@pytest.mark.thorough
def test_it_ends_whatever_the_rounding(exact: float) -> None:
    """The edges neither undo each other nor open alternately without end."""
    x, reached, steps = jax.jit(jax.vmap(end))(RTOL)
    np.testing.assert_array_equal(reached, 10.0)
    np.testing.assert_allclose(x, exact, rtol=1e-4)
    assert np.max(steps) < 2000


@pytest.mark.thorough
def test_derivatives_through_the_rest(exact: float) -> None:
    """With respect to the start time of the motion: x depends only on the time since then."""
    step = 1e-4
    value, forward = jax.jvp(lambda start: end(1e-8, start=start)[0], (8.0,), (1.0,))
    backward = jax.grad(lambda start: end(1e-8, start=start)[0])(8.0)
    difference = (end(1e-11, start=8.0 + step)[0] - end(1e-11, start=8.0 - step)[0]) / (2.0 * step)
    np.testing.assert_allclose(value, exact, rtol=1e-6)
    np.testing.assert_allclose(forward, difference, rtol=1e-5)
    np.testing.assert_allclose(backward, forward, rtol=1e-9)
