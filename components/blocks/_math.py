"""Operations on signals."""

from typing import Self

from acausal import Component, Equations, Param, Scalar, eq

from ._interfaces import Input, Output


class Gain(Component):
    """y = k u."""

    k: Param[Scalar, ""]  # gain
    u: Input = Input()
    y: Output = Output()

    def equations(self, d: Self) -> Equations:
        return dict(gain=eq(self.y.value, self.k * self.u.value))


class Sum(Component):
    """y = k1 u1 + k2 u2; with k2 = -1 the difference."""

    k1: Param[Scalar, ""] = 1.0  # weight of u1
    k2: Param[Scalar, ""] = 1.0  # weight of u2
    u1: Input = Input()
    u2: Input = Input()
    y: Output = Output()

    def equations(self, d: Self) -> Equations:
        return dict(sum=eq(self.y.value, self.k1 * self.u1.value + self.k2 * self.u2.value))
