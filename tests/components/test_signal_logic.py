"""Logic of signals: truth tables, and timers, latches and counters in one run."""

from typing import Any

import jax.numpy as jnp
import numpy as np
import pytest
from _rig import Rig
from _static_blocks import output

from acausal import Component, Connections, ParameterError, connect, simulate
from components import blocks

FALSE_TRUE = np.array([0.0, 0.0, 1.0, 1.0]), np.array([0.0, 1.0, 0.0, 1.0])


@pytest.mark.parametrize(
    ("block", "expected"),
    [(blocks.And(), [0, 0, 0, 1]), (blocks.Or(), [0, 1, 1, 1]), (blocks.Xor(), [0, 1, 1, 0])],
    ids=["And", "Or", "Xor"],
)
def test_truth_tables(block: Component, expected: list[int]) -> None:
    np.testing.assert_array_equal(output(block, *FALSE_TRUE, names=("u1", "u2")), expected)


def test_not() -> None:
    np.testing.assert_array_equal(output(blocks.Not(), [0.0, 1.0]), [1.0, 0.0])


def test_thresholds() -> None:
    block = blocks.Hysteresis(low=-0.5, high=1.0)
    np.testing.assert_array_equal(output(block, [-1.0, 0.0, 2.0]), [0.0, 0.0, 1.0])
    on = blocks.Hysteresis(low=-0.5, high=1.0, is_on=1.0)
    np.testing.assert_array_equal(output(on, [-1.0, 0.0, 2.0]), [0.0, 1.0, 1.0])
    with pytest.raises(ParameterError, match=r"Hysteresis\.low must be smaller than high"):
        blocks.Hysteresis(low=1.0, high=1.0)


def wire(pulse: Any, slow: Any, half: Any, *blocks_: Any) -> Connections:
    comparator, mono, delay, timer, latch, counter = blocks_
    return (
        connect(pulse.y, comparator.u1),
        connect(half.y, comparator.u2),
        connect(comparator.y, mono.u, delay.u, timer.u, latch.set, counter.u),
        connect(slow.y, latch.reset, counter.reset),
    )


def test_edges_start_timers_latches_and_counters() -> None:
    """Pulses of 0.4 s begin at 0.1, 1.1, ... s; the reset is 1 from 2.3 s to 2.8 s."""
    parts = (
        blocks.Pulse(amplitude=1.0, period=1.0, width=0.4, start_time=0.1),
        blocks.Pulse(amplitude=1.0, period=10.0, width=0.05, start_time=2.3),
        blocks.Constant(k=0.5),
        blocks.Comparator(),
        blocks.Monostable(T=0.15),
        blocks.OnDelay(T=0.3),
        blocks.Timer(),
        blocks.Latch(),
        blocks.Counter(),
    )
    t = np.array([0.05, 0.2, 0.3, 0.45, 0.6, 1.2, 2.2, 2.35, 2.7, 3.2])
    solution = simulate(Rig(parts=parts, wiring=wire), 3.3, save=jnp.asarray(t))
    found = np.array([solution.parts[i].y.value for i in range(3, 9)])
    expected = [
        [0, 1, 1, 1, 0, 1, 1, 1, 0, 1],
        [0, 1, 0, 0, 0, 1, 1, 0, 0, 1],
        [0, 0, 0, 1, 0, 0, 0, 0, 0, 0],
        [0, 0.1, 0.2, 0.35, 0, 0.1, 0.1, 0.25, 0, 0.1],
        [0, 1, 1, 1, 1, 1, 1, 0, 0, 1],
        [0, 1, 1, 1, 1, 2, 3, 0, 0, 1],
    ]
    np.testing.assert_allclose(found, expected, atol=1e-12)
