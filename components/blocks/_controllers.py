"""Proportional, integral and derivative control (as in MSL `Modelica.Blocks.Continuous`)."""

from collections.abc import Mapping
from typing import Any, ClassVar, Self

from acausal import (
    Component,
    Equations,
    Param,
    Requirements,
    Scalar,
    Var,
    eq,
    nonnegative,
    nonzero,
    positive,
    prefer,
    require,
    unbounded,
)

from .._limit import limited
from ._interfaces import SISO, Input, Output


class PI(SISO):
    """y = k (u + x) with the integral T dx/dt = u. For a limited output see `LimPI`."""

    k: Param[Scalar, ""]  # gain
    T: Param[Scalar, "s", positive]  # integral time
    x: Var[Scalar, "", prefer] = 0.0  # integral part, before the gain

    def equations(self, d: Self) -> Equations:
        return dict(
            integral=eq(self.T * d.x, self.u.value),
            output=eq(self.y.value, self.k * (self.u.value + self.x)),
        )


class PID(SISO):
    """y = k (1 + 1 / (Ti s) + Td s / (1 + Td s / Nd)) u. For a limited output see `LimPID`."""

    elsewhere: ClassVar[Mapping[str, str]] = {"xi_start": "x", "xd_start": "x_d"}

    k: Param[Scalar, ""]  # gain
    Ti: Param[Scalar, "s", positive]  # integral time
    Td: Param[Scalar, "s", positive]  # derivative time
    Nd: Param[Scalar, "1", positive] = 10.0  # filter factor of the derivative part, whose time constant is Td / Nd
    x: Var[Scalar, "", prefer] = 0.0  # integral part, before the gain
    x_d: Var[Scalar, "", prefer] = 0.0  # filtered u of the derivative part

    def equations(self, d: Self) -> Equations:
        u, lead = self.u.value, self.u.value - self.x_d
        return dict(
            integral=eq(self.Ti * d.x, u),
            filter=eq(self.Td * d.x_d, self.Nd * lead),
            output=eq(self.y.value, self.k * (u + self.x + self.Nd * lead)),
        )


class LimitedController(Component, partial=True):
    """Control of the error u_s - u_m with a limited output, y_min <= y <= y_max, and anti-windup.

    Back-calculation (Astrom, Hagglund, `PID Controllers`, ch. 3; MSL `LimPID`) feeds the excess over the limits back
    into the integral: Ti dx/dt = u_s - u_m + (y - y_unlimited) / (k Ni). The limits are exact, y is continuous, and
    reaching or leaving a limit is an event.

    Give `u_ff=Input()` to connect a feed-forward signal, which is added to y before its limits.
    """

    k: Param[Scalar, "", nonzero]  # gain
    Ti: Param[Scalar, "s", positive]  # integral time
    y_max: Param[Scalar, "", unbounded]  # upper limit of y
    y_min: Param[Scalar, "", unbounded]  # lower limit of y
    wp: Param[Scalar, "1", nonnegative] = 1.0  # setpoint weight of the proportional part
    Ni: Param[Scalar, "1", positive] = 0.9  # Ni Ti is the time constant of the back-calculation
    x: Var[Scalar, "", prefer] = 0.0  # integral part, before the gain
    y_unlimited: Var[Scalar, ""] = 0.0  # y before its limits
    u_s: Input = Input()  # setpoint
    u_m: Input = Input()  # measured value
    u_ff: Input | None = None  # feed-forward
    y: Output = Output()

    def requirements(self) -> Requirements:
        return (require(self.y_min < self.y_max, "y_min must be smaller than y_max"),)

    def equations(self, d: Any) -> Equations:
        error, excess = self.u_s.value - self.u_m.value, self.y.value - self.y_unlimited
        return dict(
            integral=eq(self.Ti * d.x, error + excess / (self.k * self.Ni)),
            limit=eq(self.y.value, limited(self.y_unlimited, self.y_min, self.y_max)),
        )

    def _wanted(self, derivative: Scalar = 0.0) -> Scalar:
        """y without its limits, from the derivative part."""
        fed_forward = 0.0 if self.u_ff is None else self.u_ff.value
        sum_of_parts = self.wp * self.u_s.value - self.u_m.value + self.x + derivative
        return self.k * sum_of_parts + fed_forward


class LimPI(LimitedController):
    """PI control with limited output and anti-windup: y = k (wp u_s - u_m + x), limited. See `LimitedController`."""

    @classmethod
    def symmetric_optimum(cls, *, K: Scalar, T: Scalar, y_max: Scalar, a: Scalar = 2.0) -> "LimPI":
        """A controller for the plant K / (s (1 + T s)), limited to +-y_max: k = 1/(a K T), Ti = a^2 T.

        For a drive, K is 1/J and T the sum of the small time constants, such as 1/b of the current control. The phase
        margin is arctan(a) - arctan(1/a), at the angular frequency 1/(a T): 37 degrees for a = 2 (Kessler 1958;
        Schroeder, `Elektrische Antriebe - Regelung`). The setpoint weight wp = 0 avoids overshoot after steps.
        """
        return cls(k=1.0 / (a * K * T), Ti=a**2 * T, y_max=y_max, y_min=-y_max, wp=0.0)

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(law=eq(self.y_unlimited, self._wanted()))


class LimPID(LimitedController):
    """PID control with limited output and anti-windup: see `LimitedController`.

    y = k [wp u_s - u_m + x + Td s / (1 + Td s / Nd) (wd u_s - u_m)], limited. With wd = 0, the default, a step of the
    setpoint causes no derivative kick.
    """

    elsewhere: ClassVar[Mapping[str, str]] = {
        "controllerType": "another class, LimPI, for control without Td",
        "xi_start": "x",
        "xd_start": "x_d",
    }

    Td: Param[Scalar, "s", positive]  # derivative time
    wd: Param[Scalar, "1", nonnegative] = 0.0  # setpoint weight of the derivative part
    Nd: Param[Scalar, "1", positive] = 10.0  # filter factor of the derivative part, whose time constant is Td / Nd
    x_d: Var[Scalar, "", prefer] = 0.0  # filtered input of the derivative part

    def equations(self, d: Self) -> Equations:
        lead = self.wd * self.u_s.value - self.u_m.value - self.x_d
        return super().equations(d) | dict(
            filter=eq(self.Td * d.x_d, self.Nd * lead),
            law=eq(self.y_unlimited, self._wanted(self.Nd * lead)),
        )
