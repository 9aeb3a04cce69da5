"""Ideal sensors, which do not load the circuit."""

from typing import Self

from acausal import Component, Equations, eq

from ..blocks import Output
from ._interfaces import Pin


class VoltageSensor(Component):
    """y = v_p - v_n in V; no current."""

    p: Pin = Pin()
    n: Pin = Pin()
    y: Output = Output()

    def equations(self, d: Self) -> Equations:
        return dict(
            no_current_p=eq(self.p.i),
            no_current_n=eq(self.n.i),
            reading=eq(self.y.value, self.p.v - self.n.v),
        )


class CurrentSensor(Component):
    """y = current from p to n in A; no voltage drop."""

    p: Pin = Pin()
    n: Pin = Pin()
    y: Output = Output()

    def equations(self, d: Self) -> Equations:
        return dict(
            no_drop=eq(self.p.v, self.n.v),
            kirchhoff=eq(self.p.i + self.n.i),
            reading=eq(self.y.value, self.p.i),
        )


class PowerSensor(Component):
    """y = (v_p - v_reference) i in W with the current i from p to n; no voltage drop, no current in `reference`."""

    p: Pin = Pin()
    n: Pin = Pin()
    reference: Pin = Pin()
    y: Output = Output()

    def equations(self, d: Self) -> Equations:
        return dict(
            no_drop=eq(self.p.v, self.n.v),
            kirchhoff=eq(self.p.i + self.n.i),
            no_current=eq(self.reference.i),
            reading=eq(self.y.value, (self.p.v - self.reference.v) * self.p.i),
        )
