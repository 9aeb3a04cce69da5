"""One-dimensional rotational mechanics (as in MSL `Modelica.Mechanics.Rotational`)."""

from ._basic import Damper as Damper
from ._basic import Fixed as Fixed
from ._basic import Inertia as Inertia
from ._basic import Spring as Spring
from ._basic import SpringDamper as SpringDamper
from ._cam import Cam as Cam
from ._cam_profiles import CamProfile as CamProfile
from ._cam_profiles import EccentricDisc as EccentricDisc
from ._cam_profiles import LinearLift as LinearLift
from ._cam_profiles import TabulatedLift as TabulatedLift
from ._friction import Bearing as Bearing
from ._friction import StribeckFriction as StribeckFriction
from ._gears import IdealGear as IdealGear
from ._gears import MeshLoss as MeshLoss
from ._gears import PlanetaryGear as PlanetaryGear
from ._gears import PlanetaryGearbox as PlanetaryGearbox
from ._gears import WormGear as WormGear
from ._interfaces import Compliant as Compliant
from ._interfaces import Flange as Flange
from ._interfaces import ToGround as ToGround
from ._sensors import AngleSensor as AngleSensor
from ._sensors import SpeedSensor as SpeedSensor
from ._sensors import TorqueSensor as TorqueSensor
from ._sources import ConstantTorque as ConstantTorque
from ._sources import SignalSpeed as SignalSpeed
from ._sources import SignalTorque as SignalTorque
