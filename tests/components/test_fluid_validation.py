"""Textbook results of small circuits: natural frequency, speeds, filling; compile time of a long line."""

import time
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _rig import Part, Rig

from acausal import Connections, connect, linearise, replace, simulate
from components.blocks import Constant
from components.hydraulic import (
    Chamber,
    ConstantFlow,
    ConstantPressure,
    DoubleActingCylinder,
    FourWayValve,
    LaminarResistance,
    LinearLiquid,
    Orifice,
    Pipe,
)
from components.translational import ConstantForce, Fixed, Flange, Mass, Spring

LIQUID = LinearLiquid(density=860.0, bulk_modulus=1.4e9, viscosity=1e-9)
AREA_A, AREA_B = np.pi / 4.0 * 0.04**2, np.pi / 4.0 * (0.04**2 - 0.025**2)


def cylinder(**start: Any) -> DoubleActingCylinder:
    return DoubleActingCylinder(bore=0.04, rod=0.025, stroke=0.3, liquid=LIQUID, dead_a=2e-5, dead_b=2e-5, **start)


def _held(cylinder: Part, mass: Part, spring: Part, wall: Part) -> Connections:
    return connect(cylinder.flange, mass.a, spring.b), connect(spring.a, wall.flange)


@pytest.mark.thorough
def test_natural_frequency_of_a_differential_cylinder() -> None:
    """sqrt((K (A_a^2/V_a + A_b^2/V_b) + c)/m) with the valve shut: at the ends, in the middle, and where it is least,
    V_b/V_a = (A_b/A_a)^1.5 (Merritt, `Hydraulic Control Systems`, ch. 6); figures of an independent program.
    """
    figures = {0.0: 1192.853384358, 0.15: 456.8337783035, 0.3: 763.3920938943, 0.1761705859268: 451.5738416651}
    for s, wanted in figures.items():
        parts = (cylinder(), Mass(m=80.0, v=0.0, a=Flange(s=s)), Spring(c=5000.0, s_rel0=s), Fixed())
        found = np.linalg.eigvals(np.asarray(linearise(Rig(parts=parts, wiring=_held)).A))
        assert np.max(np.abs(found.imag)) == pytest.approx(wanted, rel=1e-8)


def _moved(
    signal: Part, valve: Part, supply: Part, back: Part, cylinder: Part, mass: Part, load: Part
) -> Connections:  # fmt: skip
    return (
        connect(signal.y, valve.u),
        connect(supply.port, valve.p),
        connect(back.port, valve.t),
        connect(valve.a, cylinder.a),
        connect(valve.b, cylinder.b),
        connect(cylinder.flange, mass.a, load.flange),
    )


@pytest.mark.thorough
@pytest.mark.parametrize(("u", "s", "speed"), [(1.0, 0.02, 0.593569792689), (-1.0, 0.28, -0.4218782689526)])
def test_speed_of_a_cylinder_behind_an_open_valve(u: float, s: float, speed: float) -> None:
    """K sqrt((p_s A_a - p_t A_b - F)/(A_a^3 + A_b^3)) out, and with the areas changed over in, against 3 kN."""
    parts = (
        Constant(k=u),
        FourWayValve(rated_flow=5e-4, rated_drop=3.5e6, transition_pressure=1.0),
        ConstantPressure(pressure=12e6),
        ConstantPressure(pressure=1e5),
        cylinder(p_a=4e6, p_b=4e6),
        Mass(m=5.0, v=speed, a=Flange(s=s)),
        ConstantForce(force=-3e3 * u),
    )
    end = simulate(Rig(parts=parts, wiring=_moved), 0.4, save="end", rtol=1e-8).final
    assert float(end.parts[5].v) == pytest.approx(speed, rel=1e-4)


def _regenerative(flow: Part, cylinder: Part, mass: Part) -> Connections:
    return connect(flow.port, cylinder.a, cylinder.b), connect(cylinder.flange, mass.a)


@pytest.mark.thorough
def test_regenerative_circuit() -> None:
    """Both chambers on the pump's line: the rod's area alone is filled, v = Q/(A_a - A_b), and the rest goes round."""
    parts = (ConstantFlow(flow=3e-4), cylinder(leakage=1e-11), Mass(m=5.0, v=0.6111549814729, a=Flange(s=0.02)))
    end = simulate(Rig(parts=parts, wiring=_regenerative), 0.01, save="end", rtol=1e-9).final
    assert float(end.parts[2].v) == pytest.approx(3e-4 / (AREA_A - AREA_B), rel=1e-9)
    assert float(end.parts[1].a.q) == pytest.approx(0.000768, rel=1e-9)


def _filled(supply: Part, way: Part, volume: Part) -> Connections:
    return connect(supply.port, way.a), connect(way.b, volume.port)


@pytest.mark.thorough
def test_filling_a_volume() -> None:
    """Through a laminar resistance with tau = V/(K G); through a sharp edge along a parabola, in a finite time."""
    laminar = ([0.07142857142857, 0.3571428571429, 1.428571428571], [1894565.544528, 6357993.532403, 9818675.175002])
    sharp = ([0.01528002096318, 0.07640010481592, 0.1375201886687], [1981000.0, 7525000.0, 9901000.0])
    edge = Orifice(area=1e-6, density=860.0, transition_pressure=1e-2)
    for way, (times, wanted) in ((LaminarResistance(resistance=5e11), laminar), (edge, sharp)):
        parts = (ConstantPressure(pressure=1e7), way, Chamber(volume=1e-3, liquid=LIQUID, p=1e5))
        sol = simulate(Rig(parts=parts, wiring=_filled), times[-1], save=jnp.asarray(times), rtol=1e-9)
        np.testing.assert_allclose(sol["parts[2].p"], wanted, rtol=1e-6)


def _line(supply: Part, line: Part, end: Part) -> Connections:
    return connect(supply.port, line.a), connect(line.b, end.port)


@pytest.mark.slow
def test_a_line_of_200_segments_compiles_as_fast_as_one_of_5(without_jax_cache: None) -> None:
    """Its run and its gradient, within 1.5 times."""

    def seconds(n: int) -> float:
        line = Pipe(n=n, length=10.0, diameter=0.01, liquid=LIQUID)
        rig = Rig(parts=(ConstantPressure(pressure=1e6), line, Chamber(volume=1e-4, liquid=LIQUID)), wiring=_line)

        def end(length: jax.Array) -> jax.Array:
            changed = replace(rig, {"parts[1].length": length})
            return jnp.asarray(simulate(changed, 0.01, save="end").final.parts[1].p_b)

        start = time.process_time()
        jax.jit(jax.value_and_grad(end)).lower(jnp.asarray(10.0)).compile()
        return time.process_time() - start

    seconds(3)  # what is compiled once for all
    short, long = seconds(5), seconds(200)
    assert long < 1.5 * short, (short, long)
