"""One-dimensional translational mechanics (as in MSL `Modelica.Mechanics.Translational`)."""

from typing import TYPE_CHECKING

from .._lazy import when_asked

if TYPE_CHECKING:
    from ._basic import Damper as Damper
    from ._basic import DualRateSpring as DualRateSpring
    from ._basic import Fixed as Fixed
    from ._basic import Mass as Mass
    from ._basic import Rod as Rod
    from ._basic import SlidingMass as SlidingMass
    from ._basic import Spring as Spring
    from ._basic import SpringDamper as SpringDamper
    from ._basic import TabulatedDamper as TabulatedDamper
    from ._contact import ElastoGap as ElastoGap
    from ._contact import RigidContact as RigidContact
    from ._disc_springs import ConicalDisc as ConicalDisc
    from ._disc_springs import Diaphragm as Diaphragm
    from ._disc_springs import DiaphragmClutch as DiaphragmClutch
    from ._disc_springs import DiscSpring as DiscSpring
    from ._dry_friction import Brake as Brake
    from ._dry_friction import DryFriction as DryFriction
    from ._dry_friction import StribeckFriction as StribeckFriction
    from ._dry_friction import SupportFriction as SupportFriction
    from ._dry_friction import TustinFriction as TustinFriction
    from ._friction import LuGreFriction as LuGreFriction
    from ._friction import SmoothStribeckFriction as SmoothStribeckFriction
    from ._friction import ViscousFriction as ViscousFriction
    from ._housing import ClutchSpring as ClutchSpring
    from ._housing import TabulatedSpring as TabulatedSpring
    from ._interfaces import Compliant as Compliant
    from ._interfaces import Flange as Flange
    from ._interfaces import ToGround as ToGround
    from ._lever import Lever as Lever
    from ._lever import Rope as Rope
    from ._lever import Tackle as Tackle
    from ._sensors import AccelerationSensor as AccelerationSensor
    from ._sensors import ForceSensor as ForceSensor
    from ._sensors import MultiSensor as MultiSensor
    from ._sensors import PositionSensor as PositionSensor
    from ._sensors import PowerSensor as PowerSensor
    from ._sensors import RelativePositionSensor as RelativePositionSensor
    from ._sensors import RelativeSpeedSensor as RelativeSpeedSensor
    from ._sensors import SpeedSensor as SpeedSensor
    from ._sources import ConstantForce as ConstantForce
    from ._sources import ConstantSpeed as ConstantSpeed
    from ._sources import LinearSpeedDependentForce as LinearSpeedDependentForce
    from ._sources import QuadraticSpeedDependentForce as QuadraticSpeedDependentForce
    from ._sources import SignalAcceleration as SignalAcceleration
    from ._sources import SignalForce as SignalForce
    from ._sources import SignalForce2 as SignalForce2
    from ._sources import SignalPosition as SignalPosition
    from ._sources import SignalSpeed as SignalSpeed
    from ._stops import HardStop as HardStop
    from ._stops import MassWithStopAndFriction as MassWithStopAndFriction
    from ._vehicle import Driver as Driver
    from ._vehicle import Vehicle as Vehicle
    from ._vehicle import eudc as eudc
else:
    __getattr__, __dir__, __all__ = when_asked(__name__)
