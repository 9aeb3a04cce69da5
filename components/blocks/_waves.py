"""Periodic, decaying and swept signals (as in MSL `Modelica.Blocks.Sources`).

Integration steps end at all jumps and kinks, and derivatives with respect to their times are exact.
"""

from collections.abc import Mapping
from typing import ClassVar, Self

import jax.numpy as jnp

from acausal import (
    Equations,
    Param,
    Requirements,
    Scalar,
    eq,
    nonnegative,
    positive,
    require,
)

from .._limit import limited
from ._interfaces import SignalSource


class Periodic(SignalSource, partial=True):
    """y = offset before `start_time`, then offset + amplitude times a periodic waveform between 0 and 1."""

    elsewhere: ClassVar[Mapping[str, str]] = {"nperiod": "left out, because it repeats without end"}

    amplitude: Param[Scalar, ""]  # height of the waveform
    period: Param[Scalar, "s", positive]  # duration of a period
    offset: Param[Scalar, ""] = 0.0  # value before `start_time`, and lowest value
    start_time: Param[Scalar, "s"] = 0.0  # start of the first period


class Pulse(Periodic):
    """A rectangular wave: offset + amplitude for the first part of each period, offset for the rest."""

    width: Param[Scalar, "1", nonnegative] = 0.5  # pulse width as a fraction of the period, at most 1

    def requirements(self) -> Requirements:
        return (require(self.width <= 1.0, "width must be at most 1"),)

    def equations(self, d: Self) -> Equations:
        # Rises and falls are counted separately, so that each edge is exact in spite of rounding.
        risen = jnp.floor((self.t - self.start_time) / self.period)
        fallen = jnp.floor((self.t - self.start_time) / self.period - self.width)
        is_on = jnp.where(self.t < self.start_time, 0.0, risen - fallen)
        return dict(pulse=eq(self.y.value, self.offset + self.amplitude * is_on))


class SawTooth(Periodic):
    """A sawtooth: rises linearly from offset to offset + amplitude in each period, and drops back instantly."""

    def equations(self, d: Self) -> Equations:
        turns = (self.t - self.start_time) / self.period
        shape = jnp.where(self.t < self.start_time, 0.0, turns - jnp.floor(turns))
        return dict(saw_tooth=eq(self.y.value, self.offset + self.amplitude * shape))


class Trapezoid(Periodic):
    """A trapezoidal wave: linear rise to offset + amplitude, plateau, linear fall, then offset in each period."""

    rising: Param[Scalar, "s", positive]  # duration of the rise
    width: Param[Scalar, "s", nonnegative]  # duration of the plateau
    falling: Param[Scalar, "s", positive]  # duration of the fall

    def requirements(self) -> Requirements:
        total = self.rising + self.width + self.falling
        return (require(self.period >= total, "period must be at least rising + width + falling"),)

    def equations(self, d: Self) -> Equations:
        elapsed = self.t - self.start_time
        phase = elapsed - self.period * jnp.floor(elapsed / self.period)
        down = (self.rising + self.width + self.falling - phase) / self.falling
        shape = limited(jnp.minimum(phase / self.rising, down), 0.0, 1.0)
        shape = jnp.where(self.t < self.start_time, 0.0, shape)
        return dict(trapezoid=eq(self.y.value, self.offset + self.amplitude * shape))


class ExpSine(SignalSource):
    """y = offset, and from `start_time` offset + amplitude exp(-damping t') sin(2 pi frequency t' + phase).

    t' = t - start_time. With zero phase, y has a kink at the start; otherwise it jumps.
    """

    elsewhere: ClassVar[Mapping[str, str]] = {"f": "frequency", "freqHz": "frequency"}

    amplitude: Param[Scalar, ""]  # amplitude at the start
    frequency: Param[Scalar, "Hz"]  # frequency
    damping: Param[Scalar, "1/s", nonnegative]  # decay rate
    phase: Param[Scalar, "rad"] = 0.0  # phase at the start
    offset: Param[Scalar, ""] = 0.0  # mean value
    start_time: Param[Scalar, "s"] = 0.0  # time at which it starts

    def equations(self, d: Self) -> Equations:
        # Clamped, because the exponential overflows long before the start.
        elapsed = jnp.maximum(self.t - self.start_time, 0.0)
        wave = jnp.exp(-self.damping * elapsed) * jnp.sin(2.0 * jnp.pi * self.frequency * elapsed + self.phase)
        on = jnp.where(self.t < self.start_time, 0.0, self.amplitude)
        return dict(wave=eq(self.y.value, self.offset + on * wave))


class Exponentials(SignalSource):
    """Exponential rise from offset towards offset + height and exponential fall, with kinks at start and turn.

    From `start_time`, y = offset + height (1 - exp(-t' / rise_tau)); after `rise_time`, the second term decays as
    exp(-t'' / fall_tau).
    """

    elsewhere: ClassVar[Mapping[str, str]] = {
        "outMax": "height",
        "riseTimeConst": "rise_tau",
        "fallTimeConst": "fall_tau",
    }

    height: Param[Scalar, ""]  # asymptotic height of the rise
    rise_time: Param[Scalar, "s", nonnegative]  # duration of the rise
    rise_tau: Param[Scalar, "s", positive]  # time constant of the rise
    fall_tau: Param[Scalar, "s", positive]  # time constant of the fall
    offset: Param[Scalar, ""] = 0.0  # value before `start_time`
    start_time: Param[Scalar, "s"] = 0.0  # time at which it starts

    def equations(self, d: Self) -> Equations:
        elapsed = jnp.maximum(self.t - self.start_time, 0.0)
        rise = 1.0 - jnp.exp(-jnp.minimum(elapsed, self.rise_time) / self.rise_tau)
        fall = jnp.exp(-jnp.maximum(elapsed - self.rise_time, 0.0) / self.fall_tau)
        return dict(pulse=eq(self.y.value, self.offset + self.height * rise * fall))


class ChirpSine(SignalSource):
    """A sine with linear frequency sweep: y = offset + amplitude sin(2 pi (f0 t' + (f1 - f0) t'^2 / (2 duration))).

    For frequency responses. Before `start_time`, y = offset; then t' = t - start_time. The sweep continues after
    `duration`.
    """

    amplitude: Param[Scalar, ""]  # amplitude
    f0: Param[Scalar, "Hz"]  # frequency at the start
    f1: Param[Scalar, "Hz"]  # frequency after `duration`
    duration: Param[Scalar, "s", positive]  # duration of the sweep from f0 to f1
    offset: Param[Scalar, ""] = 0.0  # mean value
    start_time: Param[Scalar, "s"] = 0.0  # time at which it starts

    def equations(self, d: Self) -> Equations:
        elapsed = jnp.maximum(self.t - self.start_time, 0.0)
        cycles = self.f0 * elapsed + (self.f1 - self.f0) * elapsed**2 / (2.0 * self.duration)
        return dict(chirp=eq(self.y.value, self.offset + self.amplitude * jnp.sin(2.0 * jnp.pi * cycles)))
