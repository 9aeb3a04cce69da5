"""Examples of thermal components."""

from components.thermal import (
    BodyRadiation,
    ConstantHeatFlow,
    Convection,
    FixedTemperature,
    HeatCapacitor,
    HeatFlowSensor,
    RelativeTemperatureSensor,
    SignalHeatFlow,
    SignalTemperature,
    TemperatureSensor,
    ThermalConductor,
)

EXAMPLES = (
    BodyRadiation(Gr=0.05),
    ConstantHeatFlow(heat_flow=50.0),
    Convection(),
    FixedTemperature(temperature=293.15),
    HeatCapacitor(C=450.0),
    HeatFlowSensor(),
    RelativeTemperatureSensor(),
    SignalHeatFlow(),
    SignalTemperature(),
    TemperatureSensor(),
    ThermalConductor(G=1.5),
)
