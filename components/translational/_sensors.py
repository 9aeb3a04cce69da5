"""Ideal sensors: no force, no mass."""

from typing import Self

from acausal import Component, Equations, eq

from ..blocks import Output
from ._interfaces import Flange


class PositionSensor(Component):
    """y = s in m."""

    flange: Flange = Flange()
    y: Output = Output()

    def equations(self, d: Self) -> Equations:
        return dict(no_force=eq(self.flange.f), reading=eq(self.y.value, self.flange.s))


class SpeedSensor(Component):
    """y = ds/dt in m/s."""

    flange: Flange = Flange()
    y: Output = Output()

    def equations(self, d: Self) -> Equations:
        return dict(no_force=eq(self.flange.f), reading=eq(self.y.value, d.flange.s))


class ForceSensor(Component):
    """y = force passed from a to b in N."""

    a: Flange = Flange()
    b: Flange = Flange()
    y: Output = Output()

    def equations(self, d: Self) -> Equations:
        return dict(
            rigid=eq(self.a.s, self.b.s),
            balance=eq(self.a.f + self.b.f),
            reading=eq(self.y.value, self.a.f),
        )
