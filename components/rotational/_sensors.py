"""Ideal sensors: no torque, no inertia."""

from typing import Self

from acausal import Component, Equations, eq

from ..blocks import Output
from ._interfaces import Flange


class AngleSensor(Component):
    """y = phi in rad."""

    flange: Flange = Flange()
    y: Output = Output()

    def equations(self, d: Self) -> Equations:
        return dict(no_torque=eq(self.flange.tau), reading=eq(self.y.value, self.flange.phi))


class SpeedSensor(Component):
    """y = dphi/dt in rad/s."""

    flange: Flange = Flange()
    y: Output = Output()

    def equations(self, d: Self) -> Equations:
        return dict(no_torque=eq(self.flange.tau), reading=eq(self.y.value, d.flange.phi))


class TorqueSensor(Component):
    """y = torque passed from a to b in N.m."""

    a: Flange = Flange()
    b: Flange = Flange()
    y: Output = Output()

    def equations(self, d: Self) -> Equations:
        return dict(
            rigid=eq(self.a.phi, self.b.phi),
            balance=eq(self.a.tau + self.b.tau),
            reading=eq(self.y.value, self.a.tau),
        )
