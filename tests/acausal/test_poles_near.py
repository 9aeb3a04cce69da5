"""Linear systems of many states: sparse derivatives, and the poles closest to a shift."""

import numpy as np
import pytest

from acausal import ArgumentError, linearise
from benchmarks._wall import CONDUCTANCE, wall

N = 60


def wall_poles(n: int) -> np.ndarray:
    """The poles of a wall with one warm and one insulated end, capacities of 1 J/K, slowest first."""
    return -2.0 * CONDUCTANCE * (1.0 - np.cos((2.0 * np.arange(n) + 1.0) * np.pi / (2.0 * n + 1.0)))


def test_poles_near_a_shift_are_those_of_the_wall() -> None:
    system = linearise(wall(N), inputs=["hot.temperature"], outputs=["conductors[0].Q_flow"])
    expected = wall_poles(N)
    np.testing.assert_allclose(system.poles_near(count=5), expected[:5], rtol=1e-9)
    np.testing.assert_allclose(np.sort(system.poles_near(-2.0 * CONDUCTANCE, 4)), np.sort(
        expected[np.argsort(np.abs(expected + 2.0 * CONDUCTANCE))[:4]]), rtol=1e-9)  # fmt: skip
    np.testing.assert_allclose(system.poles_near(1.0 + 2.0j, 2), expected[:2], rtol=1e-9)
    np.testing.assert_allclose(np.sort(system.poles_near(count=N)), np.sort(expected), rtol=1e-9)
    # The heat flow into the wall is G (hot - T[0]).
    np.testing.assert_allclose(system.B, CONDUCTANCE * np.eye(N)[:, :1], rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(system.C, -CONDUCTANCE * np.eye(N)[:1], rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(system.D, [[CONDUCTANCE]], rtol=1e-12)
    with pytest.raises(ArgumentError, match="ask for 1 to 60 poles"):
        system.poles_near(count=N + 1)


def test_a_shift_that_is_a_pole_is_refused() -> None:
    system = linearise(wall(N), inputs=["hot.temperature"])
    free = system._replaced(A=np.zeros((N, N)))
    with pytest.raises(ArgumentError, match="a shift beside it"):
        free.poles_near()
