"""Limiters in positive feedback: relaxation oscillators keep their limits and their period."""

from typing import Any

import jax
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from acausal import Component, Connections, Scalar, connect, simulate
from components.blocks import FirstOrder, Gain, Limiter, Sum

END = 6.0  # in time constants of the slow lag: one to eight periods


class Multivibrator(Component):
    """An astable multivibrator: T x' = y - x and Tf y' = limited(k (h y - x)) - y.

    For k to infinity and Tf to zero, x swings between -h and h times the limit with the period
    2 T log((1 + h) / (1 - h)).
    """

    slow: FirstOrder
    difference: Sum
    gain: Gain
    limiter: Limiter
    fast: FirstOrder

    def connections(self) -> Connections:
        return (
            connect(self.fast.y, self.difference.u1, self.slow.u),
            connect(self.slow.y, self.difference.u2),
            connect(self.difference.y, self.gain.u),
            connect(self.gain.y, self.limiter.u),
            connect(self.limiter.y, self.fast.u),
        )


def multivibrator(k: Scalar, h: Scalar, T: Scalar, Tf: Scalar, limit: Scalar, x: Scalar) -> Multivibrator:
    return Multivibrator(
        slow=FirstOrder(T=T, x=x),
        difference=Sum(k1=h, k2=-1.0),
        gain=Gain(k=k),
        limiter=Limiter(u_min=-limit, u_max=limit),
        fast=FirstOrder(T=Tf),
    )


@jax.jit
def runs(numbers: Any, rtol: Any) -> Any:
    """Times of the steps, x there, and the limited signal on both sides of each event; infinite after the last."""

    def run(k: Scalar, h: Scalar, T: Scalar, Tf: Scalar, limit: Scalar, x: Scalar) -> Any:
        model = multivibrator(k, h, T, Tf, limit, x)
        sol = simulate(model, END * T, rtol=rtol, max_steps=2000, throw=False)
        return sol.ts, sol.slow.x, sol.limiter.y.value

    return jax.vmap(run)(*numbers)


def reference(k: float, h: float, T: float, Tf: float, limit: float, x: float) -> Any:
    """x as a function of time."""

    def rates(t: float, state: np.ndarray) -> list[float]:
        x, y = state
        return [(y - x) / T, (np.clip(k * (h * y - x), -limit, limit) - y) / Tf]

    found = solve_ivp(rates, (0.0, END * T), [x, 0.0], "LSODA", dense_output=True, rtol=1e-10, atol=1e-12 * limit)
    return lambda t: found.sol(t)[0]


def drawn(n: int) -> np.ndarray:
    draw = np.random.default_rng(3)
    T, limit = 10.0 ** draw.uniform(-3.0, 1.0, n), 10.0 ** draw.uniform(-1.0, 3.0, n)
    k, h = 10.0 ** draw.uniform(1.5, 5.0, n), draw.uniform(0.2, 0.6, n)
    return np.array([k, h, T, T * 10.0 ** draw.uniform(-4.0, -1.0, n), limit, limit * draw.uniform(-1.0, 1.0, n)])


# Period 2.197 ms
TYPICAL = np.array([[1e5, 0.5, 1e-3, 1e-6, 10.0, 1.0], [1.5e4, 0.5, 1e-3, 1e-7, 10.0, 1.0]]).T
NUMBERS = np.concatenate([TYPICAL, drawn(6)], axis=1)
LIMITS = NUMBERS[4]


@pytest.mark.thorough
@pytest.mark.parametrize("rtol", [1e-4, 1e-6])
def test_the_output_keeps_the_limits(rtol: float) -> None:
    y = runs(NUMBERS, rtol)[2]
    largest = [np.max(np.abs(row[np.isfinite(row)])) for row in np.asarray(y)]
    np.testing.assert_array_less(largest, LIMITS * (1.0 + 1e-6))


@pytest.mark.thorough
def test_the_loop_switches_in_time() -> None:
    """Within a hundred times the tolerance after up to ten periods."""
    ts, xs, _ = (np.asarray(rows) for rows in runs(NUMBERS, 1e-6))
    for numbers, t, x in zip(NUMBERS.T, ts, xs, strict=True):
        t, x = t[np.isfinite(t)], x[np.isfinite(t)]
        assert t[-1] == pytest.approx(END * numbers[2], rel=1e-12)
        np.testing.assert_allclose(x, reference(*numbers)(t), atol=1e-4 * numbers[4])
