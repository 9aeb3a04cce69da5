"""Signals that depend on time only (as in MSL `Modelica.Blocks.Sources`).

Integration steps end at all jumps and kinks, and derivatives with respect to their times are exact.
"""

from collections.abc import Callable, Mapping
from typing import ClassVar, Self

import jax.numpy as jnp

from acausal import Component, Equations, Events, Param, Scalar, at, eq, positive

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
