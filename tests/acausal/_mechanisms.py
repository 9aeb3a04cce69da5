"""Models with constraints between their states."""

from typing import Any, Self

from acausal import Component, Connections, Equations, Nominal, Param, Scalar, Var, connect, eq, positive
from components.blocks import Sine
from components.electrical import Capacitor, Ground, Resistor, SignalVoltage


class Pendulum(Component):
    """A point of mass 1 kg on a massless rod, in Cartesian coordinates: an index-3 system."""

    L: Param[Scalar, "m", positive] = 1.0
    g: Param[Scalar, "m/s2"] = 9.81
    x: Var[Scalar, "m"] = 0.0
    y: Var[Scalar, "m"] = 0.0
    u: Var[Scalar, "m/s"] = 0.0
    v: Var[Scalar, "m/s"] = 0.0
    force: Var[Scalar, "1/s2", Nominal(100.0)] = 0.0  # in the rod, per length and mass

    def equations(self, d: Self) -> Equations:
        return dict(
            speed_x=eq(self.u, d.x),
            speed_y=eq(self.v, d.y),
            newton_x=eq(d.u, -self.force * self.x),
            newton_y=eq(d.v, -self.force * self.y - self.g),
            rod=eq(self.x**2 + self.y**2, self.L**2),
        )


class DrivenCapacitor(Component):
    """A capacitor straight across a voltage that is given, with a resistor and a second capacitor beside it."""

    signal: Sine
    source: SignalVoltage
    c: Capacitor
    twin: Capacitor
    r: Resistor
    ground: Ground = Ground()

    def connections(self) -> Connections:
        return (
            connect(self.signal.y, self.source.u),
            connect(self.source.p, self.c.p, self.twin.p, self.r.p),
            connect(self.source.n, self.c.n, self.twin.n, self.r.n, self.ground.p),
        )


def driven_capacitor(amplitude: Any = 3.0, frequency: Any = 2.0) -> DrivenCapacitor:
    return DrivenCapacitor(
        signal=Sine(amplitude=amplitude, frequency=frequency),
        source=SignalVoltage(),
        c=Capacitor(C=0.02),
        twin=Capacitor(C=0.05),
        r=Resistor(R=10.0),
    )
