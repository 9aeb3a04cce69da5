"""Logic, sampled blocks, filters and noise in a batch of runs, and the derivatives of their outputs by parameters."""

from collections.abc import Callable, Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _rig import Rig

from acausal import Connections, connect, simulate
from components import blocks


def timed(clock: Any, level: Any, comparator: Any, hysteresis: Any, *timers: Any) -> Connections:
    """The comparator becomes 1 at the level, the hysteresis later; each output has an integral."""
    mono, delay, latch, timer = timers[:4]
    outputs = (comparator, hysteresis, mono, delay, latch, timer)
    return (
        connect(clock.y, comparator.u1, hysteresis.u),
        connect(level.y, comparator.u2),
        connect(comparator.y, mono.u, delay.u, latch.set, timer.u),
        connect(hysteresis.y, latch.reset),
        *(connect(part.y, integral.u) for part, integral in zip(outputs, timers[4:], strict=True)),
    )


def logic(p: Any) -> Rig:
    c, h, T = p
    parts = (
        blocks.Clock(),
        blocks.Constant(k=c),
        blocks.Comparator(),
        blocks.Hysteresis(low=-1.0, high=h),
        blocks.Monostable(T=T),
        blocks.OnDelay(T=T),
        blocks.Latch(),
        blocks.Timer(),
        *[blocks.Integrator()] * 6,
    )
    return Rig(parts=parts, wiring=timed)


def logic_outputs(p: Any) -> Any:
    """Durations of the pulses up to 1 s, and the area below the timer."""
    c, h, T = p
    return jnp.stack([1.0 - c, 1.0 - h, T, 1.0 - c - T, h - c, 0.5 * (1.0 - c) ** 2])


def sampling(clock: Any, zero: Any, gain: Any, *readers: Any) -> Connections:
    delay, average, proportional, pid, lead, noise = readers[:6]
    outputs = (delay, average, proportional, pid, lead, noise)
    return (
        connect(clock.y, gain.u),
        connect(gain.y, delay.u, average.u, lead.u, proportional.u_s, pid.u_s),
        connect(zero.y, proportional.u_m, pid.u_m),
        *(connect(part.y, integral.u) for part, integral in zip(outputs, readers[6:], strict=True)),
    )


def sampled(p: Any) -> Rig:
    slope, k, sigma = p
    parts = (
        blocks.Clock(),
        blocks.Constant(k=0.0),
        blocks.Gain(k=slope),
        blocks.SampledDelay(period=0.25),
        blocks.MovingAverage(period=0.25, n=2),
        blocks.SampledP(period=0.25, k=k),
        blocks.SampledPID(period=0.25, k=k, Ti=0.5, Td=0.1),
        blocks.LeadLag(T1=0.0, T2=0.1, k=k),
        blocks.BandLimitedNoise(sigma=sigma, f_min=0.5, f_max=1.0, n=3),
        *[blocks.Integrator()] * 6,
    )
    return Rig(parts=parts, wiring=sampling)


def sampled_outputs(p: Any) -> Any:
    """Sums over samples of a ramp at 0, 1/4, 1/2 and 3/4 s; the lag of a ramp; noise proportional to sigma."""
    slope, k, sigma = p
    u = slope * 0.25 * np.arange(4)
    lag = 0.5 - 0.1 + 0.01 * (1.0 - np.exp(-10.0))
    places, phases = np.random.default_rng(0).random((2, 3))
    f = 0.5 + 0.5 * (np.arange(3) + places) / 3.0
    start, w = 2.0 * np.pi * phases, 2.0 * np.pi * f
    waves = np.sum((np.sin(w + start) - np.sin(start)) / w)
    held = jnp.sum(u) * 0.25
    return jnp.stack(
        [
            jnp.sum(u[:-1]) * 0.25,
            0.5 * (held + jnp.sum(u[:-1]) * 0.25),
            k * held,
            k * 0.25 * jnp.sum(u + jnp.cumsum(u) * 0.5),
            k * slope * lag,
            sigma * np.sqrt(2.0 / 3.0) * waves,
        ]
    )


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("model", "exact", "points"),
    [
        (logic, logic_outputs, [(0.2, 0.7, 0.1), (0.3, 0.9, 0.25)]),
        (sampled, sampled_outputs, [(2.0, 0.5, 1.0), (-1.0, 3.0, 0.2)]),
    ],
)
def test_a_batch_of_runs_and_its_derivatives(
    model: Callable[[Any], Rig], exact: Callable[[Any], Any], points: Sequence[tuple[float, ...]]
) -> None:
    def found(p: Any) -> tuple[Any, Any]:
        final = simulate(model(p), 1.0, rtol=1e-8, save="end").final
        values = jnp.stack([part.x for part in final.parts[-6:]])
        return values, values

    p = jnp.asarray(points)
    slopes, values = jax.vmap(jax.jacrev(found, has_aux=True))(p)
    np.testing.assert_allclose(values, jax.vmap(exact)(p), atol=1e-7)
    np.testing.assert_allclose(slopes, jax.vmap(jax.jacfwd(exact))(p), atol=1e-6)
