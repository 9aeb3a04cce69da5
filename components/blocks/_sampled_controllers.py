"""Digital proportional, integral and derivative control."""

from typing import Any

import jax.numpy as jnp

from acausal import (
    Discrete,
    Equations,
    Events,
    Param,
    Requirements,
    Scalar,
    at,
    eq,
    nonnegative,
    nonzero,
    positive,
    require,
    unbounded,
)

from .._limit import limited
from ._interfaces import Input, Output
from ._sampled import Sampled


class SampledController(Sampled, partial=True):
    """Digital control of e = u_s - u_m with limits; y is held between samples and is 0 before the first sample."""

    k: Param[Scalar, "1", nonzero]  # gain
    y_min: Param[Scalar, "1", unbounded] = -jnp.inf  # lower limit of y
    y_max: Param[Scalar, "1", unbounded] = jnp.inf  # upper limit of y
    held: Discrete[Scalar, "1"] = 0.0  # y
    u_s: Input = Input()  # setpoint
    u_m: Input = Input()  # measured value
    y: Output = Output()

    def requirements(self) -> Requirements:
        return (require(self.y_min < self.y_max, "y_min must be smaller than y_max"),)

    def equations(self, d: Any) -> Equations:
        return dict(hold=eq(self.y.value, self.held))

    def _error(self) -> Scalar:
        return self.u_s.value - self.u_m.value

    def _integrated(self, x: Scalar, T: Scalar, more: Scalar) -> tuple[Scalar, Scalar]:
        """y = k (more + x) with its limits and the integral part x after a sample.

        x is constant while y is at a limit and the error drives it further.
        """
        error = self._error()
        new = x + error * self.period / T
        wanted = self.k * (more + new)
        y = limited(wanted, self.y_min, self.y_max)
        winds_up = (wanted - y) * self.k * error > 0.0
        return y, jnp.where(winds_up, x, new)


class SampledP(SampledController):
    """A digital P controller with limits: at each sample, y = k (u_s - u_m)."""

    def events(self) -> Events:
        y = limited(self.k * self._error(), self.y_min, self.y_max)
        return dict(sample=at(self.start_time, every=self.period, held=y))


class SampledPI(SampledController):
    """A digital PI controller of e = u_s - u_m with limits: at each sample x increases by e period / T, y = k (e + x).

    Backward differences; clamping as anti-windup: x is constant while y is at a limit and e drives it further. y is
    held between samples and is 0 before the first sample.
    """

    T: Param[Scalar, "s", positive]  # integral time
    x: Discrete[Scalar, "1"] = 0.0  # integral part, before the gain

    def events(self) -> Events:
        y, x = self._integrated(self.x, self.T, self._error())
        return dict(sample=at(self.start_time, every=self.period, held=y, x=x))


class SampledPID(SampledController):
    """A digital PID controller with limits: at each sample, y = k (wp u_s - u_m + x + rate).

    x increases by (u_s - u_m) period / Ti, with clamping as anti-windup as in `SampledPI`. The filtered derivative part
    of e = wd u_s - u_m, by backward differences, is rate = [Td rate_before + Nd Td (e - e_before)] / (Td + Nd period)
    (Astrom, Hagglund, `PID Controllers`, ch. 3), 0 at the first sample. With wd = 0, the default, a step of the
    setpoint causes no derivative kick. The continuous counterpart is `LimPID`.
    """

    Ti: Param[Scalar, "s", positive]  # integral time
    Td: Param[Scalar, "s", positive]  # derivative time
    wp: Param[Scalar, "1", nonnegative] = 1.0  # setpoint weight of the proportional part
    wd: Param[Scalar, "1", nonnegative] = 0.0  # setpoint weight of the derivative part
    Nd: Param[Scalar, "1", positive] = 10.0  # filter factor of the derivative part, whose time constant is Td / Nd
    x: Discrete[Scalar, "1"] = 0.0  # integral part, before the gain
    rate: Discrete[Scalar, "1"] = 0.0  # derivative part, before the gain
    before: Discrete[Scalar, "1"] = 0.0  # wd u_s - u_m at the last sample
    begun: Discrete[Scalar, "1"] = 0.0  # 1 after the first sample

    def events(self) -> Events:
        e = self.wd * self.u_s.value - self.u_m.value
        change = self.begun * (e - self.before)
        rate = (self.Td * self.rate + self.Nd * self.Td * change) / (self.Td + self.Nd * self.period)
        y, x = self._integrated(self.x, self.Ti, self.wp * self.u_s.value - self.u_m.value + rate)
        new = dict(held=y, x=x, rate=rate, before=e, begun=1.0)
        return dict(sample=at(self.start_time, every=self.period, **new))
