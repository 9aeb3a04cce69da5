"""Electro-hydrostatic actuators: a pump between the chambers of a cylinder, in a closed circuit."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _rig import Part, Rig

from acausal import Component, Connections, connect, replace, simulate
from components.blocks import Sine, Step
from components.hydraulic import (
    ConstantPressure,
    DoubleActingCylinder,
    FixedPump,
    GasAccumulator,
    HydraulicCylinder,
    IdealCheckValve,
    LaminarResistance,
    LinearLiquid,
    PilotCheckValve,
    Pump,
    ReliefValve,
    WilsonLosses,
    iso_vg_46,
)
from components.rotational import SignalSpeed
from components.translational import Damper, Fixed, Flange, Mass, SignalForce, Spring

LIQUID = LinearLiquid(density=860.0, bulk_modulus=1.2e9, viscosity=3e-5)
AREA, RADIUS = 8e-4, 0.005


def _published(
    speed: Part, drive: Part, pump: Part, cylinder: Part, mass: Part, spring: Part, damper: Part, wall: Part,
    force: Part, load: Part, bias: Part, checks: Part, leaks: Part,
) -> Connections:  # fmt: skip
    return (
        connect(speed.y, drive.u),
        connect(drive.flange, pump.shaft),
        connect(pump.b, cylinder.a, checks[0].b, leaks[0].b),
        connect(pump.a, cylinder.b, checks[1].b, leaks[1].b),
        connect(bias.port, checks[0].a, checks[1].a, leaks[0].a, leaks[1].a),
        connect(cylinder.flange, mass.a, spring.b, damper.b, load.flange),
        connect(wall.flange, spring.a, damper.a),
        connect(force.y, load.u),
    )


def published(conductance: float) -> Rig:
    """The actuator of the figures, whose check valves pass conductance times their pressure drop."""
    rod = 2.0 * RADIUS
    bore = float(np.sqrt(rod**2 + 4.0 * AREA / np.pi))
    cylinder = DoubleActingCylinder(
        bore=bore, rod=rod, rod_a=rod, stroke=0.1, liquid=LIQUID, dead_a=1e-4, dead_b=1e-4 - 0.1 * AREA,
        p_a=1.5e6, p_b=1.5e6,
    )  # fmt: skip
    check = IdealCheckValve(conductance=conductance, cracking_pressure=0.0)
    parts = (
        Sine(amplitude=300.0, frequency=1.0),
        SignalSpeed(),
        Pump(displacement=2e-7, leakage=2e-12),
        cylinder,
        Mass(m=60.0, v=0.0),
        Spring(c=2e4),
        Damper(d=800.0),
        Fixed(),
        Step(height=-2500.0, start_time=0.5),
        SignalForce(),
        ConstantPressure(pressure=1.5e6),
        (check, check),
        (LaminarResistance(resistance=1e12),) * 2,
    )
    return Rig(parts=parts, wiring=_published)


TIMES = np.array([0.01, 0.02, 0.1, 0.5, 0.51, 0.52, 0.55, 0.6, 0.9, 1.5])
SIZES = {"parts[4].a.s": 0.03, "parts[4].v": 0.15, "parts[3].p_a": 6e6, "parts[3].p_b": 6e5}


@pytest.mark.thorough
def test_check_valves_of_a_closed_circuit() -> None:
    """Smooth valves against Radau and LSODA; ideal valves by events, with this conductance and ten times that."""
    found = [simulate(published(g), 1.5, save=jnp.asarray(TIMES), rtol=1e-9) for g in (1e-8, 1e-7)]
    finite = (
        [1.529341355839e-05, 8.497246388388e-05, 0.002238520527111, 0.02317896177246, 0.0223360141256,
         0.02225079428568, 0.0214733771315, 0.01914707900308, -0.003754496689663, 0.01067529920991],
        [0.004799692511244, 0.008844262264468, 0.04343406716985, -0.001970411572354, -0.01215386153727,
         -0.05928724543935, -0.02080023226756, -0.055563414882, -0.05526372926661, -0.01245335800355],
        [1565765.947405, 1558994.747986, 1627137.263752, 2042351.400026, 7620080.738799,
         6576180.851157, 5309722.89972, 5017258.304976, 4504358.032461, 4844063.40698],
        [1500916.478718, 1500136.010599, 1499973.45384, 1499950.851061, 1510902.970272,
         2097629.822256, 1818587.229338, 1499785.189267, 1499706.5726, 1499672.640956],
    )  # fmt: skip
    ideal = (
        [1.527866087428e-05, 8.49605487135e-05, 0.002238515805029, 0.02317892874847, 0.02233428747399,
         0.02224949407015, 0.02147265810875, 0.01914674958885, -0.00375511974489, 0.01067447436673],
        [0.004801649061139, 0.00884262891862, 0.04343236839858, -0.001970449979159, -0.01207109549067,
         -0.0594734893135, -0.0206633159519, -0.05555172891698, -0.05526413230888, -0.01245366930353],
        [1565895.726045, 1559097.29409, 1627149.571362, 2042399.698781, 7633185.214437,
         6585545.951598, 5312012.226919, 5015891.083283, 4504640.405969, 4844369.857779],
        [1500928.367124, 1500159.054148, 1500000.0, 1500000.0, 1511176.095046,
         2101048.162989, 1823746.208008, 1500000.0, 1500000.0, 1500000.0],
    )  # fmt: skip
    for (name, size), of_finite, of_ideal in zip(SIZES.items(), finite, ideal, strict=True):
        once, tenfold = (np.asarray(sol[name]) for sol in found)
        np.testing.assert_allclose(once, of_finite, atol=1e-6 * size, err_msg=name)
        np.testing.assert_allclose((10.0 * tenfold - once) / 9.0, of_ideal, atol=1e-5 * size, err_msg=name)


class Actuator(Component):
    """A pump at a given speed between the chambers of a cylinder; what these take or leave over, an accumulator gives
    through pilot-operated check valves.
    """

    speed: Sine
    drive: SignalSpeed
    pump: FixedPump
    accumulator: GasAccumulator
    check_a: PilotCheckValve
    check_b: PilotCheckValve
    relief_a: ReliefValve
    relief_b: ReliefValve
    cylinder: HydraulicCylinder
    load: Mass
    spring: Spring
    wall: Fixed

    def connections(self) -> Connections:
        return (
            connect(self.speed.y, self.drive.u),
            connect(self.drive.flange, self.pump.shaft),
            connect(self.pump.b, self.cylinder.a, self.check_a.b, self.check_b.pilot, self.relief_a.a),
            connect(self.pump.a, self.cylinder.b, self.check_b.b, self.check_a.pilot, self.relief_b.a),
            connect(self.accumulator.port, self.check_a.a, self.check_b.a, self.relief_a.b, self.relief_b.b),
            connect(self.cylinder.flange, self.load.a, self.spring.b),
            connect(self.wall.flange, self.spring.a),
        )


def actuator() -> Actuator:
    oil = iso_vg_46()
    chambers = DoubleActingCylinder(
        bore=0.04, rod=0.02, stroke=0.2, liquid=oil, dead_a=5e-5, dead_b=5e-5, p_a=2.3e6, p_b=1e6
    )
    check = PilotCheckValve(cracking=2e4, ratio=3.0, rated_flow=3e-4, rated_drop=2e5, band=1e5)
    relief = ReliefValve(conductance=1e-9, cracking_pressure=1.8e7)
    return Actuator(
        speed=Sine(amplitude=200.0, frequency=1.0),
        drive=SignalSpeed(),
        pump=FixedPump(displacement=0.4e-6, liquid=oil, losses=WilsonLosses(C_s=2e-9, C_v=1e5, C_f=0.02)),
        accumulator=GasAccumulator(capacity=2e-4, resistance=1e8, volume=3e-4, precharge=5e5, V=1.2e-4),
        check_a=check,
        check_b=check,
        relief_a=relief,
        relief_b=relief,
        cylinder=HydraulicCylinder(chambers=chambers, m=2.0, Fc=80.0, Fs=120.0, vs=0.02, C=300.0),
        load=Mass(m=60.0, v=0.0, a=Flange(s=0.05)),
        spring=Spring(c=2e4, s_rel0=-0.05),
        wall=Fixed(),
    )


@pytest.mark.slow
def test_hydrostatic_actuator() -> None:
    """With a differential and with a symmetric cylinder: both chambers stay under pressure, and energy is balanced."""
    for rod_a in (0.0, 0.02):
        model = replace(actuator(), {"cylinder.chambers.rod_a": rod_a})
        sol = simulate(model, 1.2, save="steps", energy=True)
        dissipated = float(sol.energy.totals[2])
        assert abs(float(sol.energy.imbalance)) < 1e-6 * dissipated
        for name in ("p_a", "p_b"):
            assert float(np.min(sol[f"cylinder.chambers.{name}"])) > 4e5
        # The oil's way: what the pump displaces in half a period, less slip and what compression takes.
        swept = 2.0 * 200.0 * 0.4e-6 / (2.0 * np.pi)
        lift = float(np.max(sol["load.a.s"])) - 0.05
        area = np.pi / 4.0 * (0.04**2 - 0.02**2)
        assert 0.9 * swept / (np.pi / 4.0 * 0.04**2) < lift < swept / area


@pytest.mark.slow
def test_gradients_of_the_hydrostatic_actuator() -> None:
    names, base = ("pump.displacement", "accumulator.V", "cylinder.chambers.bore"), jnp.array([0.4e-6, 1.2e-4, 0.04])
    model = actuator()

    def reached(scales: jax.Array, rtol: float = 1e-6) -> jax.Array:
        changed = replace(model, dict(zip(names, base * scales, strict=True)))
        return jnp.asarray(simulate(changed, 0.3, save="end", rtol=rtol).final.load.a.s)

    here, along = jnp.ones(3), jnp.array([1.0, 1.0, 0.1])
    forward = jax.jvp(reached, (here,), (along,))[1]
    h = 1e-4
    ahead, behind = (reached(here + sign * h * along, rtol=1e-9) for sign in (1.0, -1.0))
    assert float(forward) == pytest.approx(float(jax.grad(reached)(here) @ along), rel=1e-7)
    assert float(forward) == pytest.approx(float((ahead - behind) / (2.0 * h)), rel=1e-3)
