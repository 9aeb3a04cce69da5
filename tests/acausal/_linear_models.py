"""Linear models with closed-form modes, shared by the tests of linearisation."""

import numpy as np

from acausal import Component, Connections, Scalar, connect
from components.electrical import Capacitor, ConstantVoltage, DCMotor, Ground, Inductor, Resistor
from components.hydraulic import Line, SlaveCylinder
from components.rotational import ConstantTorque
from components.translational import ConstantForce, Fixed, Mass, SpringDamper


class TwoMass(Component):
    """Wall, spring, mass, spring, mass, and a force on the second mass."""

    first: Mass
    second: Mass
    inner: SpringDamper
    outer: SpringDamper
    push: ConstantForce
    wall: Fixed = Fixed()

    def connections(self) -> Connections:
        return (
            connect(self.wall.flange, self.inner.a),
            connect(self.inner.b, self.first.a),
            connect(self.first.b, self.outer.a),
            connect(self.outer.b, self.second.a, self.push.flange),
        )


def two_mass(
    m1: Scalar = 2.0, m2: Scalar = 1.0, c1: Scalar = 300.0, c2: Scalar = 100.0, d1: Scalar = 0.0, d2: Scalar = 0.0
) -> TwoMass:
    return TwoMass(
        first=Mass(m=m1),
        second=Mass(m=m2),
        inner=SpringDamper(c=c1, d=d1),
        outer=SpringDamper(c=c2, d=d2),
        push=ConstantForce(force=0.0),
    )


class MotorRig(Component):
    """A motor on a supply with a torque on its shaft: (L s + R) i + k w = V, (J s + C) w = k i + torque."""

    supply: ConstantVoltage
    motor: DCMotor
    load: ConstantTorque
    ground: Ground = Ground()

    def connections(self) -> Connections:
        return (
            connect(self.supply.p, self.motor.p),
            connect(self.supply.n, self.motor.n, self.ground.p),
            connect(self.motor.shaft, self.load.flange),
        )


R, L, K, J, C = 0.3, 1e-3, 0.04, 5e-5, 1e-4


def motor_rig(L: Scalar = L, R: Scalar = R) -> MotorRig:
    return MotorRig(
        supply=ConstantVoltage(V=12.0), motor=DCMotor(R=R, L=L, k=K, J=J, friction=C), load=ConstantTorque(torque=0.0)
    )


class RLC(Component):
    """A source, a resistor, an inductor and a capacitor in series."""

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


def rlc(R: Scalar = 10.0, L: Scalar = 1e-3, C: Scalar = 1e-6) -> RLC:
    return RLC(source=ConstantVoltage(V=1.0), r=Resistor(R=R), l=Inductor(L=L), c=Capacitor(C=C))


class Helmholtz(Component):
    """A piston on enclosed liquid: omega = A sqrt(beta / (V m))."""

    line: Line
    slave: SlaveCylinder
    piston: Mass

    def connections(self) -> Connections:
        return connect(self.line.b, self.slave.port), connect(self.slave.rod, self.piston.a)


def helmholtz(A: float = 1e-3, V: float = 1e-4, m: float = 1.0, beta: float = 1.4e9) -> Helmholtz:
    return Helmholtz(
        line=Line.from_bulk_modulus(bulk_modulus=beta, volume=V),
        slave=SlaveCylinder(bore=np.sqrt(4 * A / np.pi)),
        piston=Mass(m=m),
    )


class Divider(Component):
    """Two resistors on a source: no states."""

    source: ConstantVoltage
    a: Resistor
    b: Resistor
    ground: Ground = Ground()

    def connections(self) -> Connections:
        return (
            connect(self.source.p, self.a.p),
            connect(self.a.n, self.b.p),
            connect(self.b.n, self.source.n, self.ground.p),
        )
