"""Hydraulic components; pressures are relative to the atmosphere.

The flow q of a port is the mass flow over the density of the liquid at atmospheric pressure. Components with a `Liquid`
account for changes of density, with entrained air and cavitation; others, such as `Line`, `Volume` and `SlaveCylinder`,
assume a constant density. If a component has a heat port, its losses leave there. `fill` with a liquid that carries
heat adds temperatures to a circuit. Not modelled: dissolved air.
"""

from typing import TYPE_CHECKING

from .._lazy import when_asked

if TYPE_CHECKING:
    from ._accumulators import Accumulator as Accumulator
    from ._accumulators import GasAccumulator as GasAccumulator
    from ._accumulators import SpringAccumulator as SpringAccumulator
    from ._accumulators import ThermalAccumulator as ThermalAccumulator
    from ._characteristic_line import CharacteristicLine as CharacteristicLine
    from ._controlled_pumps import LoadSensingPump as LoadSensingPump
    from ._controlled_pumps import PowerLimitedPump as PowerLimitedPump
    from ._controlled_pumps import PressureCompensatedPump as PressureCompensatedPump
    from ._controlled_pumps import ServoPump as ServoPump
    from ._cylinders import MasterCylinder as MasterCylinder
    from ._cylinders import SlaveCylinder as SlaveCylinder
    from ._exchanger import Cooler as Cooler
    from ._exchanger import CounterFlow as CounterFlow
    from ._exchanger import CrossFlow as CrossFlow
    from ._exchanger import HeatExchanger as HeatExchanger
    from ._exchanger import ParallelFlow as ParallelFlow
    from ._exchanger import ShellAndTube as ShellAndTube
    from ._fill import fill as fill
    from ._fittings import EndCushion as EndCushion
    from ._fittings import Filter as Filter
    from ._fittings import TJunction as TJunction
    from ._heat_carrier import Caloric as Caloric
    from ._heat_carrier import HeatCarrier as HeatCarrier
    from ._heating_parts import CirculationPump as CirculationPump
    from ._heating_parts import FlowVolume as FlowVolume
    from ._heating_parts import Radiator as Radiator
    from ._heating_parts import ThermostaticValve as ThermostaticValve
    from ._holding_valve import HoldingValve as HoldingValve
    from ._interfaces import FluidPort as FluidPort
    from ._interfaces import MixedPart as MixedPart
    from ._interfaces import ThermalFluidPort as ThermalFluidPort
    from ._interfaces import TwoPort as TwoPort
    from ._known_liquids import dot_4 as dot_4
    from ._known_liquids import iso_vg_32 as iso_vg_32
    from ._known_liquids import iso_vg_46 as iso_vg_46
    from ._known_liquids import iso_vg_68 as iso_vg_68
    from ._known_liquids import transformer_oil as transformer_oil
    from ._known_liquids import water as water
    from ._liquid_pumps import FixedPump as FixedPump
    from ._liquid_pumps import LiquidPump as LiquidPump
    from ._liquid_pumps import RipplingPump as RipplingPump
    from ._liquid_pumps import VariablePump as VariablePump
    from ._liquids import AnyLiquid as AnyLiquid
    from ._liquids import LinearLiquid as LinearLiquid
    from ._liquids import Liquid as Liquid
    from ._metering import DecelerationValve as DecelerationValve
    from ._metering import FourWaySpool as FourWaySpool
    from ._metering import MeteringEdge as MeteringEdge
    from ._moving_walls import RotaryVaneActuator as RotaryVaneActuator
    from ._moving_walls import SingleActingCylinder as SingleActingCylinder
    from ._pipe_friction import BlasiusFriction as BlasiusFriction
    from ._pipe_friction import ChurchillFriction as ChurchillFriction
    from ._pipe_friction import LaminarFriction as LaminarFriction
    from ._pipe_friction import NoFriction as NoFriction
    from ._pipe_friction import PipeFriction as PipeFriction
    from ._pipe_heat import PipeWall as PipeWall
    from ._pipe_heat import WallPort as WallPort
    from ._pipes import Pipe as Pipe
    from ._pipes import Segments as Segments
    from ._poppet import PoppetValve as PoppetValve
    from ._pressure_valves import BypassCompensator as BypassCompensator
    from ._pressure_valves import ChargingValve as ChargingValve
    from ._pressure_valves import CounterbalanceValve as CounterbalanceValve
    from ._pressure_valves import ExternallyPilotedValve as ExternallyPilotedValve
    from ._pressure_valves import FlowControlValve as FlowControlValve
    from ._pressure_valves import LaggingValve as LaggingValve
    from ._pressure_valves import PilotCheckValve as PilotCheckValve
    from ._pressure_valves import PilotedValve as PilotedValve
    from ._pressure_valves import PilotReliefValve as PilotReliefValve
    from ._pressure_valves import PressureReducingValve as PressureReducingValve
    from ._pressure_valves import SequenceValve as SequenceValve
    from ._pressure_valves import UnloadingValve as UnloadingValve
    from ._pump import Pump as Pump
    from ._pump_losses import MappedLosses as MappedLosses
    from ._pump_losses import PumpLosses as PumpLosses
    from ._pump_losses import SchloesserLosses as SchloesserLosses
    from ._pump_losses import WilsonLosses as WilsonLosses
    from ._restrictions import AnnularGap as AnnularGap
    from ._restrictions import DrilledPassage as DrilledPassage
    from ._restrictions import LiquidOrifice as LiquidOrifice
    from ._restrictions import LocalLoss as LocalLoss
    from ._restrictions import VariableOrifice as VariableOrifice
    from ._solenoid_valve import LiftValve as LiftValve
    from ._solenoid_valve import SolenoidValve as SolenoidValve
    from ._sources import ConstantFlow as ConstantFlow
    from ._sources import ConstantPressure as ConstantPressure
    from ._sources import FlowSensor as FlowSensor
    from ._sources import PressureSensor as PressureSensor
    from ._sources import SignalFlow as SignalFlow
    from ._sources import SignalPressure as SignalPressure
    from ._sources import Tank as Tank
    from ._spool_valves import FourWayValve as FourWayValve
    from ._spool_valves import PilotStage as PilotStage
    from ._spool_valves import ProportionalReducingValve as ProportionalReducingValve
    from ._spool_valves import ProportionalValve as ProportionalValve
    from ._spool_valves import ServoValve as ServoValve
    from ._spool_valves import SixWayValve as SixWayValve
    from ._spool_valves import Spool as Spool
    from ._spool_valves import ThreeWayValve as ThreeWayValve
    from ._stopped import StickingPump as StickingPump
    from ._stopped import StoppedCylinder as StoppedCylinder
    from ._switching_valves import IdealCheckValve as IdealCheckValve
    from ._switching_valves import PurgeValve as PurgeValve
    from ._switching_valves import ShuttleValve as ShuttleValve
    from ._switching_valves import SnapReliefValve as SnapReliefValve
    from ._tanks import BootstrapTank as BootstrapTank
    from ._tanks import LevelTank as LevelTank
    from ._tanks import Vessel as Vessel
    from ._unsteady_friction import FrictionMemory as FrictionMemory
    from ._unsteady_friction import UnsteadyFrictionPipe as UnsteadyFrictionPipe
    from ._valves import CheckValve as CheckValve
    from ._valves import LaminarResistance as LaminarResistance
    from ._valves import OnOffValve as OnOffValve
    from ._valves import Orifice as Orifice
    from ._valves import ReliefValve as ReliefValve
    from ._valves import SpringLoadedValve as SpringLoadedValve
    from ._volumes import Chamber as Chamber
    from ._volumes import Line as Line
    from ._volumes import Volume as Volume
    from ._working_cylinder import DoubleActingCylinder as DoubleActingCylinder
    from ._working_cylinder import HydraulicCylinder as HydraulicCylinder
    from ._working_cylinder import TandemCylinder as TandemCylinder
else:
    __getattr__, __dir__, __all__ = when_asked(__name__)
