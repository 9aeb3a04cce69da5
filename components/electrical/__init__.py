"""Electrical components (as in MSL `Modelica.Electrical.Analog`)."""

from ._interfaces import Pin as Pin
from ._interfaces import TwoPin as TwoPin
from ._machines import EMF as EMF
from ._machines import DCMotor as DCMotor
from ._passive import Capacitor as Capacitor
from ._passive import Ground as Ground
from ._passive import Inductor as Inductor
from ._passive import Resistor as Resistor
from ._sensors import CurrentSensor as CurrentSensor
from ._sensors import PowerSensor as PowerSensor
from ._sensors import VoltageSensor as VoltageSensor
from ._sources import ConstantCurrent as ConstantCurrent
from ._sources import ConstantVoltage as ConstantVoltage
from ._sources import SignalCurrent as SignalCurrent
from ._sources import SignalVoltage as SignalVoltage
