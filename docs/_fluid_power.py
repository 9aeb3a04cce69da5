"""Names of hydraulic components with the same purpose in other libraries.

The libraries are, in this order: `Modelica.Fluid` of MSL 4, OpenHydraulics 2 (its Basic and Components), Simscape
Fluids, Isothermal Liquid, whose block names end in (IL), and `Hydraulic.IsothermalCompressible` of
ModelingToolkitStandardLibrary 2. The laws may differ in form and in parameters.
"""

import types

from ._exported import exported

HEADS = ("component", "Modelica.Fluid", "OpenHydraulics", "Simscape (IL)", "ModelingToolkit")
_SLIDING = "Variable-Displacement Pump"
_FOUR_WAY = "4-Way 3-Position Directional Valve"

NAMES: dict[str, tuple[str, str, str, str]] = {
    "AnnularGap": ("-", "-", "Annular Leakage", "-"),
    "BlasiusFriction": ("-", "-", "-", "-"),
    "BootstrapTank": ("-", "-", "-", "-"),
    "BypassCompensator": ("-", "-", "Pressure Compensator Valve", "-"),
    "Caloric": ("-", "-", "Thermal Liquid Properties (TL)", "-"),
    "Chamber": ("Vessels.ClosedVolume", "VolumeClosed", "Constant Volume Chamber", "FixedVolume"),
    "CirculationPump": ("Machines.PrescribedPump", "-", "Centrifugal Pump", "-"),
    "CharacteristicLine": ("-", "-", "-", "-"),
    "ChargingValve": ("-", "-", "-", "-"),
    "CheckValve": ("-", "CheckValve", "Check Valve", "-"),
    "ChurchillFriction": ("Pipes.BaseClasses.WallFriction.Detailed", "WallFriction", "Pipe", "friction_factor"),
    "ConstantFlow": ("Sources.MassFlowSource_T", "ConstVolumeSource", "Flow Rate Source", "MassFlow"),
    "ConstantPressure": ("Sources.FixedBoundary", "ConstPressureSource", "Pressure Source", "FixedPressure"),
    "Cooler": ("-", "-", "-", "-"),
    "CounterbalanceValve": ("-", "-", "Counterbalance Valve", "-"),
    "CounterFlow": ("-", "-", "-", "-"),
    "CrossFlow": ("-", "-", "-", "-"),
    "DecelerationValve": ("-", "-", "-", "-"),
    "DoubleActingCylinder": ("-", "DoubleActingCylinder", "Double-Acting Actuator", "Actuator"),
    "DrilledPassage": ("Fittings.Bends.EdgedBend", "LaminarRestriction", "Pipe Bend", "-"),
    "EndCushion": ("-", "CylinderCushion", "Cylinder Cushion", "-"),
    "Filter": ("-", "-", "-", "-"),
    "FixedPump": ("-", "ConstantDisplacementPump", "Fixed-Displacement Pump", "-"),
    "FlowControlValve": ("-", "-", "Pressure-Compensated Flow Control Valve", "-"),
    "FlowSensor": ("Sensors.VolumeFlowRate", "FlowSensor", "Flow Rate Sensor", "-"),
    "FlowVolume": ("Vessels.ClosedVolume", "-", "Constant Volume Chamber (TL)", "-"),
    "FourWaySpool": ("-", "-", "-", "SpoolValve2Way"),
    "FourWayValve": ("-", "V4_3CC, V4_3OC", _FOUR_WAY, "-"),
    "FrictionMemory": ("-", "-", "-", "-"),
    "GasAccumulator": ("-", "Accumulator", "Gas-Charged Accumulator", "-"),
    "HeatCarrier": ("-", "-", "-", "-"),
    "HeatExchanger": ("-", "-", "Heat Exchanger (TL-TL)", "-"),
    "HoldingValve": ("-", "-", "-", "-"),
    "HydraulicCylinder": ("-", "DoubleActingCylinder", "Double-Acting Actuator", "Actuator"),
    "IdealCheckValve": ("-", "CheckValve", "Check Valve", "-"),
    "LaminarFriction": ("Pipes.BaseClasses.WallFriction.Laminar", "-", "-", "-"),
    "LaminarResistance": ("Valves.ValveLinear", "LaminarRestriction", "Laminar Leakage", "-"),
    "LevelTank": ("Vessels.OpenTank", "OpenTank", "Tank", "-"),
    "LiftValve": ("-", "-", "Poppet Valve", "-"),
    "Line": ("-", "-", "-", "-"),
    "LinearLiquid": ("-", "-", "Isothermal Liquid Properties", "HydraulicFluid"),
    "Liquid": ("-", "-", "Isothermal Liquid Properties", "HydraulicFluid"),
    "LiquidOrifice": ("Fittings.SharpEdgedOrifice", "SharpEdgedOrifice", "Orifice", "-"),
    "LoadSensingPump": ("-", "PCLSPump", "-", "-"),
    "LocalLoss": ("Fittings.AbruptAdaptor, Fittings.Bends", "SuddenExpansion", "Area Change, Pipe Bend", "-"),
    "MappedLosses": ("-", "-", "Fixed-Displacement Pump, tabulated losses", "-"),
    "MasterCylinder": ("-", "FluidPower2MechTrans", "Translational Mechanical Converter", "Volume"),
    "MeteringEdge": ("-", "-", "Spool Orifice", "SpoolValve"),
    "NoFriction": ("Pipes.BaseClasses.WallFriction.NoFriction", "-", "-", "-"),
    "OnOffValve": ("Valves.ValveDiscrete", "VariableRestriction", "2-Way Directional Valve", "-"),
    "Orifice": ("Fittings.SimpleGenericOrifice", "SharpEdgedOrifice", "Local Restriction", "-"),
    "PilotCheckValve": ("-", "-", "Pilot-Operated Check Valve", "-"),
    "PilotReliefValve": ("-", "ReliefValve", "Pressure Relief Valve", "-"),
    "PilotStage": ("-", "-", "-", "-"),
    "ParallelFlow": ("-", "-", "-", "-"),
    "Pipe": ("Pipes.DynamicPipe", "Line", "Pipe", "Tube"),
    "PipeWall": ("-", "-", "-", "-"),
    "PoppetValve": ("-", "-", "Poppet Valve", "-"),
    "PowerLimitedPump": ("-", "-", "-", "-"),
    "PressureCompensatedPump": ("-", "-", "Pressure-Compensated Pump", "-"),
    "PressureReducingValve": ("-", "-", "Pressure-Reducing Valve", "-"),
    "PressureSensor": ("Sensors.Pressure", "PressureSensor", "Pressure Sensor", "-"),
    "ProportionalReducingValve": ("-", "-", "Pressure-Reducing 3-Way Valve", "-"),
    "ProportionalValve": ("-", "-", _FOUR_WAY, "-"),
    "Pump": ("-", "FluidPower2MechRotConst", "Fixed-Displacement Pump", "-"),
    "PurgeValve": ("-", "-", "-", "-"),
    "ReliefValve": ("-", "ReliefValve", "Pressure Relief Valve", "-"),
    "Radiator": ("-", "-", "-", "-"),
    "RipplingPump": ("-", "-", "-", "-"),
    "RotaryVaneActuator": ("-", "-", "Double-Acting Rotary Actuator", "-"),
    "SchloesserLosses": ("-", "-", "-", "-"),
    "SequenceValve": ("-", "-", "-", "-"),
    "ServoPump": ("-", "-", _SLIDING, "-"),
    "ServoValve": ("-", "-", _FOUR_WAY, "-"),
    "ShellAndTube": ("-", "-", "-", "-"),
    "ShuttleValve": ("-", "ShuttleValve", "Shuttle Valve", "-"),
    "SignalFlow": ("Sources.MassFlowSource_T", "VarVolumeSource", "Flow Rate Source", "MassFlow"),
    "SignalPressure": ("Sources.Boundary_pT", "VarPressureSource", "Pressure Source", "Pressure"),
    "SingleActingCylinder": ("Machines.SweptVolume", "FluidPower2MechTrans", "Single-Acting Actuator", "DynamicVolume"),
    "SixWayValve": ("-", "V6_3OC", "M-Way N-Position Directional Valve", "-"),
    "SlaveCylinder": ("-", "FluidPower2MechTrans", "Translational Mechanical Converter", "Volume"),
    "SnapReliefValve": ("-", "-", "-", "-"),
    "SolenoidValve": ("-", "-", "-", "-"),
    "SpringAccumulator": ("-", "-", "Spring-Loaded Accumulator", "-"),
    "StickingPump": ("-", "-", "-", "-"),
    "StoppedCylinder": ("-", "-", "Single-Acting Actuator", "-"),
    "TandemCylinder": ("-", "-", "-", "-"),
    "Tank": ("Sources.FixedBoundary", "CircuitTank", "Reservoir", "FixedPressure"),
    "ThermalAccumulator": ("-", "-", "-", "-"),
    "ThermostaticValve": ("-", "-", "Temperature Control Valve (TL)", "-"),
    "ThreeWayValve": ("-", "-", "3-Way Directional Valve", "-"),
    "TJunction": ("Fittings.TeeJunctionIdeal", "NJunction", "T-Junction", "-"),
    "UnloadingValve": ("-", "-", "-", "-"),
    "UnsteadyFrictionPipe": ("-", "-", "-", "-"),
    "VariableOrifice": ("Valves.ValveIncompressible", "VariableRestriction", "Orifice", "Valve"),
    "VariablePump": ("-", "VariableDisplacementPump", _SLIDING, "-"),
    "Vessel": ("Vessels.OpenTank", "OpenTank", "Tank", "-"),
    "Volume": ("Vessels.ClosedVolume", "VolumeClosed", "Constant Volume Chamber", "FixedVolume"),
    "WilsonLosses": ("-", "MechanicalPumpLosses", "-", "-"),
}

# Parts of other libraries without a counterpart here.
MISSING = {
    "Modelica.Fluid": "Machines.Pump (centrifugal), Vessels with several ports at different heights; "
    "media other than liquids at one temperature",
    "OpenHydraulics": "PostPCValve, V6_3CCLS and the other sections of load-sensing valve blocks",
    "Simscape (IL)": "Centrifugal Pump, Jet Pump, turbines, Cartridge Valve Insert, Gate Valve, Ball Valve, "
    "Partially Filled Pipe",
    "ModelingToolkitStandardLibrary": "Open, FlowDivider (Cap corresponds to an unconnected port)",
}


def table(package: types.ModuleType) -> str:
    """The components and records of the package with their names elsewhere, then the missing parts."""
    rows = [HEADS, *((item.__name__, *NAMES[item.__name__]) for item in exported(package))]
    widths = [max(len(row[i]) for row in rows) + 2 for i in range(len(HEADS) - 1)]
    lines = ["".join(cell.ljust(width) for cell, width in zip(row, [*widths, 0], strict=True)) for row in rows]
    missing = [f"{library}: {names}." for library, names in MISSING.items()]
    return "\n".join([*lines, "", "Without a counterpart here:", *missing])
