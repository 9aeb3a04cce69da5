"""Ideal voltage and current sources, without internal resistance or limits."""

from typing import Self

from acausal import Energy, Equations, Param, Scalar, eq

from ..blocks import Input
from ._interfaces import TwoPin


class ConstantVoltage(TwoPin):
    """v = V at any current; p is the positive pole."""

    V: Param[Scalar, "V"]  # voltage from p to n

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(source=eq(self.v, self.V))

    def energy(self) -> Energy:
        return Energy(supplied=-self.v * self.i)


class SignalVoltage(TwoPin):
    """v = u, with u in V."""

    u: Input = Input()

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(source=eq(self.v, self.u.value))

    def energy(self) -> Energy:
        return Energy(supplied=-self.v * self.i)


class ConstantCurrent(TwoPin):
    """i = I through the source from p to n at any voltage; the current leaves at n."""

    I: Param[Scalar, "A"]  # noqa: E741  # current from p to n

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(source=eq(self.i, self.I))

    def energy(self) -> Energy:
        return Energy(supplied=-self.v * self.i)


class SignalCurrent(TwoPin):
    """i = u through the source from p to n, with u in A."""

    u: Input = Input()

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(source=eq(self.i, self.u.value))

    def energy(self) -> Energy:
        return Energy(supplied=-self.v * self.i)
