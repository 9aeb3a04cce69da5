"""One-dimensional translational mechanics (as in MSL `Modelica.Mechanics.Translational`)."""

from ._basic import Damper as Damper
from ._basic import Fixed as Fixed
from ._basic import Mass as Mass
from ._basic import Spring as Spring
from ._basic import SpringDamper as SpringDamper
from ._housing import ClutchSpring as ClutchSpring
from ._housing import TabulatedSpring as TabulatedSpring
from ._housing import ViscousFriction as ViscousFriction
from ._interfaces import Compliant as Compliant
from ._interfaces import Flange as Flange
from ._interfaces import ToGround as ToGround
from ._sensors import ForceSensor as ForceSensor
from ._sensors import PositionSensor as PositionSensor
from ._sensors import SpeedSensor as SpeedSensor
from ._sources import ConstantForce as ConstantForce
from ._sources import SignalForce as SignalForce
from ._sources import SignalPosition as SignalPosition
