"""A tank with ports at heights, against Torricelli, and a batch plant."""

from typing import Any

import numpy as np
import pytest
from _rig import Rig

from acausal import Component, Connections, ParameterError, SimulationError, connect, simulate
from components.blocks import Pulse
from components.hydraulic import ConstantFlow, LaminarResistance, OnOffValve, Orifice, Tank, Vessel, fill, water
from components.thermal import FixedTemperature, HeatPort

WATER: dict[str, Any] = dict(area=0.1, density=1000.0, height=1.0)


def drained(vessel: Any, low: Any, high: Any, sump: Any) -> Connections:
    return (
        connect(vessel.ports[0], low.a),
        connect(vessel.ports[1], high.a),
        connect(low.b, high.b, sump.port),
    )


def test_a_vessel_drains_through_two_holes_until_the_upper_one_is_dry() -> None:
    """dh/dt = -k (sqrt(h) + sqrt(h - a)) has the integral 2/(3 a) [h^1.5 - (h - a)^1.5] + k t; below a, sqrt(h) falls
    linearly (Torricelli).
    """
    hole: dict[str, Any] = dict(area=1e-4, density=1000.0, transition_pressure=0.1)
    parts = (Vessel(heights=[0.0, 0.5], h=0.9, **WATER), Orifice(**hole), Orifice(**hole), Tank())
    solution = simulate(Rig(parts=parts, wiring=drained), 450.0, energy=True, rtol=1e-8, save=np.linspace(0, 450, 91))
    h, t = np.asarray(solution["parts[0].h"]), np.asarray(solution.ts)
    k, a = 0.61 * 1e-4 * np.sqrt(2.0 * 9.80665) / 0.1, 0.5
    is_high, is_low = h > 0.51, h < 0.49
    integral = 2.0 / (3.0 * a) * (h[is_high] ** 1.5 - (h[is_high] - a) ** 1.5)
    np.testing.assert_allclose(np.diff(integral) / np.diff(t[is_high]), -k, rtol=1e-4)
    np.testing.assert_allclose(np.diff(np.sqrt(h[is_low])) / np.diff(t[is_low]), -0.5 * k, rtol=1e-4)
    assert abs(solution.energy.imbalance) < 1e-6 * 0.5 * 1000.0 * 9.80665 * 0.1 * 0.9**2


class BatchPlant(Component):
    """Two sources of hot and cold water fill a vessel, which overflows, and a valve at the bottom empties it."""

    hot: ConstantFlow
    boiler: FixedTemperature
    cold: ConstantFlow
    vessel: Vessel
    spill: LaminarResistance
    valve: OnOffValve
    schedule: Pulse
    sump: Tank

    def connections(self) -> Connections:
        vessel, hot = self.vessel, self.hot
        source: Any = hot.heat
        return (
            connect(source, self.boiler.port),
            connect(hot.port, vessel.ports[2]),
            connect(self.cold.port, vessel.ports[3]),
            connect(vessel.ports[1], self.spill.a),
            connect(vessel.ports[0], self.valve.a),
            connect(self.schedule.y, self.valve.u),
            connect(self.spill.b, self.valve.b, self.sump.port),
        )


@pytest.mark.thorough
def test_a_batch_is_filled_mixed_spilled_and_emptied() -> None:
    """One volume of hot and two of cold water: a third of the difference of temperature; then the vessel spills."""
    plant = BatchPlant(
        hot=ConstantFlow(flow=1e-4, heat=HeatPort()),
        boiler=FixedTemperature(temperature=353.15),
        cold=ConstantFlow(flow=2e-4),
        vessel=Vessel(heights=[0.0, 0.8, 0.9, 0.9], h=0.0, **WATER),
        spill=LaminarResistance(resistance=1e5),
        valve=OnOffValve(area=2e-3, density=1000.0),
        schedule=Pulse(amplitude=1.0, period=2000.0, width=0.025, start_time=500.0),
        sump=Tank(),
    )
    times = np.array([100.0, 450.0, 540.0])
    solution = simulate(fill(plant, water(temperature=293.15, carries_heat=True)), 540.0, save=times, energy=True)
    level, spilled = solution["vessel.h"], -solution["vessel.ports[1].q"]
    np.testing.assert_allclose(level[0], 0.3, rtol=1e-6)
    np.testing.assert_allclose(level[1], 0.8 + 1e5 * 3e-4 / (1000.0 * 9.80665), rtol=1e-6)
    np.testing.assert_allclose(spilled[1], 3e-4, rtol=1e-4)
    assert level[2] < 0.5
    np.testing.assert_allclose(solution["vessel.heat.T"][1], 293.15 + 60.0 / 3.0, atol=0.1)
    assert abs(solution.energy.imbalance) < 1e-6 * 20.0 * 4.18e6 * 0.08


def test_a_vessel_that_cannot_work_is_refused() -> None:
    with pytest.raises(ParameterError, match="heights must be at most height"):
        Vessel(heights=[1.1], **WATER)
    with pytest.raises(ParameterError, match="one height for each port"):
        Vessel(heights=0.5, **WATER)
    with pytest.raises(ParameterError, match="one height for each port"):
        Vessel(heights=[], **WATER)
    with pytest.raises(SimulationError, match=r"ports\[0\] is above the surface and draws gas"):
        simulate(Rig(parts=(Vessel(heights=[0.5], h=0.2, **WATER), ConstantFlow(flow=-1e-5)), wiring=pumped), 1.0)
    with pytest.raises(SimulationError, match="the tank overflows: add a port for the overflow"):
        simulate(Rig(parts=(Vessel(heights=[0.5], h=0.995, **WATER), ConstantFlow(flow=1e-3)), wiring=pumped), 1.0)


def pumped(vessel: Any, pump: Any) -> Connections:
    return (connect(vessel.ports[0], pump.port),)
