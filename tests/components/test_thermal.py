"""Heat conduction against closed forms."""

import jax.numpy as jnp
import numpy as np
import pytest

from acausal import Component, Connections, connect, simulate
from components.thermal import (
    ConstantHeatFlow,
    FixedTemperature,
    HeatCapacitor,
    HeatFlowSensor,
    TemperatureSensor,
    ThermalConductor,
)


class TwoBodies(Component):
    """Two bodies that exchange heat; a third one, heated, that loses heat to the surroundings."""

    warm: HeatCapacitor
    conductor: ThermalConductor
    cold: HeatCapacitor
    heater: ConstantHeatFlow
    body: HeatCapacitor
    loss: ThermalConductor
    ambient: FixedTemperature
    sensor: HeatFlowSensor = HeatFlowSensor()
    thermometer: TemperatureSensor = TemperatureSensor()

    def connections(self) -> Connections:
        return (
            connect(self.warm.port, self.conductor.a),
            connect(self.conductor.b, self.sensor.a),
            connect(self.sensor.b, self.cold.port, self.thermometer.port),
            connect(self.heater.port, self.body.port, self.loss.a),
            connect(self.loss.b, self.ambient.port),
        )


@pytest.mark.thorough
def test_exchange_and_heating() -> None:
    C1, C2, G, C, loss = 15.0, 30.0, 10.0, 20.0, 4.0
    rig = TwoBodies(
        warm=HeatCapacitor(C=C1, T=373.15),
        conductor=ThermalConductor(G=G),
        cold=HeatCapacitor(C=C2, T=273.15),
        heater=ConstantHeatFlow(heat_flow=100.0),
        body=HeatCapacitor(C=C, T=300.0),
        loss=ThermalConductor(G=loss),
        ambient=FixedTemperature(temperature=300.0),
    )
    times = np.linspace(0.0, 5.0, 6)
    sol = simulate(rig, 5.0, save=jnp.asarray(times), rtol=1e-9)
    mean = (C1 * 373.15 + C2 * 273.15) / (C1 + C2)
    decay = np.exp(-G * (1.0 / C1 + 1.0 / C2) * times)
    np.testing.assert_allclose(sol["thermometer.y.value"], mean + (273.15 - mean) * decay, rtol=1e-9)
    np.testing.assert_allclose(sol["sensor.y.value"], G * 100.0 * decay, rtol=1e-6)
    np.testing.assert_allclose(sol["body.T"], 300.0 + 100.0 / loss * (1.0 - np.exp(-loss / C * times)), rtol=1e-9)
