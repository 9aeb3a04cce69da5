"""Names of components in the Modelica Standard Library 4, by package.

Components that are not listed have no counterpart there.
"""

PACKAGES = {
    "blocks": "Modelica.Blocks",
    "electrical": "Modelica.Electrical.Analog",
    "rotational": "Modelica.Mechanics.Rotational",
    "translational": "Modelica.Mechanics.Translational",
    "planar": "Modelica.Mechanics.MultiBody",
    "thermal": "Modelica.Thermal.HeatTransfer",
}

_SAME = {
    "blocks": {
        "Continuous": "Derivative FirstOrder Integrator LimPID PI PID SecondOrder StateSpace TransferFunction",
        "Math": "Division Gain Product",
        "Nonlinear": "DeadZone FixedDelay Limiter PadeDelay SlewRateLimiter",
        "Sources": "Constant ExpSine Exponentials Pulse Ramp SawTooth Sine Step Trapezoid",
        "Logical": "And Hysteresis Not Or Switch Timer Xor",
        "Noise": "NormalNoise UniformNoise",
    },
    "electrical": {
        "Basic": "CCC CCV Capacitor Conductor Ground Gyrator HeatingResistor Inductor Potentiometer Resistor "
        "SaturatingInductor Transformer TranslationalEMF VCC VCV VariableCapacitor VariableInductor VariableResistor",
        "Ideal": "IdealClosingSwitch IdealCommutingSwitch IdealDiode IdealOpeningSwitch IdealTransformer",
        "Semiconductors": "Diode",
        "Sensors": "CurrentSensor PowerSensor VoltageSensor",
        "Sources": "ConstantCurrent ConstantVoltage SignalCurrent SignalVoltage",
    },
    "rotational": {
        "Components": "BearingFriction Brake Clutch Damper Disc ElastoBacklash Fixed IdealGear IdealGearR2T "
        "IdealRollingWheel Inertia LossyGear OneWayClutch Spring SpringDamper",
        "Sensors": "AngleSensor MultiSensor PowerSensor SpeedSensor TorqueSensor",
        "Sources": "ConstantSpeed ConstantTorque LinearSpeedDependentTorque QuadraticSpeedDependentTorque",
    },
    "translational": {
        "Components": "Brake Damper ElastoGap Fixed Mass MassWithStopAndFriction Rod Spring SpringDamper "
        "SupportFriction",
        "Sensors": "ForceSensor MultiSensor PositionSensor PowerSensor SpeedSensor",
        "Sources": "ConstantForce ConstantSpeed LinearSpeedDependentForce QuadraticSpeedDependentForce",
    },
    "planar": {
        "Parts": "Body Fixed FixedTranslation",
        "Joints": "Prismatic Revolute",
        "Forces": "Damper Spring",
    },
    "thermal": {
        "Components": "BodyRadiation Convection HeatCapacitor ThermalConductor",
        "Sensors": "HeatFlowSensor TemperatureSensor",
        "Sources": "FixedTemperature",
    },
}

_OTHER = {
    "blocks": {
        "Clock": "Sources.ContinuousClock",
        "Comparator": "Logical.Greater",
        "Latch": "Logical.RSFlipFlop",
        "LimPI": "Continuous.LimPID",
        "Maximum": "Math.Max",
        "Minimum": "Math.Min",
        "OnDelay": "MathBoolean.OnDelay",
        "SampledDelay": "Discrete.UnitDelay",
        "SampleHold": "Discrete.ZeroOrderHold",
        "Sum": "Math.Add",
        "Table1D": "Tables.CombiTable1Ds",
        "Table2D": "Tables.CombiTable2Ds",
        "TimeSeries": "Sources.CombiTimeTable",
        "TwoPointController": "Logical.OnOffController",
        "WeightedSum": "Math.Sum",
    },
    "electrical": {
        "EMF": "Basic.RotationalEMF",
        "IdealOpAmp": "Ideal.IdealOpAmp3Pin",
        "NegativeResistor": "Basic.Resistor",
        "OpAmp": "Basic.OpAmpDetailed",
    },
    "rotational": {
        "AccelerationSensor": "Sensors.AccSensor",
        "EddyCurrentBrake": "Sources.EddyCurrentTorque",
        "PlanetaryGear": "Components.IdealPlanetary",
        "RelativeAngleSensor": "Sensors.RelAngleSensor",
        "RelativeSpeedSensor": "Sensors.RelSpeedSensor",
        "SignalAcceleration": "Sources.Accelerate",
        "SignalAngle": "Sources.Position",
        "SignalSpeed": "Sources.Speed",
        "SignalTorque": "Sources.Torque",
        "SignalTorque2": "Sources.Torque2",
    },
    "translational": {
        "AccelerationSensor": "Sensors.AccSensor",
        "RelativePositionSensor": "Sensors.RelPositionSensor",
        "RelativeSpeedSensor": "Sensors.RelSpeedSensor",
        "SignalAcceleration": "Sources.Accelerate",
        "SignalForce": "Sources.Force",
        "SignalForce2": "Sources.Force2",
        "SignalPosition": "Sources.Position",
        "SignalSpeed": "Sources.Speed",
        "SlidingMass": "Components.Mass",
    },
    "planar": {
        "DistanceSensor": "Sensors.Distance",
        "ForceSensor": "Sensors.CutForceAndTorque",
        "LineForce": "Forces.LineForceWithMass",
        "SignalForce": "Forces.WorldForceAndTorque",
    },
    "thermal": {
        "ConstantHeatFlow": "Sources.FixedHeatFlow",
        "RelativeTemperatureSensor": "Sensors.RelTemperatureSensor",
        "SignalHeatFlow": "Sources.PrescribedHeatFlow",
        "SignalTemperature": "Sources.PrescribedTemperature",
    },
}

MODELICA: dict[str, dict[str, str]] = {
    domain: {name: f"{package}.{name}" for package, names in _SAME[domain].items() for name in names.split()}
    | _OTHER[domain]
    for domain in PACKAGES
}
