"""A tandem cylinder, a holding valve and a current control against closed forms."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _rig import Part, Rig
from scipy.integrate import solve_ivp

from acausal import Component, Connections, ParameterError, connect, linearise, replace, simulate
from acausal.testing import check_law
from components import catalogues
from components.blocks import Ramp, Step
from components.electrical import ConstantVoltage, CurrentControlledBridge, Ground, Inductor, Resistor, SignalVoltage
from components.hydraulic import (
    ConstantPressure,
    DoubleActingCylinder,
    HoldingValve,
    LinearLiquid,
    TandemCylinder,
    Tank,
)
from components.translational import Fixed, Mass, Spring

OIL = LinearLiquid(density=860.0, bulk_modulus=1.4e9)
REAR = DoubleActingCylinder(bore=0.04, rod=0.025, stroke=0.1, liquid=OIL, dead_a=2e-5, dead_b=2e-5)
FRONT = DoubleActingCylinder(bore=0.04, rod=0.025, rod_a=0.025, stroke=0.1, liquid=OIL, dead_a=2e-5, dead_b=3e-5)


class Held(Component):
    """A tandem cylinder with its ports shut, a mass and a spring."""

    cylinder: TandemCylinder
    mass: Mass
    spring: Spring
    wall: Fixed = Fixed()

    def connections(self) -> Connections:
        return (
            connect(self.cylinder.flange, self.mass.a, self.spring.b),
            connect(self.wall.flange, self.spring.a),
        )


@pytest.mark.thorough
def test_tandem_cylinder_adds_forces_and_stiffness() -> None:
    """The force of four areas; with its ports shut it swings at sqrt((c + sum of K A^2/V)/m), at any stroke."""
    tandem, full, ring = TandemCylinder(rear=REAR, front=FRONT), np.pi * 4e-4, np.pi * (4e-4 - 0.25 * 0.025**2)
    pressures = {"rear.p_a": 1e7, "rear.p_b": 1e6, "front.p_a": 8e6, "front.p_b": 2e6}
    given: dict[str, Any] = {"flange.s": 0.02, "rear.v": 0.0} | pressures
    check_law(tandem, given, {"flange.f": -(1e7 * full - 1e6 * ring + 8e6 * ring - 2e6 * ring)}, rtol=1e-9)
    held = Held(cylinder=tandem, mass=Mass(m=5.0), spring=Spring(c=1e4))
    for s in (0.01, 0.07):
        chambers = [(full, 2e-5 + full * s), (ring, 2e-5 + ring * (0.1 - s))]
        chambers += [(ring, 2e-5 + ring * s), (ring, 3e-5 + ring * (0.1 - s))]
        expected = np.sqrt((1e4 + sum(1.4e9 * area**2 / volume for area, volume in chambers)) / 5.0)
        poles = linearise(replace(held, {"cylinder.flange.s": s, "spring.s_rel0": s})).poles
        np.testing.assert_allclose(np.max(np.abs(np.imag(poles))), expected, rtol=1e-7)


@pytest.mark.parametrize(
    ("front", "text"),
    [
        (dict(rod_a=0.02, stroke=0.1), r"front\.rod_a must equal rear\.rod"),
        (dict(rod_a=0.025, stroke=0.2), r"front\.stroke must equal rear\.stroke"),
    ],
)
def test_tandem_cylinders_that_do_not_fit(front: dict[str, Any], text: str) -> None:
    given: dict[str, Any] = dict(bore=0.04, rod=0.025, liquid=OIL, dead_a=2e-5, dead_b=3e-5)
    with pytest.raises(ParameterError, match=rf"^TandemCylinder\.{text}"):
        TandemCylinder(rear=REAR, front=DoubleActingCylinder(**given, **front))


G0, GAP, STROKE, PRELOAD, SPRING, SEAT = 1e-3, 1e-4, 1.5e-3, 4.0, 4e3, 1.2e-6
UNSTATED: dict[str, Any] = dict(
    flow=20.0 / 60e3, drop=5e5, g0=G0, m=0.02, spring=SPRING, preload=PRELOAD, stroke=STROKE, seat=SEAT, density=860.0,
    residual_gap=GAP, damping=5.0,
)  # fmt: skip


def coiled(supply: Part, ramp: Part, valve: Part, source: Part, tank: Part, ground: Part) -> Connections:
    return (
        connect(ramp.y, supply.u),
        connect(supply.p, valve.p),
        connect(supply.n, valve.n, ground.p),
        connect(source.port, valve.a),
        connect(valve.b, tank.port),
    )


def held_by(valve: HoldingValve, voltage: float, pressure: float, slope: float) -> Any:
    """The valve, its voltage falling or rising slowly."""
    parts = (
        SignalVoltage(), Ramp(offset=voltage, height=slope * 4.0, duration=4.0), valve,
        ConstantPressure(pressure=pressure), Tank(), Ground(),
    )  # fmt: skip
    return Rig(parts=parts, wiring=coiled)


@pytest.mark.thorough
def test_holding_valve_of_the_catalogue() -> None:
    """From the rating, 12 V, 1.62 A, 350 bar: it pulls 1.2 times what it must; seats, lets go by closed forms."""
    valve = catalogues.holding_valve("CEBP 040 NAFN", **UNSTATED)
    R, L0 = float(valve.coil.R), float(valve.coil.L0)
    assert pytest.approx(12.0 / 1.62, rel=1e-12) == R
    assert valve.data_sheet is not None
    at_seat = PRELOAD + SPRING * STROKE
    pull = 0.5 * 1.62**2 * L0 / G0 / (1.0 + GAP / G0) ** 2
    assert pull == pytest.approx(1.2 * (at_seat + SEAT * 3.5e7), rel=1e-9)
    open_flow = {"plunger.a.s": 0.0, "plunger.v": 0.0, "a.p": 5e5, "b.p": 0.0, "p.v": 0.0, "n.v": 0.0, "coil.Psi": 0.0}
    check_law(valve, open_flow, {"poppet.q": 20.0 / 60e3}, rtol=1e-6)

    # A voltage that rises slowly, no pressure: it moves off as the pull exceeds the preload.
    rising = simulate(held_by(valve, 0.0, 0.0, 2.0), 4.0, save="steps")
    i, s = np.asarray(rising.parts[2].coil.i), np.asarray(rising.parts[2].plunger.a.s)
    assert s[-1] == pytest.approx(STROKE, abs=1e-7)
    seats = np.sqrt(2.0 * PRELOAD * G0 / L0) * (1.0 + (GAP + STROKE) / G0)
    assert i[s > 1e-6][0] == pytest.approx(seats, rel=2e-2)

    # Held at 350 bar with a voltage that falls: it lets go at the current of the closed gap, as far as its jet lets it.
    held = replace(
        held_by(valve, 12.0, 3.5e7, -2.0),
        {"parts[2].plunger.a.s": STROKE, "parts[2].coil.Psi": 1.62 * L0 / (1.0 + GAP / G0)},
    )
    falling = simulate(held, 4.0, save="steps", nominal={"parts[2].plunger.v": 1e-3})
    i, s = np.asarray(falling.parts[2].coil.i), np.asarray(falling.parts[2].plunger.a.s)
    lets_go = 1.62 / np.sqrt(1.2)
    assert i[s < STROKE - 1e-6][0] == pytest.approx(lets_go, rel=2e-2)
    assert np.all(s[i > 1.02 * lets_go] > STROKE - 1e-6)
    found = {one.rating for one in catalogues.limits(falling)}
    assert found <= {"nominal_current"}


def test_holding_valves_ask_for_what_their_sheet_does_not_state() -> None:
    with pytest.raises(ParameterError, match=r"valves\.csv, CEBP 040 NAFN: flow is not stated\. Give it: flow=\.\.\."):
        catalogues.holding_valve("CEBP 040 NAFN", **{k: v for k, v in UNSTATED.items() if k != "flow"})


R, L, W, V = 0.5, 2e-3, 1000.0, 24.0


def driven(supply: Part, signal: Part, bridge: Part, coil: Part, wire: Part, ground: Part) -> Connections:
    return (
        connect(supply.p, bridge.p1),
        connect(supply.n, bridge.n1, bridge.n2, ground.p),
        connect(bridge.p2, coil.p),
        connect(coil.n, wire.p),
        connect(wire.n, ground.p),
        connect(signal.y, bridge.u),
    )


def controlled(height: Any, i_max: float = 100.0) -> Rig:
    bridge = CurrentControlledBridge.for_load(R=R, L=L, bandwidth=W, V=V, i_max=i_max)
    parts = (ConstantVoltage(V=V), Step(height=height, start_time=1e-3), bridge, Inductor(L=L), Resistor(R=R), Ground())
    return Rig(parts=parts, wiring=driven)


@pytest.mark.thorough
def test_current_control() -> None:
    """Within its voltage i = I (1 - exp(-w t)); beyond, as another program integrates the limited loop; no windup."""
    times = jnp.linspace(2e-3, 12e-3, 6)
    small = simulate(controlled(5.0), 12e-3, save=times, rtol=1e-9, energy=True)
    np.testing.assert_allclose(small["parts[3].i"], 5.0 * (1.0 - np.exp(-W * (times - 1e-3))), rtol=1e-6)
    assert abs(float(small.energy.imbalance)) < 1e-8 * float(small.energy.totals[0])

    k, Ti = W * L, L / R

    def loop(t: float, y: Any) -> Any:
        del t
        e = 40.0 - y[0]
        free = (k * e + y[1]) / V
        m = np.clip(free, -1.0, 1.0)
        return [(m * V - R * y[0]) / L, (k * e + V * (m - free) / 0.9) / Ti]

    other = solve_ivp(loop, (1e-3, 12e-3), [0.0, 0.0], method="Radau", t_eval=np.asarray(times), rtol=1e-10, atol=1e-10)
    big = simulate(controlled(40.0), 12e-3, save=times, rtol=1e-9)
    np.testing.assert_allclose(big["parts[3].i"], other.y[0], rtol=1e-5)
    bounded = simulate(controlled(40.0, i_max=6.0), 20e-3, save="steps")
    assert float(bounded.final.parts[3].i) == pytest.approx(6.0, rel=1e-4)
    assert float(np.max(bounded["parts[3].i"])) < 6.0 * (1.0 + 1e-4)


@pytest.mark.slow
def test_current_control_is_differentiated() -> None:
    def reached(height: jax.Array) -> jax.Array:
        return jnp.asarray(simulate(controlled(height), 4e-3, save="end", rtol=1e-9).final.parts[3].i)

    here = jnp.asarray(5.0)
    forward, reverse = jax.jacfwd(reached)(here), jax.grad(reached)(here)
    np.testing.assert_allclose([forward, reverse], 1.0 - np.exp(-3.0), rtol=1e-6)
