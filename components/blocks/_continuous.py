"""Linear dynamics of first and second order (as in MSL `Modelica.Blocks.Continuous`).

The start value of the state is an argument, as in `Integrator(x=2.0)`. If the input jumps, the derivative of the state
jumps and the state does not; the error estimate of the integrator increases there.
"""

from collections.abc import Mapping
from typing import ClassVar, Self

from acausal import Equations, Param, Scalar, Var, eq, nonnegative, positive, prefer

from ._interfaces import SISO


class Integrator(SISO):
    """dy/dt = k u, with y = x at the start."""

    elsewhere: ClassVar[Mapping[str, str]] = {"y_start": "x"}

    k: Param[Scalar, ""] = 1.0  # gain
    x: Var[Scalar, "", prefer] = 0.0  # state, equal to y

    def equations(self, d: Self) -> Equations:
        return dict(integral=eq(d.x, self.k * self.u.value), output=eq(self.y.value, self.x))


class Derivative(SISO):
    """The filtered derivative of u: y = k s / (1 + T s) u, in state form T dx/dt = u - x = T y / k.

    A smaller T makes the derivative more accurate and the equations stiffer. If u jumps, y jumps by k / T times that.
    """

    T: Param[Scalar, "s", positive]  # time constant of the filter
    k: Param[Scalar, ""] = 1.0  # gain
    x: Var[Scalar, "", prefer] = 0.0  # filtered u

    def equations(self, d: Self) -> Equations:
        lead = self.u.value - self.x
        return dict(filter=eq(self.T * d.x, lead), output=eq(self.T * self.y.value, self.k * lead))


class FirstOrder(SISO):
    """T dy/dt + y = k u, with y = x at the start."""

    elsewhere: ClassVar[Mapping[str, str]] = {"y_start": "x"}

    T: Param[Scalar, "s", positive]  # time constant
    k: Param[Scalar, ""] = 1.0  # gain
    x: Var[Scalar, "", prefer] = 0.0  # state, equal to y

    def equations(self, d: Self) -> Equations:
        return dict(lag=eq(self.T * d.x, self.k * self.u.value - self.x), output=eq(self.y.value, self.x))


class SecondOrder(SISO):
    """d2y/dt2 + 2 D w dy/dt + w^2 y = k w^2 u, with y = x and dy/dt = v at the start."""

    elsewhere: ClassVar[Mapping[str, str]] = {"y_start": "x", "yd_start": "v"}

    w: Param[Scalar, "rad/s", positive]  # natural angular frequency
    D: Param[Scalar, "1", nonnegative]  # damping ratio
    k: Param[Scalar, ""] = 1.0  # gain
    x: Var[Scalar, "", prefer] = 0.0  # state, equal to y
    v: Var[Scalar, "", prefer] = 0.0  # dy/dt

    def equations(self, d: Self) -> Equations:
        drive = self.w * (self.k * self.u.value - self.x) - 2.0 * self.D * self.v
        return dict(rate=eq(d.x, self.v), swing=eq(d.v, self.w * drive), output=eq(self.y.value, self.x))
