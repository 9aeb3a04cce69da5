"""Errors of impossible hydraulic circuits name the place and a remedy."""

import jax.numpy as jnp
import pytest

from acausal import Component, Connections, SimulationError, StructureError, check, connect, simulate
from components.hydraulic import (
    BypassCompensator,
    Chamber,
    CheckValve,
    ConstantFlow,
    ConstantPressure,
    Filter,
    FixedPump,
    GasAccumulator,
    IdealCheckValve,
    LaminarResistance,
    LinearLiquid,
    ReliefValve,
    Tank,
    WilsonLosses,
    iso_vg_46,
)
from components.rotational import ConstantSpeed

LIQUID = LinearLiquid(density=860.0, bulk_modulus=1.4e9)


class Blocked(Component):
    """A flow into a check valve that nothing opens before the pressure has risen."""

    flow: ConstantFlow
    valve: IdealCheckValve
    chamber: Chamber | None = None
    tank: Tank = Tank()

    def connections(self) -> Connections:
        chambers = () if self.chamber is None else (self.chamber.port,)
        return (connect(self.flow.port, self.valve.a, *chambers), connect(self.valve.b, self.tank.port))


@pytest.mark.thorough
def test_flow_into_a_node_without_volume() -> None:
    """The error names the node and the missing volume; with it, the circuit settles at cracking + flow/conductance."""
    flow, valve = ConstantFlow(flow=1e-5), IdealCheckValve(conductance=1e-9)
    with pytest.raises(SimulationError, match=r"flow into flow\.port and valve\.a: .*connect a Chamber or a Volume"):
        simulate(Blocked(flow=flow, valve=valve), 1.0, save="end")
    rig = Blocked(flow=flow, valve=valve, chamber=Chamber(volume=1e-4, liquid=LIQUID))
    assert float(simulate(rig, 1.0, save="end").final.valve.dp) == pytest.approx(2e4 + 1e4, rel=1e-6)


class Relieved(Component):
    """A flow whose only path is a relief valve."""

    flow: ConstantFlow
    relief: ReliefValve
    tank: Tank = Tank()

    def connections(self) -> Connections:
        return (connect(self.flow.port, self.relief.a), connect(self.relief.b, self.tank.port))


@pytest.mark.thorough
@pytest.mark.parametrize("flow", [1e-6, 1e-2])
def test_flow_that_a_relief_valve_has_to_let_pass(flow: float) -> None:
    """From a start with a closed valve, the pressure that opens it is found: cracking + flow/conductance, apart from
    leakage.
    """
    relief = ReliefValve(conductance=1e-9, cracking_pressure=1.5e7)
    sol = simulate(Relieved(flow=ConstantFlow(flow=flow), relief=relief), 1.0, save="end")
    dp = float(sol.final.relief.dp)
    opened = flow / 1e-9 - 1e-6 * dp
    rounded = opened if flow > 1e-4 else 1e4 * float(jnp.log(jnp.expm1(opened / 1e4)))
    assert dp == pytest.approx(1.5e7 + rounded, rel=1e-9)


class Drained(Component):
    """A chamber from which a constant flow is drawn at any pressure."""

    flow: ConstantFlow
    chamber: Chamber

    def connections(self) -> Connections:
        return (connect(self.flow.port, self.chamber.port),)


@pytest.mark.thorough
def test_a_chamber_that_is_drawn_empty() -> None:
    """It is empty after 1e-4 m3/1e-6 m3/s, within a step."""
    rig = Drained(flow=ConstantFlow(flow=-1e-6), chamber=Chamber(volume=1e-4, liquid=iso_vg_46()))
    with pytest.raises(SimulationError, match=r"chamber\.compression .*only vapour is left in the volume") as raised:
        simulate(rig, 200.0, save="end")
    assert float(str(raised.value).split()[3]) == pytest.approx(100.0, rel=1e-2)


def test_a_filter_without_a_circuit() -> None:
    """The flow only circulates, so the pressure is undetermined."""
    alone = Filter(element=LaminarResistance(resistance=1e8), bypass=CheckValve(conductance=1e-9))
    assert "connect a Tank to it" in str(check(alone))


class Sucking(Component):
    """A lossless pump that empties a chamber."""

    drive: ConstantSpeed
    pump: FixedPump
    chamber: Chamber
    tank: Tank = Tank()

    def connections(self) -> Connections:
        return (
            connect(self.drive.flange, self.pump.shaft),
            connect(self.chamber.port, self.pump.a),
            connect(self.pump.b, self.tank.port),
        )


@pytest.mark.thorough
def test_a_pump_that_runs_dry() -> None:
    """The delivery decays as exp(-D w t/V) while the pressure stays near the vapour pressure."""
    oil = iso_vg_46()
    rig = Sucking(
        drive=ConstantSpeed(speed=100.0),
        pump=FixedPump(displacement=2e-6, liquid=oil, losses=WilsonLosses()),
        chamber=Chamber(volume=1e-4, liquid=oil),
    )
    p = float(simulate(rig, 10.0, save="end", rtol=1e-9).final.chamber.p)
    # Its error is that of the pressure, 1e-9 of an atmosphere, over the pascal in which the density falls to 1/e.
    assert float(jnp.log(oil.relative_density(p))) == pytest.approx(-20.0, abs=1e-3)
    assert -50.0 < p - (float(oil.vapour_pressure) - 101325.0) < 0.0


class Sensed(Component):
    """A valve that senses a pressure at a port."""

    flow: ConstantFlow
    chamber: Chamber
    valve: BypassCompensator
    tank: Tank = Tank()

    def connections(self) -> Connections:
        return (
            connect(self.flow.port, self.chamber.port, self.valve.a),
            connect(self.valve.b, self.tank.port),
        )


def test_a_sensing_line_that_is_forgotten() -> None:
    rig = Sensed(
        flow=ConstantFlow(flow=1e-5),
        chamber=Chamber(volume=1e-4, liquid=LIQUID),
        valve=BypassCompensator(rated_flow=1e-3, rated_drop=1e6, band=1e5, margin=1e6),
    )
    with pytest.raises(StructureError, match=r"the flow is zero at valve\.load, .*Remedy: connect it"):
        simulate(rig, 1.0)


class Charged(Component):
    """An accumulator at a pressure."""

    supply: ConstantPressure
    accumulator: GasAccumulator

    def connections(self) -> Connections:
        return (connect(self.supply.port, self.accumulator.port),)


@pytest.mark.parametrize(
    ("V", "end"),
    [(-1e-5, 0.0), (4.5e-4, 0.0), (5.5e-4, 0.0), (1e-4, -1.0), (0.0, 1.0)],
    ids=["below empty", "above full", "no gas left", "not empty", "not full"],
)
def test_accumulators_start_where_they_can_be(V: float, end: float) -> None:
    accumulator = GasAccumulator(capacity=4e-4, resistance=1e9, volume=5e-4, precharge=6e6, V=V, end=end)
    with pytest.raises(SimulationError, match=r"accumulator\.beyond: V must be 0 if end is -1, equal to capacity if"):
        simulate(Charged(supply=ConstantPressure(pressure=7e6), accumulator=accumulator), 0.1, save="end")
