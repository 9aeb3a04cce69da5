"""Electrical components (as in MSL `Modelica.Electrical.Analog`)."""

from typing import TYPE_CHECKING

from .._lazy import when_asked

if TYPE_CHECKING:
    from ._amplifiers import OpAmp as OpAmp
    from ._amplifiers import VoltageComparator as VoltageComparator
    from ._battery import Battery as Battery
    from ._battery import Cable as Cable
    from ._bridge_inverters import AveragedBrakeChopper as AveragedBrakeChopper
    from ._bridge_inverters import BrakeChopper as BrakeChopper
    from ._bridge_inverters import DiodeBridge as DiodeBridge
    from ._bridge_inverters import PhaseInverter as PhaseInverter
    from ._bridge_inverters import PhaseModulator as PhaseModulator
    from ._brushed_motor import BrushDrop as BrushDrop
    from ._brushed_motor import BrushedMotor as BrushedMotor
    from ._brushed_motor import MagnetEMF as MagnetEMF
    from ._current_control import CurrentControlledBridge as CurrentControlledBridge
    from ._dq_machine import DqCurrents as DqCurrents
    from ._dq_machine import DqMachine as DqMachine
    from ._half_bridges import AveragedHalfBridge as AveragedHalfBridge
    from ._half_bridges import HalfBridge as HalfBridge
    from ._half_bridges import Leg as Leg
    from ._interfaces import Pin as Pin
    from ._interfaces import TwoPin as TwoPin
    from ._interfaces import TwoPort as TwoPort
    from ._limited_bridge import CurrentLimitedBridge as CurrentLimitedBridge
    from ._machines import EMF as EMF
    from ._machines import DCMotor as DCMotor
    from ._machines import TranslationalEMF as TranslationalEMF
    from ._nonlinear import Diode as Diode
    from ._nonlinear import IdealOpAmp as IdealOpAmp
    from ._nonlinear import SaturatingInductor as SaturatingInductor
    from ._passive import Capacitor as Capacitor
    from ._passive import Conductor as Conductor
    from ._passive import Ground as Ground
    from ._passive import Inductor as Inductor
    from ._passive import NegativeResistor as NegativeResistor
    from ._passive import Resistor as Resistor
    from ._pmsm import PMSM as PMSM
    from ._pmsm import DqCurrentSensor as DqCurrentSensor
    from ._pmsm import DqPort as DqPort
    from ._pmsm import Inverter as Inverter
    from ._pmsm import PMSMDrive as PMSMDrive
    from ._sensors import CurrentSensor as CurrentSensor
    from ._sensors import PowerSensor as PowerSensor
    from ._sensors import VoltageSensor as VoltageSensor
    from ._solenoid import DataSheetSolenoid as DataSheetSolenoid
    from ._solenoid import Solenoid as Solenoid
    from ._sources import ConstantCurrent as ConstantCurrent
    from ._sources import ConstantVoltage as ConstantVoltage
    from ._sources import SignalCurrent as SignalCurrent
    from ._sources import SignalVoltage as SignalVoltage
    from ._switches import IdealClosingSwitch as IdealClosingSwitch
    from ._switches import IdealCommutingSwitch as IdealCommutingSwitch
    from ._switches import IdealDiode as IdealDiode
    from ._switches import IdealOpeningSwitch as IdealOpeningSwitch
    from ._three_phase import DqTerminals as DqTerminals
    from ._three_phase import PhaseCapacitor as PhaseCapacitor
    from ._three_phase import PhaseImpedance as PhaseImpedance
    from ._three_phase import PhasePins as PhasePins
    from ._three_phase import PhasePort as PhasePort
    from ._three_phase import StarPoint as StarPoint
    from ._three_phase import ThreePhaseSource as ThreePhaseSource
    from ._two_ports import CCC as CCC
    from ._two_ports import CCV as CCV
    from ._two_ports import VCC as VCC
    from ._two_ports import VCV as VCV
    from ._two_ports import AveragedBridge as AveragedBridge
    from ._two_ports import Gyrator as Gyrator
    from ._two_ports import HBridge as HBridge
    from ._two_ports import IdealTransformer as IdealTransformer
    from ._two_ports import Transformer as Transformer
    from ._variable import HeatingResistor as HeatingResistor
    from ._variable import Potentiometer as Potentiometer
    from ._variable import VariableCapacitor as VariableCapacitor
    from ._variable import VariableInductor as VariableInductor
    from ._variable import VariableResistor as VariableResistor
else:
    __getattr__, __dir__, __all__ = when_asked(__name__)
