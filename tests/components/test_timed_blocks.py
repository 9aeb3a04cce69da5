"""Signals that jump at given times: landing on the jumps, derivatives, sampled control."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _rig import Rig

from acausal import Connections, ParameterError, Scalar, connect, replace, simulate
from acausal._declare.layout import complete
from components import blocks

TIMES = np.array([0.0, 0.35, 0.9, 1.7, 2.9])


def wire_sources(*parts: Any) -> Connections:
    half = len(parts) // 2
    return tuple(connect(source.y, reader.u) for source, reader in zip(parts[:half], parts[half:], strict=True))


@pytest.fixture(scope="module")
def sources() -> Any:
    """All sources with events in one run, each with an integrator behind it."""
    parts = (
        blocks.Step(height=2.0, offset=0.5, start_time=1.0),
        blocks.Ramp(height=2.0, duration=1.4, offset=0.5, start_time=0.3),
        blocks.Pulse(amplitude=2.0, period=1.0, width=0.5, offset=0.5, start_time=0.3),
        blocks.SawTooth(amplitude=2.0, period=1.0, start_time=0.3),
    )
    model = Rig(parts=(*parts, *(blocks.Integrator() for _ in parts)), wiring=wire_sources)
    return simulate(model, 2.9, save=jnp.asarray(TIMES), rtol=1e-10)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("index", "expected", "area"),
    [
        (0, [0.5, 0.5, 0.5, 2.5, 2.5], 0.5 * 2.9 + 2.0 * 1.9),
        (1, [0.5, 0.5 + 2.0 * 0.05 / 1.4, 0.5 + 2.0 * 0.6 / 1.4, 2.5, 2.5], 0.5 * 2.9 + 0.5 * 2.0 * 1.4 + 2.0 * 1.2),
        (2, [0.5, 2.5, 0.5, 2.5, 0.5], 0.5 * 2.9 + 2.0 * 1.5),
        (3, [0.0, 0.1, 1.2, 0.8, 1.2], 2.0 + 0.6**2),
    ],
    ids=["Step", "Ramp", "Pulse", "SawTooth"],
)
def test_source(sources: Any, index: int, expected: list[float], area: float) -> None:
    """Values between the jumps, and the integral over all of them, which has no error of a step across a jump."""
    np.testing.assert_allclose(sources.parts[index].y.value, expected, atol=1e-12)
    np.testing.assert_allclose(sources.parts[4 + index].x[-1], area, atol=1e-10)


def wire_step(step: Any, integrator: Any) -> Connections:
    return (connect(step.y, integrator.u),)


@pytest.mark.slow
def test_derivative_with_respect_to_the_time_of_a_jump() -> None:
    def area(start_time: Scalar) -> Scalar:
        parts = (blocks.Step(height=2.0, start_time=start_time), blocks.Integrator())
        return simulate(Rig(parts=parts, wiring=wire_step), 3.0, save="end").final.parts[1].x

    value, slope = jax.value_and_grad(area)(1.2)
    np.testing.assert_allclose([value, slope, jax.jacfwd(area)(1.2)], [3.6, -2.0, -2.0], rtol=1e-10)


@pytest.mark.thorough
def test_a_run_that_begins_late_begins_with_the_values_of_then() -> None:
    parts = (
        blocks.Pulse(amplitude=2.0, period=1.0, width=0.5),
        blocks.SawTooth(amplitude=2.0, period=1.0),
        blocks.Integrator(),
        blocks.Integrator(),
    )
    model = Rig(parts=parts, wiring=wire_sources)
    solution = simulate(model, 9.2, t0=7.25, save=jnp.array([7.3, 7.7, 9.2]), rtol=1e-10)
    np.testing.assert_allclose(solution.parts[0].y.value, [2.0, 0.0, 2.0], atol=1e-12)
    np.testing.assert_allclose(solution.parts[1].y.value, [0.6, 1.4, 0.4], atol=1e-12)


def wire_loop(set_point: Any, controller: Any, plant: Any, hold: Any, pwm: Any, mean: Any) -> Connections:
    return (
        connect(set_point.y, controller.u_s),
        connect(plant.y, controller.u_m, hold.u),
        connect(controller.y, plant.u, pwm.u),
        connect(pwm.y, mean.u),
    )


@pytest.mark.slow
def test_sampled_control() -> None:
    """The plant T dx/dt = y - x between samples is x -> y + (x - y) exp(-h / T): the loop is a recursion."""
    h, T, k, Ti = 0.1, 0.5, 0.6, 0.4
    parts = (
        blocks.Constant(k=1.0),
        blocks.SampledPI(period=h, k=k, T=Ti, y_max=0.9),
        blocks.FirstOrder(T=T),
        blocks.SampleHold(period=2.0 * h),
        blocks.PWM(period=h),
        blocks.Integrator(),
    )
    grid = np.arange(10) * h + 0.05
    solution = simulate(Rig(parts=parts, wiring=wire_loop), 0.999999, save=jnp.asarray(grid), rtol=1e-10)
    x, part, outputs, held = 0.0, 0.0, [], []
    for i in range(10):
        held.append(x if i % 2 == 0 else held[-1])
        error = 1.0 - x
        wanted = k * (error + part + error * h / Ti)
        if wanted <= 0.9:
            part += error * h / Ti
        outputs.append(min(wanted, 0.9))
        x = outputs[-1] + (x - outputs[-1]) * np.exp(-h / T)
    assert max(outputs) == 0.9
    np.testing.assert_allclose(solution.parts[1].y.value, outputs, atol=1e-8)
    np.testing.assert_allclose(solution.parts[3].y.value, held, atol=1e-8)


def sampled_outputs(k: float, errors: list[float]) -> list[float]:
    """The outputs of a sampled controller with limits of 0.9 for errors at its samples."""
    outputs, x = [], 0.0
    for error in errors:
        block = blocks.SampledPI(period=0.1, k=k, T=0.4, y_min=-0.9, y_max=0.9)
        here = complete(replace(block, {"u_s.value": error, "u_m.value": 0.0, "x": x}))
        sample: Any = here.events()["sample"]
        outputs.append(float(sample.changes["held"]))
        x = float(sample.changes["x"])
    return outputs


@pytest.mark.parametrize("k", [0.6, -0.6])
def test_a_sampled_controller_does_not_wind_up(k: float) -> None:
    """With an error of 1, x stops at 0.5, because 0.6 (1 + x) reaches 0.9; from there it goes on without a delay."""
    outputs = sampled_outputs(k, [1.0] * 20 + [0.0, -0.4])
    np.testing.assert_allclose(outputs[:4], np.sign(k) * np.array([0.75, 0.9, 0.9, 0.9]), rtol=1e-12)
    np.testing.assert_allclose(outputs[-2:], [k * 0.5, 0.0], atol=1e-12)


def test_limits_of_a_sampled_controller_are_checked() -> None:
    with pytest.raises(ParameterError, match=r"SampledPI.y_min must be smaller than y_max"):
        blocks.SampledPI(period=0.1, k=1.0, T=1.0, y_min=1.0, y_max=0.0)


@pytest.mark.thorough
def test_two_point_control() -> None:
    """T dx/dt = y - x between two thresholds is exponentials: on and off times are logarithms."""
    set_point, bandwidth, T = 0.5, 0.2, 0.4
    low, high = set_point - 0.5 * bandwidth, set_point + 0.5 * bandwidth
    parts = (blocks.Constant(k=set_point), blocks.TwoPointController(bandwidth=bandwidth), blocks.FirstOrder(T=T))
    solution = simulate(Rig(parts=parts, wiring=wire_two_points), 2.0, rtol=1e-11)
    rising, falling = T * np.log((1.0 - low) / (1.0 - high)), T * np.log(high / low)
    first = T * np.log(1.0 / (1.0 - high))
    expected = first + np.concatenate([[0.0], np.cumsum(np.tile([falling, rising], 9))])
    expected = expected[expected < 2.0]
    # At the start, it switches on.
    assert solution.events.names[1:] == [f"parts[1].{('off', 'on')[i % 2]}" for i in range(len(expected))]
    np.testing.assert_allclose(solution.events.times[1:], expected, rtol=1e-8)


def wire_two_points(set_point: Any, controller: Any, plant: Any) -> Connections:
    return (
        connect(set_point.y, controller.u_s),
        connect(controller.y, plant.u),
        connect(plant.y, controller.u_m),
    )


@pytest.mark.thorough
def test_pulses_that_follow_each_other_at_once_are_on_all_the_time() -> None:
    """The fall of one pulse is the rise of the next, for any start time in the past."""

    def share(start_time: Scalar, period: Scalar) -> Scalar:
        parts = (blocks.Pulse(amplitude=1.0, period=period, width=1.0, start_time=start_time), blocks.Integrator())
        return simulate(Rig(parts=parts, wiring=wire_step), 3.3 * period, save="end").final.parts[1].x / period

    rng = np.random.default_rng(4)
    starts, periods = -(10.0 ** rng.uniform(-1.0, 4.0, 40)), 10.0 ** rng.uniform(-2.0, 0.0, 40)
    np.testing.assert_allclose(jax.jit(jax.vmap(share))(starts, periods), 3.3, rtol=1e-6)
