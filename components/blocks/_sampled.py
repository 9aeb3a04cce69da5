"""Blocks with periodic events: sample and hold, delay line, moving average, pulse-width modulation."""

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
    Vector,
    at,
    eq,
    positive,
    require,
    shape,
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


class SampleLine(SISO, Sampled, partial=True):
    """A block that keeps the last n samples of u."""

    n: int  # number of samples
    line: Discrete[Vector, "", shape("n")] = 0.0  # the last n samples, oldest first
    held: Discrete[Scalar, ""] = 0.0  # y

    def requirements(self) -> Requirements:
        return (require(self.n >= 1, "n must be 1 or more"),)

    def equations(self, d: Self) -> Equations:
        return dict(hold=eq(self.y.value, self.held))

    def shifted(self) -> Vector:
        """The line with the present u as its last sample."""
        return jnp.concatenate([self.line[1:], jnp.reshape(self.u.value, (1,))])


class SampledDelay(SampleLine):
    """y = u of n samples ago, held until the next sample: a delay by n periods, exact for sampled signals.

    A sample is u after all events of its instant, so a sampled block in front of the delay adds nothing. As MSL
    `UnitDelay` for n = 1, the default. y is `held`, and then `line`, until n samples have passed; all are 0 by default.
    For the delay of a continuous signal see `FixedDelay`.
    """

    n: int = 1
    due: Discrete[Scalar, "s"] = jnp.inf  # time at which the present sample is recorded

    def events(self) -> Events:
        # Clocks read the values before the clocks of their instant. Because u is recorded after them, u of a sampled
        # block is that of this sample, not of the one before.
        return dict(
            sample=at(self.start_time, every=self.period, held=self.line[0], due=self.t),
            _record=at(self.due, line=self.shifted(), due=jnp.inf),
        )


class MovingAverage(SampleLine):
    """y = mean of the last n samples of u, held until the next sample.

    Until n samples have been taken, y is the mean of those taken; 0 before the first. The gain at the angular frequency
    w is |sin(n w period/2) / (n sin(w period/2))|, zero at the multiples of 1/(n period) in Hz below 1/period.
    """

    taken: Discrete[Scalar, "1"] = 0.0  # number of samples taken, at most n

    def events(self) -> Events:
        taken, line = jnp.minimum(self.taken + 1.0, float(self.n)), self.shifted()
        return dict(sample=at(self.start_time, every=self.period, held=jnp.sum(line) / taken, line=line, taken=taken))


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
