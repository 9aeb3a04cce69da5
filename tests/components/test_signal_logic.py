"""Logic of signals: truth tables, and timers, latches and counters in one run."""

from typing import Any

import jax.numpy as jnp
import numpy as np
import pytest
from _rig import Rig
from _static_blocks import output

from acausal import Component, Connections, ParameterError, connect, initialise, simulate
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


def test_a_latch_follows_its_set_again_after_a_reset() -> None:
    def wire(one: Any, pulse: Any, latch: Any) -> Connections:
        return connect(one.y, latch.set), connect(pulse.y, latch.reset)

    parts = (blocks.Constant(k=1.0), blocks.Pulse(amplitude=1.0, period=1.0, width=0.3, start_time=0.2), blocks.Latch())
    solution = simulate(Rig(parts=parts, wiring=wire), 1.0, save=jnp.array([0.1, 0.4, 0.6]))
    np.testing.assert_array_equal(solution.parts[2].y.value, [1.0, 0.0, 1.0])


@pytest.mark.parametrize("initialised", [False, True])
def test_delays_and_pulses_of_no_duration_end_at_the_start_of_a_run(initialised: bool) -> None:
    def wire(one: Any, delay: Any, mono: Any) -> Connections:
        return (connect(one.y, delay.u, mono.u),)

    parts = (blocks.Constant(k=1.0), blocks.OnDelay(T=0.0), blocks.Monostable(T=0.0))
    model = Rig(parts=parts, wiring=wire)
    solution = simulate(initialise(model) if initialised else model, 1.0, save="end")
    assert float(solution.final.parts[1].y.value) == 1.0
    assert float(solution.final.parts[2].y.value) == 0.0


def sequence(start: Any, machine: Any, wait: Any, level: Any, full: Any) -> Connections:
    """Waiting, filling until the level is reached, resting for a time, and back."""
    return (
        connect(start.y, machine.u[0]),
        connect(machine.y[1], level.u),
        connect(level.y, full.u),
        connect(full.y, machine.u[1]),
        connect(machine.y[2], wait.u),
        connect(wait.y, machine.u[2]),
    )


def test_a_state_machine_goes_through_its_states() -> None:
    """The start at 0.5 s; the level rises at 1 per second to 0.8; the rest takes 0.4 s; the level then remains."""
    parts = (
        blocks.Pulse(amplitude=1.0, period=10.0, width=0.01, start_time=0.5),
        blocks.StateMachine(transitions=[(0, 1), (1, 2), (2, 0)]),
        blocks.OnDelay(T=0.4),
        blocks.Integrator(),
        blocks.Hysteresis(low=-1.0, high=0.8),
    )
    t = np.array([0.4, 0.6, 1.2, 1.4, 1.6, 1.8])
    solution = simulate(Rig(parts=parts, wiring=sequence), 2.0, save=jnp.asarray(t))
    np.testing.assert_array_equal(solution.parts[1].state, [0, 1, 1, 2, 2, 0])
    np.testing.assert_array_equal(solution.parts[1].y[1].value, [0, 1, 1, 0, 0, 0])
    names = [name for name in solution.events.names if name.startswith("parts[1].transition")]
    times = [t for t, name in zip(solution.events.times, solution.events.names, strict=True) if name in names]
    np.testing.assert_allclose(times, [0.5, 1.3, 1.7], atol=1e-9)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (dict(transitions=[(0, 2)]), r"must name each of the states 0, 1, \.\.\., got \[0, 2\]"),
        (dict(transitions=[(0, 1)], state=2), "state must be one of the states of the transitions, got 2"),
    ],
)
def test_states_are_numbered_without_gaps(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        blocks.StateMachine(**arguments)
