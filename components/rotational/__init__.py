"""One-dimensional rotational mechanics (as in MSL `Modelica.Mechanics.Rotational`)."""

from typing import TYPE_CHECKING

from .._lazy import when_asked

if TYPE_CHECKING:
    from ._basic import Damper as Damper
    from ._basic import Disc as Disc
    from ._basic import Fixed as Fixed
    from ._basic import Inertia as Inertia
    from ._basic import Spring as Spring
    from ._basic import SpringDamper as SpringDamper
    from ._basic import TabulatedDamper as TabulatedDamper
    from ._cam import Cam as Cam
    from ._cam import CamContact as CamContact
    from ._cam import FlatFollower as FlatFollower
    from ._cam import Follower as Follower
    from ._cam import RollerFollower as RollerFollower
    from ._cam_profiles import BSplineMotion as BSplineMotion
    from ._cam_profiles import CamProfile as CamProfile
    from ._cam_profiles import Cycloidal as Cycloidal
    from ._cam_profiles import EccentricDisc as EccentricDisc
    from ._cam_profiles import FlatEccentricDisc as FlatEccentricDisc
    from ._cam_profiles import LinearLift as LinearLift
    from ._cam_profiles import ModifiedSine as ModifiedSine
    from ._cam_profiles import Motion as Motion
    from ._cam_profiles import Polynomial345 as Polynomial345
    from ._cam_profiles import RiseDwellReturn as RiseDwellReturn
    from ._cam_profiles import TabulatedLift as TabulatedLift
    from ._dry_friction import BearingFriction as BearingFriction
    from ._dry_friction import CouplingFriction as CouplingFriction
    from ._dry_friction import DryFriction as DryFriction
    from ._dry_friction import ShaftFriction as ShaftFriction
    from ._dry_friction import StribeckFriction as StribeckFriction
    from ._eddy_current import EddyCurrentBrake as EddyCurrentBrake
    from ._eddy_current import IronLoss as IronLoss
    from ._friction import LuGreFriction as LuGreFriction
    from ._friction import SmoothStribeckFriction as SmoothStribeckFriction
    from ._friction import ViscousFriction as ViscousFriction
    from ._gears import EqualMeshLoss as EqualMeshLoss
    from ._gears import IdealGear as IdealGear
    from ._gears import MeshLoss as MeshLoss
    from ._gears import PlanetaryGear as PlanetaryGear
    from ._gears import PlanetaryGearbox as PlanetaryGearbox
    from ._gears import WormGear as WormGear
    from ._helix import Helix as Helix
    from ._helix import LossyGearR2T as LossyGearR2T
    from ._interfaces import Compliant as Compliant
    from ._interfaces import Flange as Flange
    from ._interfaces import ToGround as ToGround
    from ._learned import LearnedDamper as LearnedDamper
    from ._learned import LearnedFriction as LearnedFriction
    from ._learned import LearnedSpring as LearnedSpring
    from ._learned import SmoothLearnedFriction as SmoothLearnedFriction
    from ._linkages import CrankSlider as CrankSlider
    from ._linkages import FlexibleCoupling as FlexibleCoupling
    from ._linkages import ReleaseBearing as ReleaseBearing
    from ._lossy_gear import LossyGear as LossyGear
    from ._pressed import Brake as Brake
    from ._pressed import Clutch as Clutch
    from ._pressed import OneWayClutch as OneWayClutch
    from ._pressed import Pressed as Pressed
    from ._pressed import SpringAppliedBrake as SpringAppliedBrake
    from ._sensors import AccelerationSensor as AccelerationSensor
    from ._sensors import AngleSensor as AngleSensor
    from ._sensors import Encoder as Encoder
    from ._sensors import MultiSensor as MultiSensor
    from ._sensors import PowerSensor as PowerSensor
    from ._sensors import RelativeAngleSensor as RelativeAngleSensor
    from ._sensors import RelativeSpeedSensor as RelativeSpeedSensor
    from ._sensors import SpeedSensor as SpeedSensor
    from ._sensors import TorqueSensor as TorqueSensor
    from ._sources import ConstantSpeed as ConstantSpeed
    from ._sources import ConstantTorque as ConstantTorque
    from ._sources import LinearSpeedDependentTorque as LinearSpeedDependentTorque
    from ._sources import QuadraticSpeedDependentTorque as QuadraticSpeedDependentTorque
    from ._sources import SignalAcceleration as SignalAcceleration
    from ._sources import SignalAngle as SignalAngle
    from ._sources import SignalSpeed as SignalSpeed
    from ._sources import SignalTorque as SignalTorque
    from ._sources import SignalTorque2 as SignalTorque2
    from ._stops import ElastoBacklash as ElastoBacklash
    from ._stops import HardStop as HardStop
    from ._train import PlanetaryTrain as PlanetaryTrain
    from ._tyre import MagicFormula as MagicFormula
    from ._tyre import TransientTyre as TransientTyre
    from ._tyre import Tyre as Tyre
    from ._wheels import Belt as Belt
    from ._wheels import FrictionBelt as FrictionBelt
    from ._wheels import IdealGearR2T as IdealGearR2T
    from ._wheels import IdealRollingWheel as IdealRollingWheel
    from ._wheels import SynchronousBelt as SynchronousBelt
else:
    __getattr__, __dir__, __all__ = when_asked(__name__)
