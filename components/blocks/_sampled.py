"""Blocks with periodic events: sample and hold, sampled controller, pulse-width modulation."""

from typing import Self

import jax.numpy as jnp

from acausal import (
    Component,
    Discrete,
    Equations,
    Events,
    Param,
    Requirements,
    Scalar,
    Time,
    at,
    eq,
    nonzero,
    positive,
    require,
    unbounded,
)

from .._limit import limited
from . import _intervals as intervals
from ._interfaces import SISO, Input, Output


class Sampled(Component, partial=True):
    """A block that samples at start_time, start_time + period, ...; each sample is an event, at which a step ends."""

    period: Param[Scalar, "s", positive]  # sample period
    start_time: Param[Scalar, "s"] = 0.0  # time of the first sample
    t: Time[Scalar, "s"] = 0.0


class SampleHold(SISO, Sampled):
    """y = u at the last sample; 0 before the first sample (MSL `ZeroOrderHold`)."""

    held: Discrete[Scalar, ""] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(hold=eq(self.y.value, self.held))

    def events(self) -> Events:
        return dict(sample=at(self.start_time, every=self.period, held=self.u.value))


class SampledPI(Sampled):
    """A digital PI controller of e = u_s - u_m with limits: at each sample x increases by e period / T, y = k (e + x).

    Backward differences; clamping as anti-windup: x is constant while y is at a limit and e drives it further. y is
    held between samples and is 0 before the first sample.
    """

    k: Param[Scalar, "1", nonzero]  # gain
    T: Param[Scalar, "s", positive]  # integral time
    y_min: Param[Scalar, "1", unbounded] = -jnp.inf  # lower limit of y
    y_max: Param[Scalar, "1", unbounded] = jnp.inf  # upper limit of y
    x: Discrete[Scalar, "1"] = 0.0  # integral part, before the gain
    held: Discrete[Scalar, "1"] = 0.0  # y
    u_s: Input = Input()  # setpoint
    u_m: Input = Input()  # measured value
    y: Output = Output()

    def requirements(self) -> Requirements:
        return (require(self.y_min < self.y_max, "y_min must be smaller than y_max"),)

    def equations(self, d: Self) -> Equations:
        return dict(hold=eq(self.y.value, self.held))

    def events(self) -> Events:
        error = self.u_s.value - self.u_m.value
        x = self.x + error * self.period / self.T
        wanted = self.k * (error + x)
        y = limited(wanted, self.y_min, self.y_max)
        winds_up = (wanted - y) * self.k * error > 0.0
        kept = jnp.where(winds_up, self.x, x)
        return dict(sample=at(self.start_time, every=self.period, held=y, x=kept))


class PWM(Sampled):
    """Pulse-width modulation: y = sign(u) for the first fraction |u| of each period, and 0 for the rest.

    The duty u, limited to -1 .. 1, is sampled at the beginning of each period (regular sampling). A run takes several
    steps for each period; if the ripple does not matter, use the averaged counterpart `PWMAverage`.
    """

    duty: Discrete[Scalar, "1"] = 0.0  # duty of this period
    began: Discrete[Scalar, "s"] = -jnp.inf  # start of this period
    on: Discrete[Scalar, "1"] = 0.0  # 1 during a pulse
    u: Input = Input()
    y: Output = Output()

    @classmethod
    def of_frequency(cls, frequency: Scalar) -> "PWM":
        """A modulator with the given frequency in Hz."""
        return cls(period=1.0 / frequency)

    def equations(self, d: Self) -> Equations:
        return dict(pulse=eq(self.y.value, self.on * jnp.sign(self.duty)))

    def events(self) -> Events:
        duty = limited(self.u.value, -1.0, 1.0)
        began = intervals.began(self.t, self.start_time, self.period)
        return dict(
            end=at(self.began + jnp.abs(self.duty) * self.period, on=0.0),
            begin=at(self.start_time, every=self.period, duty=duty, began=began, on=jnp.where(duty == 0.0, 0.0, 1.0)),
        )
