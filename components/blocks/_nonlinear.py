"""Limits and switches (as in MSL `Modelica.Blocks.Nonlinear` and `Logical`).

None of them is an event: where one has a kink or a jump, the integrator meets it as an error estimate that is suddenly
large, and shortens its steps. A kink costs a few steps, a jump some twenty; a jump that feeds back on its own condition
chatters, and the run fails.
"""

from typing import Self

import jax
import jax.numpy as jnp

from acausal import Component, Equations, Param, Scalar, Var, eq, positive, prefer

from .._checks import check_order
from .._limit import limited
from ._interfaces import SISO, Input, Output


class Range(SISO, partial=True):
    """A block with two bounds of its input."""

    u_max: Param[Scalar, ""]  # upper bound
    u_min: Param[Scalar, ""]  # lower bound

    def __check_init__(self) -> None:
        check_order(self, "u_min", "u_max")

    def within(self) -> Scalar:
        """The input, or the bound that it is beyond."""
        return limited(self.u.value, self.u_min, self.u_max)


class Limiter(Range):
    """y = u within u_min and u_max, and the bound beyond them; it has kinks there."""

    def equations(self, d: Self) -> Equations:
        return dict(limit=eq(self.y.value, self.within()))


class DeadZone(Range):
    """y = 0 between u_min and u_max, and the distance to the bound beyond them; it has kinks there."""

    def equations(self, d: Self) -> Equations:
        return dict(zone=eq(self.y.value, self.u.value - self.within()))


class SlewRateLimiter(SISO):
    """y follows u, but changes by no more than `rising` and `falling` a second.

    dy/dt = (u - y) / Td within these bounds: below them, y is u behind a lag of Td, the price of having no events. A
    smaller Td follows closer and makes the equations stiffer. y starts at x.
    """

    rising: Param[Scalar, "", positive]  # steepest rise
    falling: Param[Scalar, "", positive]  # steepest fall, a positive number
    Td: Param[Scalar, "s", positive] = 1e-3  # time constant
    x: Var[Scalar, "", prefer] = 0.0  # y; its start value

    def equations(self, d: Self) -> Equations:
        rate = (self.u.value - self.x) / self.Td
        return dict(
            slew=eq(d.x, limited(rate, -self.falling, self.rising)),
            output=eq(self.y.value, self.x),
        )


class Switch(Component):
    """y = u1 where control >= threshold, else u2. It jumps, and is not an event: see `SmoothSwitch`.

    The derivative with respect to the threshold is zero.
    """

    threshold: Param[Scalar, ""] = 0.5  # value of control from which on u1 is passed
    control: Input = Input()
    u1: Input = Input()
    u2: Input = Input()
    y: Output = Output()

    def equations(self, d: Self) -> Equations:
        passed = jnp.where(self.control.value >= self.threshold, self.u1.value, self.u2.value)
        return dict(switch=eq(self.y.value, passed))


class SmoothSwitch(Component):
    """y = u2 + (u1 - u2) / (1 + exp(-(control - threshold) / width)).

    A switch that turns over continuously: from 2 % to 98 % of u1 within eight widths.
    """

    width: Param[Scalar, "", positive]  # of the transition, in units of control
    threshold: Param[Scalar, ""] = 0.5  # value of control at which y is half-way
    control: Input = Input()
    u1: Input = Input()
    u2: Input = Input()
    y: Output = Output()

    def equations(self, d: Self) -> Equations:
        share = jax.nn.sigmoid((self.control.value - self.threshold) / self.width)
        return dict(switch=eq(self.y.value, self.u2.value + (self.u1.value - self.u2.value) * share))
