"""Linear dynamics of first and second order (as in MSL `Modelica.Blocks.Continuous`).

Each is a state whose start value is an argument, as in `Integrator(x=2.0)`. A jump of the input makes the derivative of
the state jump, not the state; the integrator meets it as an error estimate that is suddenly large.
"""

from collections.abc import Mapping
from typing import ClassVar, Self

from acausal import Equations, Param, Scalar, Var, eq, nonnegative, positive, prefer

from ._interfaces import SISO


class Integrator(SISO):
    """dy/dt = k u, from y = x at the start."""

    elsewhere: ClassVar[Mapping[str, str]] = {"y_start": "x"}

    k: Param[Scalar, ""] = 1.0  # gain
    x: Var[Scalar, "", prefer] = 0.0  # y; its start value

    def equations(self, d: Self) -> Equations:
        return dict(integral=eq(d.x, self.k * self.u.value), output=eq(self.y.value, self.x))


class Derivative(SISO):
    """The derivative of u behind a low-pass filter: y = k s / (1 + T s) u, in states T dx/dt = u - x = T y / k.

    A smaller T follows closer and makes the equations stiffer. Where u jumps, so does y, by k / T times the jump.
    """

    T: Param[Scalar, "s", positive]  # time constant of the filter
    k: Param[Scalar, ""] = 1.0  # gain
    x: Var[Scalar, "", prefer] = 0.0  # u behind the filter

    def equations(self, d: Self) -> Equations:
        lead = self.u.value - self.x
        return dict(filter=eq(self.T * d.x, lead), output=eq(self.T * self.y.value, self.k * lead))


class FirstOrder(SISO):
    """T dy/dt + y = k u, from y = x at the start."""

    elsewhere: ClassVar[Mapping[str, str]] = {"y_start": "x"}

    T: Param[Scalar, "s", positive]  # time constant
    k: Param[Scalar, ""] = 1.0  # gain
    x: Var[Scalar, "", prefer] = 0.0  # y; its start value

    def equations(self, d: Self) -> Equations:
        return dict(lag=eq(self.T * d.x, self.k * self.u.value - self.x), output=eq(self.y.value, self.x))


class SecondOrder(SISO):
    """d2y/dt2 + 2 D w dy/dt + w^2 y = k w^2 u, from y = x and dy/dt = v at the start."""

    elsewhere: ClassVar[Mapping[str, str]] = {"y_start": "x", "yd_start": "v"}

    w: Param[Scalar, "rad/s", positive]  # natural angular frequency
    D: Param[Scalar, "1", nonnegative]  # damping ratio
    k: Param[Scalar, ""] = 1.0  # gain
    x: Var[Scalar, "", prefer] = 0.0  # y; its start value
    v: Var[Scalar, "", prefer] = 0.0  # dy/dt

    def equations(self, d: Self) -> Equations:
        drive = self.w * (self.k * self.u.value - self.x) - 2.0 * self.D * self.v
        return dict(rate=eq(d.x, self.v), swing=eq(d.v, self.w * drive), output=eq(self.y.value, self.x))
