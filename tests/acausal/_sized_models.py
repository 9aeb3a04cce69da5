"""Models whose variables can be of any size."""

from typing import Any

from _linear_models import RLC

from acausal import Component, Connections, Scalar, connect
from components.electrical import Capacitor, ConstantVoltage, Inductor, Resistor
from components.rotational import ConstantTorque, Damper, Fixed, Inertia, Spring


def circuit(volt: Scalar = 1.0, ampere: Any = 1.0, R: float = 0.4, L: float = 1.0, C: float = 1.0) -> RLC:
    """A circuit in which all voltages and currents grow with these numbers."""
    ohm = volt / ampere
    return RLC(source=ConstantVoltage(V=volt), r=Resistor(R=R * ohm), l=Inductor(L=L * ohm), c=Capacitor(C=C / ohm))


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
