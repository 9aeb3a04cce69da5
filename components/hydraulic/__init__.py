"""Hydraulics with one liquid of constant properties and pressures above the atmosphere.

The flow variable is the volume flow rate, so mass is conserved only as far as the density is constant; liquids are
compressible in `Line` and `Volume`. Not modelled: cavitation, dissolved air, temperature, inertia of the liquid.
"""

from ._cylinders import MasterCylinder as MasterCylinder
from ._cylinders import SlaveCylinder as SlaveCylinder
from ._interfaces import FluidPort as FluidPort
from ._interfaces import TwoPort as TwoPort
from ._pump import Pump as Pump
from ._sensors import FlowSensor as FlowSensor
from ._sensors import PressureSensor as PressureSensor
from ._solenoid_valve import LiftValve as LiftValve
from ._solenoid_valve import SolenoidValve as SolenoidValve
from ._sources import ConstantFlow as ConstantFlow
from ._sources import ConstantPressure as ConstantPressure
from ._sources import SignalFlow as SignalFlow
from ._sources import SignalPressure as SignalPressure
from ._sources import Tank as Tank
from ._stopped import StickingPump as StickingPump
from ._stopped import StoppedCylinder as StoppedCylinder
from ._switching_valves import IdealCheckValve as IdealCheckValve
from ._switching_valves import SnapReliefValve as SnapReliefValve
from ._valves import CheckValve as CheckValve
from ._valves import LaminarResistance as LaminarResistance
from ._valves import OnOffValve as OnOffValve
from ._valves import Orifice as Orifice
from ._valves import ReliefValve as ReliefValve
from ._volumes import Line as Line
from ._volumes import Volume as Volume
