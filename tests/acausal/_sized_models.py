"""Models whose variables can be of any size."""

from typing import Any

from acausal import Component, Connections, Scalar, connect
from components.electrical import Capacitor, ConstantVoltage, Ground, Inductor, Resistor
from components.rotational import ConstantTorque, Damper, Fixed, Inertia, Spring


class Circuit(Component):
    """A series circuit, switched on at the start."""

    source: ConstantVoltage
    r: Resistor
    l: Inductor  # noqa: E741
    c: Capacitor
    ground: Ground = Ground()

    def connections(self) -> Connections:
        return (
            connect(self.source.p, self.r.p),
            connect(self.r.n, self.l.p),
            connect(self.l.n, self.c.p),
            connect(self.c.n, self.source.n, self.ground.p),
        )


def circuit(volt: Scalar = 1.0, ampere: Any = 1.0, R: float = 0.4, L: float = 1.0, C: float = 1.0) -> Circuit:
    """A circuit in which all voltages and currents grow with these numbers."""
    ohm = volt / ampere
    return Circuit(source=ConstantVoltage(V=volt), r=Resistor(R=R * ohm), l=Inductor(L=L * ohm), c=Capacitor(C=C / ohm))


class Shaft(Component):
    """An inertia between a torque and a spring with a damper."""

    drive: ConstantTorque
    rotor: Inertia
    spring: Spring
    damper: Damper
    wall: Fixed = Fixed()

    def connections(self) -> Connections:
        return (
            connect(self.drive.flange, self.rotor.a),
            connect(self.rotor.b, self.spring.a, self.damper.a),
            connect(self.spring.b, self.damper.b, self.wall.flange),
        )


def shaft(torque: Any = 1.0, angle: Any = 1.0, J: float = 1.0, c: float = 1.0, d: float = 0.2) -> Shaft:
    unit = torque / angle
    return Shaft(
        drive=ConstantTorque(torque=torque),
        rotor=Inertia(J=J * unit),
        spring=Spring(c=c * unit),
        damper=Damper(d=d * unit),
    )
