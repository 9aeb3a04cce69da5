"""The actuators as assemblies of components."""

from typing import TypedDict

from acausal import Component, Connections, Scalar, connect
from components.blocks import Constant, Ramp, Step
from components.electrical import ConstantVoltage, DCMotor, Ground, SignalVoltage
from components.hydraulic import (
    LaminarResistance,
    Line,
    MasterCylinder,
    Pump,
    ReliefValve,
    SlaveCylinder,
    SpringAccumulator,
    Tank,
)
from components.rotational import (
    Cam,
    Fixed,
    PlanetaryGearbox,
    PlanetaryTrain,
    SmoothStribeckFriction,
    StribeckFriction,
    WormGear,
)
from components.translational import ClutchSpring, Mass, TabulatedSpring, ViscousFriction

from ._stops import RodStops, ShaftStops


class ClutchActuator(Component, partial=True):
    """Base class of all actuators: a motor on a supply at one end, and a line that opens the clutch at the other.

    The clutch opens as `slave.rod.s` grows. `piston` is the mass that moves with the slave rod, and `seal` its
    friction. The end stops of the slave and the pressure drop of the pipe are optional.
    """

    supply: ConstantVoltage | SignalVoltage
    motor: DCMotor
    line: Line
    slave: SlaveCylinder
    piston: Mass
    seal: ViscousFriction
    clutch: ClutchSpring | TabulatedSpring
    pipe: LaminarResistance | None = None  # between line and slave cylinder
    stops: RodStops | None = None  # end stops of the slave
    ground: Ground = Ground()

    def connections(self) -> Connections:
        stops = () if self.stops is None else (connect(self.stops.flange, self.slave.rod),)
        if self.pipe is None:
            way = (connect(self.line.b, self.slave.port),)
        else:
            way = (connect(self.line.b, self.pipe.a), connect(self.pipe.b, self.slave.port))
        return (
            connect(self.supply.p, self.motor.p),
            connect(self.supply.n, self.motor.n, self.ground.p),
            *way,
            connect(self.slave.rod, self.piston.a, self.seal.flange, self.clutch.flange),
            *stops,
        )


def spring_rate(model: ClutchActuator) -> Scalar:
    """The rate in N/m of a linear clutch spring; raises ValueError for a sampled characteristic."""
    if isinstance(model.clutch, TabulatedSpring):
        raise ValueError("clutch: the rate of a TabulatedSpring depends on its travel; give a ClutchSpring(rate=...)")
    return model.clutch.rate


class CamActuator(ClutchActuator, partial=True):
    """Base class of actuators with a planetary gearhead, a cam and a master cylinder.

    The gearhead is a stage whose ring is fixed to the housing, or a train with its own housing. The stops of the cam
    are optional. Without them, a motor that stays on turns the cam past its highest point.
    """

    gearbox: PlanetaryGearbox | PlanetaryTrain
    cam: Cam
    master: MasterCylinder
    cam_stops: ShaftStops | None = None
    housing: Fixed | None = Fixed()  # None with a train

    friction: SmoothStribeckFriction | None = None  # dry friction on the motor's shaft

    def connections(self) -> Connections:
        friction = () if self.friction is None else (connect(self.friction.flange, self.motor.shaft),)
        stops = () if self.cam_stops is None else (connect(self.cam_stops.flange, self.cam.shaft),)
        return (
            *friction,
            *super().connections(),
            *self._geared(),
            connect(self.cam.follower, self.master.rod),
            connect(self.master.port, self.line.a),
            *stops,
        )

    def _geared(self) -> Connections:
        if isinstance(self.gearbox, PlanetaryTrain):
            return connect(self.motor.shaft, self.gearbox.a), connect(self.gearbox.b, self.cam.shaft)
        assert self.housing is not None
        return (
            connect(self.motor.shaft, self.gearbox.sun),
            connect(self.gearbox.ring, self.housing.flange),
            connect(self.gearbox.carrier, self.cam.shaft),
        )


class ElectromechanicalActuator(CamActuator):
    """Motor, planetary gearbox with fixed ring, cam, master cylinder, line, slave cylinder, clutch."""

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
    """Base class of actuators with a fixed-displacement pump and a tank.

    The relief valve is optional. Without it, a motor that stays on builds up pressure until it stalls.
    """

    pump: Pump
    relief: ReliefValve | None = None  # from the pump's delivery to the tank
    tank: Tank = Tank()

    def connections(self) -> Connections:
        drive = (
            *super().connections(),
            connect(self.motor.shaft, self.pump.shaft),
            connect(self.tank.port, self.pump.a),
        )
        if self.relief is None:
            return drive
        return *drive, connect(self.pump.b, self.relief.a), connect(self.relief.b, self.tank.port)


class PumpParts(TypedDict):
    """The parts that all actuators with a pump have in common."""

    motor: DCMotor
    pump: Pump
    line: Line
    slave: SlaveCylinder
    piston: Mass
    seal: ViscousFriction
    clutch: ClutchSpring | TabulatedSpring


def pump_parts(actuator: PumpActuator) -> PumpParts:
    """The common parts of an actuator with a pump, to build another one with the same parameters."""
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
    """The electrohydraulic actuator with effects that delay its motion.

    These are a supply that rises slowly or late, dry friction on the shaft, which sticks (`StribeckFriction`, with
    events) or creeps (`SmoothStribeckFriction`, smoothed), and a pocket in the line that must be filled first.
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
