"""Limits and switches (as in MSL `Modelica.Blocks.Nonlinear` and `Logical`); their kinks and jumps are events."""

from typing import Self

import jax
import jax.numpy as jnp

from acausal import (
    Component,
    Discrete,
    Equations,
    Events,
    Param,
    Requirements,
    Scalar,
    Var,
    eq,
    nonnegative,
    positive,
    prefer,
    require,
    unbounded,
    when,
)

from .._limit import limited
from ._interfaces import SISO, Input, Output


class Range(SISO, partial=True):
    """A block with two bounds on its input."""

    u_max: Param[Scalar, "", unbounded]  # upper bound
    u_min: Param[Scalar, "", unbounded]  # lower bound

    def requirements(self) -> Requirements:
        return (require(self.u_min < self.u_max, "u_min must be smaller than u_max"),)

    def within(self) -> Scalar:
        """The input, limited to the bounds."""
        return limited(self.u.value, self.u_min, self.u_max)


class Limiter(Range):
    """y = u, limited to u_min .. u_max."""

    def equations(self, d: Self) -> Equations:
        return dict(limit=eq(self.y.value, self.within()))


class DeadZone(Range):
    """y = 0 between u_min and u_max, and the distance from the nearer bound outside."""

    def equations(self, d: Self) -> Equations:
        return dict(zone=eq(self.y.value, self.u.value - self.within()))


class SlewRateLimiter(SISO):
    """y follows u with the rate limited to -`falling` .. `rising` per second.

    dy/dt = (u - y) / Td within these limits: a first-order lag with the time constant Td. A smaller Td follows more
    closely and makes the equations stiffer. y starts at x.
    """

    rising: Param[Scalar, "", positive, unbounded]  # maximum rate of rise
    falling: Param[Scalar, "", positive, unbounded]  # maximum rate of fall, a positive number
    Td: Param[Scalar, "s", positive] = 1e-3  # time constant
    x: Var[Scalar, "", prefer] = 0.0  # state, equal to y

    def _rate(self) -> Scalar:
        return (self.u.value - self.x) / self.Td

    def equations(self, d: Self) -> Equations:
        return dict(
            slew=eq(d.x, limited(self._rate(), -self.falling, self.rising)),
            output=eq(self.y.value, self.x),
        )


class Play(SISO):
    """Hysteresis: y is constant until u is `width`/2 away from it, and then follows at that distance.

    T dy/dt = u - y -+ width/2 beyond that distance; choose T short compared with the changes of u. y starts at x.
    """

    width: Param[Scalar, "", nonnegative]  # width of the hysteresis loop, in u
    T: Param[Scalar, "s", positive] = 1e-4  # time constant
    x: Var[Scalar, "", prefer] = 0.0  # state, equal to y

    def equations(self, d: Self) -> Equations:
        lead = self.u.value - self.x
        return dict(
            follow=eq(self.T * d.x, lead - limited(lead, -0.5 * self.width, 0.5 * self.width)),
            output=eq(self.y.value, self.x),
        )


class Switch(Component):
    """y = u1 while control >= threshold, otherwise u2 (MSL `Switch`); both changes are events.

    With a `band`, it switches to u1 at threshold + band / 2 and back at threshold - band / 2. If its output drives the
    control back across the threshold, it needs a band; otherwise the run ends with an error.
    """

    threshold: Param[Scalar, ""] = 0.5  # value of control at which y switches to u1
    band: Param[Scalar, "", nonnegative] = 0.0  # hysteresis of control
    high: Discrete[Scalar, "1"] = 0.0  # 1 while y = u1
    control: Input = Input()
    u1: Input = Input()
    u2: Input = Input()
    y: Output = Output()

    def equations(self, d: Self) -> Equations:
        return dict(switch=eq(self.y.value, jnp.where(self.high > 0.5, self.u1.value, self.u2.value)))

    def events(self) -> Events:
        above, is_high = self.control.value - self.threshold, self.high > 0.5
        return dict(
            rise=when(~is_high & (above >= 0.5 * self.band), high=1.0),
            fall=when(is_high & (above < -0.5 * self.band), high=0.0),
        )


class SmoothSwitch(Component):
    """y = u2 + (u1 - u2) / (1 + exp(-(control - threshold) / width)).

    A smooth switch: from 2 % to 98 % of u1 within eight widths.
    """

    width: Param[Scalar, "", positive]  # width of the transition, in units of control
    threshold: Param[Scalar, ""] = 0.5  # value of control at which y is half-way
    control: Input = Input()
    u1: Input = Input()
    u2: Input = Input()
    y: Output = Output()

    def equations(self, d: Self) -> Equations:
        share = jax.nn.sigmoid((self.control.value - self.threshold) / self.width)
        return dict(switch=eq(self.y.value, self.u2.value + (self.u1.value - self.u2.value) * share))
