"""A relief valve and a load-sensing pump after a step, against published trajectories."""

from typing import Self

import jax.numpy as jnp
import numpy as np
import pytest
from _rig import Part, Rig

from acausal import Component, Connections, Equations, Param, Scalar, connect, eq, linearise, replace, simulate
from components.blocks import Step, Sum
from components.hydraulic import (
    Chamber,
    ConstantFlow,
    ConstantPressure,
    FluidPort,
    IdealCheckValve,
    LinearLiquid,
    LiquidOrifice,
    LoadSensingPump,
    PoppetValve,
    SignalPressure,
    Tank,
    WilsonLosses,
)
from components.rotational import ConstantSpeed
from components.translational import Damper, Fixed, Flange, Mass, Spring

LIQUID = LinearLiquid(density=860.0, bulk_modulus=1.4e9, viscosity=1e-9)
SEAT, WIDTH, MASS, RATE, PRELOAD, DAMPING = 4e-5, 0.0126, 0.05, 4e4, 400.0, 150.0
P_0, X_0 = 10295557.1856, 7.929482474517e-05  # at 6 l/min


class Displaced(Component):
    """Gives back what a poppet displaces as it lifts, which the published figures leave out."""

    seat: Param[Scalar, "m2"]
    rod: Flange = Flange()
    port: FluidPort = FluidPort()

    def equations(self, d: Self) -> Equations:
        return dict(no_force=eq(self.rod.f), flow=eq(self.port.q, -self.seat * d.rod.s))


def _relieved(
    flow: Part, chamber: Part, valve: Part, back: Part, mass: Part, spring: Part, damper: Part, wall: Part, *more: Part
) -> Connections:
    return (
        connect(flow.port, chamber.port, valve.a, *(part.port for part in more)),
        connect(valve.b, back.port),
        connect(valve.rod, mass.a, spring.b, damper.b, *(part.rod for part in more)),
        connect(wall.flange, spring.a, damper.a),
    )


def relief(*more: Component) -> Rig:
    """A direct-acting relief valve in equilibrium at 6 l/min, from the start on under 24 l/min."""
    parts = (
        ConstantFlow(flow=4e-4),
        Chamber(volume=5e-4, liquid=LIQUID, p=P_0),
        PoppetValve(seat=SEAT, width=WIDTH, stroke=1e-3, density=860.0, transition_pressure=1.0),
        ConstantPressure(pressure=1e5),
        Mass(m=MASS, v=0.0, a=Flange(s=X_0)),
        Spring(c=RATE, s_rel0=-PRELOAD / RATE),
        Damper(d=DAMPING),
        Fixed(),
    )
    return Rig(parts=(*parts, *more), wiring=_relieved)


@pytest.mark.thorough
def test_relief_valve_after_a_step() -> None:
    """Without the flow that the poppet displaces: lift, its speed and pressure, against DOP853 and Radau at 1e-12."""
    times = np.array([0.0005, 0.001, 0.002, 0.003, 0.008, 0.04])
    sol = simulate(relief(Displaced(seat=SEAT)), 0.04, save=jnp.asarray(times), rtol=1e-9)
    for name, wanted, size in (
        ("parts[4].a.s", [8.892304370003e-05, 1.336786637637e-04, 2.932214382597e-04, 4.088631881856e-04,
                         2.984193061624e-04, 3.084152254377e-04], 4e-4),
        ("parts[4].v", [0.05098206835022, 0.125486213666, 0.1627380491115, 0.05487432832668, 0.04600453290686,
                       1.176377326972e-05], 0.2),
        ("parts[1].p", [10709491.1103, 11072849.94907, 11413841.71211, 11198427.28486, 11029553.19524,
                       10886808.28663], 1.2e6),
    ):  # fmt: skip
        np.testing.assert_allclose(sol[name], wanted, atol=1e-6 * size)


@pytest.mark.thorough
def test_the_flow_that_a_poppet_displaces_damps_it() -> None:
    """Eigenvalues at 24 l/min without it, as published, and with it, by the equations linearised by hand."""
    x, p = 3.083655647744e-04, 10886707.09606
    published = [-2633.43288674, -209.2414321436 - 1025.129926354j, -209.2414321436 + 1025.129926354j]
    dp, k = p - 1e5, 0.65 * WIDTH * np.sqrt(2.0 / 860.0)
    jet = 2.0 * 0.65 * 0.98 * WIDTH * np.cos(1.2043)
    swing = [-(RATE + jet * dp) / MASS, -DAMPING / MASS, (SEAT - jet * x) / MASS]
    fill = -1.4e9 / 5e-4 * np.array([k * np.sqrt(dp), SEAT, 0.5 * k * x / np.sqrt(dp)])
    by_hand = np.linalg.eigvals(np.array([[0.0, 1.0, 0.0], swing, fill]))
    for more, wanted in (((Displaced(seat=SEAT),), published), ((), by_hand)):
        start = {"parts[4].a.s": x, "parts[1].p": p}
        found = np.linalg.eigvals(np.asarray(linearise(replace(relief(*more), start)).A))
        np.testing.assert_allclose(np.sort_complex(found), np.sort_complex(wanted), rtol=1e-6)
    assert np.max(by_hand.real) < 1.05 * np.max(np.real(published))


def _sensed(
    drive: Part, pump: Part, volume: Part, edge: Part, check: Part, load: Part, up: Part, down: Part, both: Part,
    tank: Part,
) -> Connections:  # fmt: skip
    return (
        connect(drive.flange, pump.shaft),
        connect(tank.port, pump.a),
        connect(pump.b, volume.port, edge.a),
        connect(edge.b, check.a),
        connect(check.b, load.port, pump.load),
        connect(up.y, both.u1),
        connect(down.y, both.u2),
        connect(both.y, load.u),
    )


@pytest.mark.thorough
def test_load_sensing_after_steps_of_the_load() -> None:
    """The load rises from 60 to 90 bar, above the pump's pressure, and falls again: against DOP853 and Radau."""
    parts = (
        ConstantSpeed(speed=157.0),
        LoadSensingPump(
            displacement=4.5e-6, liquid=LIQUID, losses=WilsonLosses(C_s=1.5e-12 * 860.0 * 1e-9 / 4.5e-6), tau=0.03,
            margin=2e6, band=4e5, p_set=16e6, band_set=1e6, x=0.493133688591,
        ),
        Chamber(volume=1e-3, liquid=LIQUID, p=7802746.524564),
        LiquidOrifice(area=8e-6, liquid=LIQUID, discharge_coefficient=0.65),
        IdealCheckValve(conductance=1e-3, cracking_pressure=0.0),
        SignalPressure(),
        Step(offset=6e6, height=3e6, start_time=0.02),
        Step(height=-3e6, start_time=0.3),
        Sum(),
        Tank(),
    )  # fmt: skip
    times = np.array([0.022, 0.03, 0.04, 0.09, 0.2, 0.302, 0.31, 0.34, 0.6])
    sol = simulate(Rig(parts=parts, wiring=_sensed), 0.6, save=jnp.asarray(times), rtol=1e-9)
    p = [8776161.333281, 10695683.24918, 11024006.57695, 10798500.33848, 10800328.61403, 10220970.26568, 8301262.957377,
         7765710.574124, 7802746.52459]  # fmt: skip
    x = [0.5258230251997, 0.634302912923, 0.4762066895598, 0.4980858833882, 0.4991781666728, 0.4669847762446,
         0.3576768737106, 0.4756609161667, 0.4931336885901]  # fmt: skip
    np.testing.assert_allclose(sol["parts[2].p"], p, atol=1e-5 * 5e6)
    np.testing.assert_allclose(sol["parts[1].x"], x, atol=1e-5)
