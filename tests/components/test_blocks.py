"""Signal sources and operations, evaluated at given times."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from acausal import Component, ParameterError, Scalar, replace
from acausal._numbers import Numbers
from components import blocks

TIMES = np.array([0.0, 0.3, 1.0, 1.7, 2.9])


@jax.jit
def output(source: blocks.SignalSource, times: np.ndarray) -> jax.Array:
    """y(t), from the one equation of a source, y - f(t) = 0."""

    def at(t: Scalar) -> Numbers:
        here = replace(source, {"t": t, "y.value": 0.0})
        (equation,) = here.equations(here).values()
        return -equation.residual

    return jnp.asarray(jax.vmap(at)(jnp.asarray(times)))


def cosine(t: Scalar) -> Scalar:
    return jnp.cos(t)


@pytest.mark.parametrize(
    ("source", "expected"),
    [
        (blocks.Clock(), TIMES),
        (blocks.Sine(amplitude=2.0, frequency=0.5, phase=0.1), 2.0 * np.sin(np.pi * TIMES + 0.1)),
        (blocks.TimeFunction(function=cosine), np.cos(TIMES)),
        (
            blocks.Trapezoid(amplitude=2.0, period=2.0, rising=0.8, width=0.5, falling=0.4, start_time=0.2),
            [0.0, 0.25, 2.0, 1.0, 1.75],
        ),
        (
            blocks.ExpSine(amplitude=2.0, frequency=0.5, damping=0.3, phase=0.2, offset=0.5, start_time=0.3),
            np.where(TIMES < 0.3, 0.5, 0.5 + 2.0 * np.exp(-0.3 * (TIMES - 0.3)) * np.sin(np.pi * (TIMES - 0.3) + 0.2)),
        ),
        (
            blocks.Exponentials(height=2.0, rise_time=1.0, rise_tau=0.5, fall_tau=0.8, start_time=0.3),
            [
                0.0,
                0.0,
                2.0 * (1.0 - np.exp(-1.4)),
                2.0 * (1.0 - np.exp(-2.0)) * np.exp(-0.5),
                2.0 * (1.0 - np.exp(-2.0)) * np.exp(-2.0),
            ],
        ),
        (
            blocks.ChirpSine(amplitude=2.0, f0=0.2, f1=0.6, duration=2.0, offset=0.5),
            0.5 + 2.0 * np.sin(2.0 * np.pi * (0.2 * TIMES + 0.1 * TIMES**2)),
        ),
    ],
    ids=lambda item: type(item).__name__ if isinstance(item, Component) else "",
)
def test_source(source: blocks.SignalSource, expected: np.ndarray) -> None:
    np.testing.assert_allclose(output(source, TIMES), expected, atol=1e-12)


@pytest.mark.parametrize("smooth", [True, False])
def test_time_series_passes_its_samples_and_holds_outside(smooth: bool) -> None:
    series = blocks.TimeSeries(times=jnp.array([0.3, 1.0, 1.7]), values=jnp.array([2.0, -1.0, 0.5]), smooth=smooth)
    np.testing.assert_allclose(output(series, TIMES), [2.0, 2.0, -1.0, 0.5, 0.5], atol=1e-12)


def test_time_series_reproduces_a_line_exactly() -> None:
    times = jnp.array([0.0, 0.4, 1.5, 3.0])
    series = blocks.TimeSeries(times=times, values=2.0 * times - 1.0)
    np.testing.assert_allclose(output(series, TIMES), 2.0 * TIMES - 1.0, atol=1e-12)


@settings(deadline=None, max_examples=30)
@given(st.lists(st.floats(-5.0, 5.0), min_size=3, max_size=3))
def test_smooth_time_series_does_not_overshoot(values: list[float]) -> None:
    series = blocks.TimeSeries(times=jnp.array([0.0, 1.0, 3.0]), values=jnp.array(values))
    y = output(series, np.linspace(0.0, 3.0, 61))
    assert min(values) - 1e-12 <= np.min(y) <= np.max(y) <= max(values) + 1e-12


def test_staircase_has_its_values_between_its_times_and_holds_outside() -> None:
    stairs = blocks.Staircase(times=jnp.array([0.4, 1.1, 1.9]), values=jnp.array([2.0, -1.0]))
    np.testing.assert_allclose(output(stairs, TIMES), np.where(TIMES < 1.1, 2.0, -1.0), atol=1e-12)
    with pytest.raises(ParameterError, match="times must have one more element than values"):
        blocks.Staircase(times=jnp.array([0.0, 1.0]), values=jnp.zeros(2))
    with pytest.raises(ParameterError, match="increasing"):
        blocks.Staircase(times=jnp.array([0.0, 1.0, 1.0]), values=jnp.zeros(2))


def test_time_series_needs_increasing_times() -> None:
    with pytest.raises(ParameterError, match="increasing"):
        blocks.TimeSeries(times=jnp.array([0.0, 1.0, 1.0]), values=jnp.zeros(3))
