"""Signals that depend on time only (as in MSL `Modelica.Blocks.Sources`).

Steps of the integrator end at all jumps and corners, and the derivatives with respect to their times are exact.
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
    """y = offset, and from `start_time` on offset plus the time since then in s (MSL `ContinuousClock`)."""

    offset: Param[Scalar, ""] = 0.0  # value before it
    start_time: Param[Scalar, "s"] = 0.0  # time at which it starts

    def equations(self, d: Self) -> Equations:
        return dict(clock=eq(self.y.value, self.offset + jnp.maximum(self.t - self.start_time, 0.0)))


class Step(SignalSource):
    """y = offset, and offset + height from `start_time` on."""

    height: Param[Scalar, ""]  # height of the step
    offset: Param[Scalar, ""] = 0.0  # value before it
    start_time: Param[Scalar, "s"] = 0.0  # time of the step

    def equations(self, d: Self) -> Equations:
        return dict(step=eq(self.y.value, self.offset + jnp.where(self.t < self.start_time, 0.0, self.height)))


class Ramp(SignalSource):
    """y rises linearly from offset to offset + height between `start_time` and `start_time + duration`."""

    height: Param[Scalar, ""]  # height of the ramp
    duration: Param[Scalar, "s", positive]  # how long it takes
    offset: Param[Scalar, ""] = 0.0  # value before it
    start_time: Param[Scalar, "s"] = 0.0  # time at which it starts

    def equations(self, d: Self) -> Equations:
        progress = limited((self.t - self.start_time) / self.duration, 0.0, 1.0)
        return dict(ramp=eq(self.y.value, self.offset + self.height * progress))

    def events(self) -> Events:
        return dict(begin=at(self.start_time), end=at(self.start_time + self.duration))


class Sine(SignalSource):
    """y = offset, and from `start_time` on offset + amplitude sin(2 pi frequency t' + phase), t' = t - start_time.

    With another phase than zero it has a jump at the start (MSL `Sine`).
    """

    elsewhere: ClassVar[Mapping[str, str]] = {"f": "frequency", "freqHz": "frequency"}

    amplitude: Param[Scalar, ""]  # amplitude
    frequency: Param[Scalar, "Hz"]  # cycles in a second
    phase: Param[Scalar, "rad"] = 0.0  # phase at the start
    offset: Param[Scalar, ""] = 0.0  # mean value
    start_time: Param[Scalar, "s"] = 0.0  # time at which it starts

    def equations(self, d: Self) -> Equations:
        # Nothing turns before the start, so that no event has to be looked for there.
        is_before = self.t < self.start_time
        angle = 2.0 * jnp.pi * self.frequency * jnp.where(is_before, 0.0, self.t - self.start_time) + self.phase
        on = jnp.where(is_before, 0.0, self.amplitude)
        return dict(sine=eq(self.y.value, self.offset + on * jnp.sin(angle)))


class TimeFunction(SignalSource):
    """y = function(t), for a function written with `jax.numpy`.

    Steps end where comparisons of the time in it tip over, as in `jnp.where(t < 5.0, 0.0, 1.0)`, `jnp.maximum` or
    `jnp.floor`; a table has to be a `TimeSeries` for its knots to be known.

    The function is part of the model's structure, so a new function object means a new compilation: define it once, at
    module level. What is to be varied or differentiated belongs into a component of its own with parameters.
    """

    function: Callable[[Scalar], Scalar]  # of the time in s

    def equations(self, d: Self) -> Equations:
        return dict(function=eq(self.y.value, self.function(self.t), check_units=False))
