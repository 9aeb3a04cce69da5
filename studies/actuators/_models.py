"""The actuators as assemblies of components."""

from typing import TypedDict

from acausal import Component, Connections, connect
from components.blocks import Constant, Ramp, Step
from components.electrical import ConstantVoltage, DCMotor, Ground, SignalVoltage
from components.hydraulic import Line, MasterCylinder, Pump, SlaveCylinder, SpringAccumulator, Tank
from components.rotational import Cam, Fixed, PlanetaryGearbox, SmoothStribeckFriction, StribeckFriction, WormGear
from components.translational import ClutchSpring, Mass, ViscousFriction


class ClutchActuator(Component, partial=True):
    """What all actuators share: a motor on a supply at one end, and at the other a line that opens the clutch.

    The clutch opens as `slave.rod.s` grows. `piston` is all that moves with the slave's rod, `seal` its friction.
    """

    supply: ConstantVoltage | SignalVoltage
    motor: DCMotor
    line: Line
    slave: SlaveCylinder
    piston: Mass
    seal: ViscousFriction
    clutch: ClutchSpring
    ground: Ground = Ground()

    def connections(self) -> Connections:
        return (
            connect(self.supply.p, self.motor.p),
            connect(self.supply.n, self.motor.n, self.ground.p),
            connect(self.line.b, self.slave.port),
            connect(self.slave.rod, self.piston.a, self.seal.flange, self.clutch.flange),
        )


class CamActuator(ClutchActuator, partial=True):
    """Motor, planetary gearbox with its ring held, cam and master cylinder, and what all actuators share."""

    gearbox: PlanetaryGearbox
    cam: Cam
    master: MasterCylinder
    housing: Fixed = Fixed()
    friction: SmoothStribeckFriction | None = None  # dry friction on the motor's shaft

    def connections(self) -> Connections:
        friction = () if self.friction is None else (connect(self.friction.flange, self.motor.shaft),)
        return (
            *friction,
            *super().connections(),
            connect(self.motor.shaft, self.gearbox.sun),
            connect(self.gearbox.ring, self.housing.flange),
            connect(self.gearbox.carrier, self.cam.shaft),
            connect(self.cam.follower, self.master.rod),
            connect(self.master.port, self.line.a),
        )


class ElectromechanicalActuator(CamActuator):
    """Motor, planetary gearbox with its ring held, cam, master cylinder, line, slave cylinder, clutch."""

    supply: ConstantVoltage  # pyright: ignore[reportIncompatibleVariableOverride]


class WormActuator(ClutchActuator):
    """Motor, worm gear, cam, master cylinder, line, slave cylinder, clutch."""

    supply: ConstantVoltage  # pyright: ignore[reportIncompatibleVariableOverride]
    gearbox: WormGear
    cam: Cam
    master: MasterCylinder

    def connections(self) -> Connections:
        return (
            *super().connections(),
            connect(self.motor.shaft, self.gearbox.worm),
            connect(self.gearbox.wheel, self.cam.shaft),
            connect(self.cam.follower, self.master.rod),
            connect(self.master.port, self.line.a),
        )


class PumpActuator(ClutchActuator, partial=True):
    """Motor, fixed-displacement pump from a tank, and what all actuators share."""

    pump: Pump
    tank: Tank = Tank()

    def connections(self) -> Connections:
        return (
            *super().connections(),
            connect(self.motor.shaft, self.pump.shaft),
            connect(self.tank.port, self.pump.a),
        )


class PumpParts(TypedDict):
    """The parts that actuators with a pump differ by in numbers only."""

    motor: DCMotor
    pump: Pump
    line: Line
    slave: SlaveCylinder
    piston: Mass
    seal: ViscousFriction
    clutch: ClutchSpring


def pump_parts(actuator: PumpActuator) -> PumpParts:
    """The parts of an actuator with a pump, for another one with the same numbers."""
    return PumpParts(
        motor=actuator.motor,
        pump=actuator.pump,
        line=actuator.line,
        slave=actuator.slave,
        piston=actuator.piston,
        seal=actuator.seal,
        clutch=actuator.clutch,
    )


class ElectrohydraulicActuator(PumpActuator):
    """Motor, fixed-displacement pump from a tank, line, slave cylinder, clutch."""

    supply: ConstantVoltage  # pyright: ignore[reportIncompatibleVariableOverride]

    def connections(self) -> Connections:
        return *super().connections(), connect(self.pump.b, self.line.a)


class StickingActuator(PumpActuator):
    """The electrohydraulic actuator with what can keep it from moving at once.

    That is a supply that takes time to rise or comes late, dry friction on the shaft, which sticks (`StribeckFriction`,
    by events) or creeps (`SmoothStribeckFriction`, smoothed), and a pocket in the line that has to be filled first.
    """

    supply: SignalVoltage  # pyright: ignore[reportIncompatibleVariableOverride]
    command: Constant | Ramp | Step
    bearing: StribeckFriction | SmoothStribeckFriction | None = None
    pocket: SpringAccumulator | None = None

    def connections(self) -> Connections:
        friction = () if self.bearing is None else (connect(self.bearing.flange, self.pump.shaft),)
        filling = () if self.pocket is None else (connect(self.pocket.port, self.line.a),)
        return (
            *super().connections(),
            connect(self.pump.b, self.line.a),
            connect(self.command.y, self.supply.u),
            *friction,
            *filling,
        )
