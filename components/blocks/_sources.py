"""Signals that depend on time only (as in MSL `Modelica.Blocks.Sources`).

Integration steps end at all jumps and kinks, and derivatives with respect to their times are exact.
"""

from collections.abc import Callable, Mapping
from typing import ClassVar, Self

import jax.numpy as jnp

from acausal import Component, Equations, Events, Param, Requirements, Scalar, at, eq, nonnegative, positive, require

from .._limit import limited
from ._interfaces import Output, SignalSource


class Constant(Component):
    """y = k."""

    k: Param[Scalar, ""]  # value
    y: Output = Output()

    def equations(self, d: Self) -> Equations:
        return dict(constant=eq(self.y.value, self.k))


class Clock(SignalSource):
    """y = offset plus the time since `start_time` in s; offset before (MSL `ContinuousClock`)."""

    offset: Param[Scalar, ""] = 0.0  # value before `start_time`
    start_time: Param[Scalar, "s"] = 0.0  # time at which it starts

    def equations(self, d: Self) -> Equations:
        return dict(clock=eq(self.y.value, self.offset + jnp.maximum(self.t - self.start_time, 0.0)))


class Step(SignalSource):
    """y = offset, and offset + height from `start_time`."""

    height: Param[Scalar, ""]  # height of the step
    offset: Param[Scalar, ""] = 0.0  # value before the step
    start_time: Param[Scalar, "s"] = 0.0  # time of the step

    def equations(self, d: Self) -> Equations:
        return dict(step=eq(self.y.value, self.offset + jnp.where(self.t < self.start_time, 0.0, self.height)))


class Ramp(SignalSource):
    """y rises linearly from offset to offset + height between `start_time` and `start_time + duration`."""

    height: Param[Scalar, ""]  # height of the ramp
    duration: Param[Scalar, "s", positive]  # duration of the ramp
    offset: Param[Scalar, ""] = 0.0  # value before the ramp
    start_time: Param[Scalar, "s"] = 0.0  # time at which it starts

    def equations(self, d: Self) -> Equations:
        progress = limited((self.t - self.start_time) / self.duration, 0.0, 1.0)
        return dict(ramp=eq(self.y.value, self.offset + self.height * progress))

    def events(self) -> Events:
        return dict(begin=at(self.start_time), end=at(self.start_time + self.duration))


class Sine(SignalSource):
    """y = offset, and from `start_time` offset + amplitude sin(2 pi frequency t' + phase), with t' = t - start_time.

    With a nonzero phase, y jumps at the start (MSL `Sine`).
    """

    elsewhere: ClassVar[Mapping[str, str]] = {"f": "frequency", "freqHz": "frequency"}

    amplitude: Param[Scalar, ""]  # amplitude
    frequency: Param[Scalar, "Hz"]  # frequency
    phase: Param[Scalar, "rad"] = 0.0  # phase at the start
    offset: Param[Scalar, ""] = 0.0  # mean value
    start_time: Param[Scalar, "s"] = 0.0  # time at which it starts

    def equations(self, d: Self) -> Equations:
        # The angle is constant before the start, so no event is searched for there.
        is_before = self.t < self.start_time
        angle = 2.0 * jnp.pi * self.frequency * jnp.where(is_before, 0.0, self.t - self.start_time) + self.phase
        on = jnp.where(is_before, 0.0, self.amplitude)
        return dict(sine=eq(self.y.value, self.offset + on * jnp.sin(angle)))


class TimeFunction(SignalSource):
    """y = function(t), for a function written with `jax.numpy`.

    Steps end where a comparison with the time changes its result, as in `jnp.where(t < 5.0, 0.0, 1.0)`, `jnp.maximum`
    or `jnp.floor`. For a table, use `TimeSeries`, so that its knots are known.

    The function is part of the model structure, so a new function object triggers a new compilation: define it once, at
    module level. To vary or differentiate its parameters, write a component instead.
    """

    function: Callable[[Scalar], Scalar]  # function of the time in s

    def equations(self, d: Self) -> Equations:
        return dict(function=eq(self.y.value, self.function(self.t), check_units=False))


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
