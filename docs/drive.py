"""The model shared by the pages: a motor winds up a spring through a gear."""

from acausal import Component, Connections, connect
from components.electrical import ConstantVoltage, DCMotor, Ground
from components.rotational import Fixed, IdealGear, Inertia, SpringDamper


class Drive(Component):
    """A direct-current motor winds up a spring through a gear."""

    supply: ConstantVoltage
    motor: DCMotor
    gear: IdealGear
    load: Inertia
    spring: SpringDamper
    ground: Ground = Ground()
    wall: Fixed = Fixed()

    def connections(self) -> Connections:
        return (
            connect(self.supply.p, self.motor.p),
            connect(self.supply.n, self.motor.n, self.ground.p),
            connect(self.motor.shaft, self.gear.a),
            connect(self.gear.b, self.load.a),
            connect(self.load.b, self.spring.b),
            connect(self.spring.a, self.wall.flange),
        )


drive = Drive(
    supply=ConstantVoltage(V=12.0),
    motor=DCMotor(R=0.3, L=1e-4, k=0.04, J=5e-5),
    gear=IdealGear(ratio=20.0),
    load=Inertia(J=5e-3),
    spring=SpringDamper(c=10.0, d=0.1),
)
