"""Electro-hydrostatic actuators: a pump between the chambers of a cylinder, in a closed circuit."""

import jax.numpy as jnp
import numpy as np
from _rig import Part, Rig

from acausal import Connections, connect, simulate
from components.blocks import Sine, Step
from components.hydraulic import (
    ConstantPressure,
    DoubleActingCylinder,
    IdealCheckValve,
    LaminarResistance,
    LinearLiquid,
    Pump,
)
from components.rotational import SignalSpeed
from components.translational import Damper, Fixed, Mass, SignalForce, Spring

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


def test_check_valves_of_a_closed_circuit() -> None:
    """Of finite conductance, against Radau and LSODA; and, from there and ten times it, of ideal ones, by events."""
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
