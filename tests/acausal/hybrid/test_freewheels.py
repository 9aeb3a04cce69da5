"""Freewheels that lock and overrun: pressed or not, in motion or from rest."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _freewheels import by_hand, driven

from acausal import simulate

END = 2.0
TIMES = np.linspace(0.0, END, 41)
TOLERANCES = np.array([1e-4, 1e-6, 1e-8])


@jax.jit
@jax.vmap
def of_two(numbers: Any, rtol: Any) -> Any:
    sol = simulate(driven(*numbers), END, rtol=rtol, save=TIMES, throw=False)
    return jnp.stack([sol.first.w, sol.second.w])


def compared(run: Any, cases: np.ndarray, expected: np.ndarray) -> None:
    """With each of the tolerances, within a hundred times of it."""
    n = len(TOLERANCES)
    found = run(np.repeat(cases, n, axis=0), np.tile(TOLERANCES, len(cases)))
    errors = np.max(np.abs(np.asarray(found) - np.repeat(expected, n, axis=0)), axis=(1, 2))
    np.testing.assert_array_less(errors.reshape(-1, n), 100.0 * np.tile(TOLERANCES, (len(cases), 1)))


def drawn(n: int) -> np.ndarray:
    """Speeds at the start, half of them equal, phase of the torque, and how strongly and when clutches are pressed."""
    draw = np.random.default_rng(4)
    w1 = draw.uniform(-2.0, 1.0, n)
    ahead = draw.uniform(0.0, 2.0, n) * (np.arange(n) % 2)
    # Far enough from the level at which the largest torque breaks a clutch away
    pressed = np.choose(draw.integers(0, 3, n), np.array([np.zeros(n), np.ones(n), draw.uniform(0.0, 0.1, n)]))
    return np.column_stack([w1, w1 + ahead, draw.uniform(0.0, 2.0 * np.pi, n), pressed, draw.uniform(0.0, 0.5, n)])


# That of the Modelica Standard Library, with the clutch pressed or not, and from rest with the torque either way
EXAMPLES = np.array(
    [
        [-0.5, 0.0, 0.0, 1.0, 0.3],
        [-0.5, 0.0, 0.0, 0.0, 0.3],
        [0.0, 0.0, 0.0, 1.0, 0.3],
        [0.0, 0.0, 0.0, 0.0, 0.3],
        [0.0, 0.0, np.pi, 1.0, 0.3],
        [0.0, 0.0, np.pi, 0.0, 0.3],
    ]
)


@pytest.mark.thorough
def test_a_clutch_that_overruns() -> None:
    cases = np.concatenate([EXAMPLES, drawn(10)])
    compared(of_two, cases, np.array([by_hand(case, TIMES) for case in cases]))
