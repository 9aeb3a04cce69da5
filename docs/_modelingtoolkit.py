"""Names of components with the same purpose in ModelingToolkitStandardLibrary 2, by module.

Those of `components.hydraulic` are in `_fluid_power.py`.
"""

MODULES = {
    "blocks": "Blocks",
    "electrical": "Electrical",
    "rotational": "Mechanical.Rotational",
    "translational": "Mechanical",
    "planar": "Mechanical.PlanarMechanics",
    "thermal": "Thermal",
}

_SAME = {
    "blocks": "Constant DeadZone Derivative Division ExpSine FirstOrder Gain Integrator LimPI LimPID Limiter PI PID "
    "Product Ramp SecondOrder Sine SlewRateLimiter StateSpace Step",
    "electrical": "Capacitor Conductor CurrentSensor Diode EMF Ground IdealOpAmp Inductor PowerSensor Resistor "
    "VariableResistor VoltageSensor",
    "rotational": "AngleSensor ConstantTorque Damper Fixed IdealGear Inertia SpeedSensor Spring SpringDamper "
    "TorqueSensor",
    "translational": "",
    "planar": "Body Fixed FixedTranslation Prismatic Revolute",
    "thermal": "BodyRadiation FixedTemperature HeatCapacitor HeatFlowSensor RelativeTemperatureSensor "
    "TemperatureSensor ThermalConductor",
}

_OTHER = {
    "blocks": {"Clock": "ContinuousClock", "Sum": "Add", "WeightedSum": "Sum"},
    "electrical": {"SignalCurrent": "Current", "SignalVoltage": "Voltage"},
    "rotational": {
        "RelativeSpeedSensor": "RelSpeedSensor",
        "SignalAngle": "Position",
        "SignalSpeed": "Speed",
        "SignalTorque": "Torque",
        "SmoothStribeckFriction": "RotationalFriction",
    },
    "translational": {
        "AccelerationSensor": "Translational.AccelerationSensor",
        "Damper": "TranslationalModelica.Damper",
        "Fixed": "TranslationalModelica.Fixed",
        "ForceSensor": "Translational.ForceSensor",
        "Mass": "TranslationalModelica.Mass",
        "PositionSensor": "Translational.PositionSensor",
        "SignalAcceleration": "Translational.Acceleration",
        "SignalForce": "TranslationalModelica.Force",
        "SignalPosition": "Translational.Position",
        "SignalSpeed": "Translational.Velocity",
        "Spring": "TranslationalModelica.Spring",
    },
    "planar": {"PositionSensor": "AbsolutePosition", "SpeedSensor": "AbsoluteVelocity"},
    "thermal": {
        "ConstantHeatFlow": "FixedHeatFlow",
        "Convection": "ConvectiveConductor",
        "SignalHeatFlow": "PrescribedHeatFlow",
        "SignalTemperature": "PrescribedTemperature",
    },
}

MODELINGTOOLKIT = {
    domain: dict(sorted(({name: name for name in _SAME[domain].split()} | _OTHER[domain]).items()))
    for domain in MODULES
}

# Its components without a counterpart here.
MISSING = (
    "Blocks: MatrixGain, Feedback, Add3, Square, Triangular, Cosine (a Sine with its phase), and functions one by one, "
    "such as Sqrt and Atan2 (a Function); Electrical: Short, MultiSensor, PotentialSensor, transistors, digital logic; "
    "Thermal: ConvectiveResistor, ThermalResistor, ThermalCollector; Magnetic; MultiBody2D"
)


def names() -> str:
    """The components that have a counterpart, with its name there, then the missing components."""
    lines = [
        f"{domain}.{name:<{40 - len(domain)}}{MODULES[domain]}.{there}"
        for domain, known in MODELINGTOOLKIT.items()
        for name, there in known.items()
    ]
    return "\n".join([*lines, "", f"Without a counterpart here: {MISSING}."])
