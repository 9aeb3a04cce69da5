"""Names of components with the same purpose in the Foundation library of Simscape, and in Simscape Electrical.

Those of `components.hydraulic` are in `_fluid_power.py`.
"""

SIMSCAPE: dict[str, dict[str, str]] = {
    "blocks": {
        "Constant": "PS Constant",
        "Counter": "PS Counter",
        "DeadZone": "PS Dead Zone",
        "Division": "PS Divide",
        "Gain": "PS Gain",
        "Integrator": "PS Integrator",
        "Limiter": "PS Saturation",
        "Maximum": "PS Max",
        "Minimum": "PS Min",
        "NormalNoise": "PS Random Number",
        "PadeDelay": "PS Constant Delay",
        "Product": "PS Product",
        "Sine": "PS Sine Wave",
        "Step": "PS Step",
        "Sum": "PS Add",
        "Switch": "PS Switch",
        "Table1D": "PS Lookup Table (1D)",
        "Table2D": "PS Lookup Table (2D)",
        "TransferFunction": "PS Transfer Function",
        "TransportDelay": "PS Variable Delay",
        "UniformNoise": "PS Uniform Random Number",
    },
    "electrical": {
        "Battery": "Battery",
        "Capacitor": "Capacitor",
        "CCC": "Current-Controlled Current Source",
        "CCV": "Current-Controlled Voltage Source",
        "ConstantCurrent": "DC Current Source",
        "ConstantVoltage": "DC Voltage Source",
        "CurrentSensor": "Current Sensor",
        "DCMotor": "DC Motor",
        "Diode": "Diode",
        "EMF": "Rotational Electromechanical Converter",
        "Ground": "Electrical Reference",
        "Gyrator": "Gyrator",
        "IdealClosingSwitch": "Switch",
        "IdealOpAmp": "Op-Amp",
        "IdealTransformer": "Ideal Transformer",
        "Inductor": "Inductor",
        "OpAmp": "Band-Limited Op-Amp",
        "PMSM": "PMSM",
        "Resistor": "Resistor",
        "SignalCurrent": "Controlled Current Source",
        "SignalVoltage": "Controlled Voltage Source",
        "TranslationalEMF": "Translational Electromechanical Converter",
        "VariableResistor": "Variable Resistor",
        "VCC": "Voltage-Controlled Current Source",
        "VCV": "Voltage-Controlled Voltage Source",
        "VoltageSensor": "Voltage Sensor",
    },
    "rotational": {
        "Damper": "Rotational Damper",
        "Fixed": "Mechanical Rotational Reference",
        "HardStop": "Rotational Hard Stop",
        "IdealGear": "Gear Box",
        "IdealRollingWheel": "Wheel and Axle",
        "Inertia": "Inertia",
        "PlanetaryGear": "Planetary Gear",
        "RelativeAngleSensor": "Ideal Rotational Motion Sensor",
        "SignalSpeed": "Ideal Angular Velocity Source",
        "SignalTorque2": "Ideal Torque Source",
        "Spring": "Rotational Spring",
        "StribeckFriction": "Rotational Friction",
        "TorqueSensor": "Ideal Torque Sensor",
    },
    "translational": {
        "Damper": "Translational Damper",
        "Fixed": "Mechanical Translational Reference",
        "ForceSensor": "Ideal Force Sensor",
        "HardStop": "Translational Hard Stop",
        "Lever": "Lever",
        "Mass": "Mass",
        "RelativePositionSensor": "Ideal Translational Motion Sensor",
        "SignalForce2": "Ideal Force Source",
        "SignalSpeed": "Ideal Translational Velocity Source",
        "Spring": "Translational Spring",
        "StribeckFriction": "Translational Friction",
    },
    "thermal": {
        "BodyRadiation": "Radiative Heat Transfer",
        "ConstantHeatFlow": "Heat Flow Rate Source",
        "Convection": "Convective Heat Transfer",
        "FixedTemperature": "Temperature Source",
        "HeatCapacitor": "Thermal Mass",
        "HeatFlowSensor": "Heat Flow Rate Sensor",
        "RelativeTemperatureSensor": "Temperature Sensor",
        "SignalHeatFlow": "Controlled Heat Flow Rate Source",
        "SignalTemperature": "Controlled Temperature Source",
        "ThermalConductor": "Conductive Heat Transfer",
    },
}


def names() -> str:
    """The components that have a counterpart, with its name there."""
    return "\n".join(
        f"{domain}.{name:<{38 - len(domain)}}{there}"
        for domain, known in SIMSCAPE.items()
        for name, there in known.items()
    )
