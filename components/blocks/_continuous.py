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


class LeadLag(SISO):
    """y = k (1 + T1 s) / (1 + T2 s) u: a lead if T1 > T2, a lag if T1 < T2.

    State form: T2 dx/dt = u - x and T2 y = k [T2 x + T1 (u - x)]. A lead adds at most the phase arcsin((a - 1)/(a + 1))
    with a = T1/T2, at the angular frequency 1/sqrt(T1 T2) (Franklin, Powell, Emami-Naeini, `Feedback Control`, ch. 6).
    """

    T1: Param[Scalar, "s", nonnegative]  # time constant of the numerator
    T2: Param[Scalar, "s", positive]  # time constant of the denominator
    k: Param[Scalar, ""] = 1.0  # gain at zero frequency
    x: Var[Scalar, "", prefer] = 0.0  # filtered u

    def equations(self, d: Self) -> Equations:
        lead = self.u.value - self.x
        return dict(
            filter=eq(self.T2 * d.x, lead),
            output=eq(self.T2 * self.y.value, self.k * (self.T2 * self.x + self.T1 * lead)),
        )


class Notch(SISO):
    """y = (s^2 + 2 D depth w s + w^2) / (s^2 + 2 D w s + w^2) u: attenuates u around w to the share `depth`.

    The gain is 1 far from w. Its bandwidth, between the angular frequencies with a gain of 1/sqrt(2), is 2 D w for
    depth = 0. State form: d2x/dt2 + 2 D w dx/dt + w^2 x = w^2 u and y = u - 2 D (1 - depth) (dx/dt)/w.
    """

    w: Param[Scalar, "rad/s", positive]  # angular frequency of the notch
    D: Param[Scalar, "1", positive]  # damping ratio of the poles, half the relative bandwidth
    depth: Param[Scalar, "1", nonnegative] = 0.0  # gain at w
    x: Var[Scalar, "", prefer] = 0.0  # low-pass filtered u
    v: Var[Scalar, "", prefer] = 0.0  # dx/dt

    def equations(self, d: Self) -> Equations:
        drive = self.w * (self.u.value - self.x) - 2.0 * self.D * self.v
        return dict(
            rate=eq(d.x, self.v),
            swing=eq(d.v, self.w * drive),
            output=eq(self.w * (self.u.value - self.y.value), 2.0 * self.D * (1.0 - self.depth) * self.v),
        )
