"""Closed circuit of a vehicle with charge pump and purge: reversal through zero displacement, energy, gradients."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from acausal import Component, Connections, connect, replace, simulate
from components.blocks import TimeSeries
from components.hydraulic import (
    Chamber,
    CheckValve,
    FixedPump,
    PilotStage,
    PurgeValve,
    ReliefValve,
    ServoPump,
    Tank,
    VariablePump,
    WilsonLosses,
    iso_vg_46,
)
from components.rotational import ConstantSpeed, Inertia, LinearSpeedDependentTorque


class Transmission(Component):
    """A servo-pump and a motor, fed through check valves, relieved from each line to the other."""

    drive: ConstantSpeed
    pump: ServoPump
    charge: FixedPump
    lever: TimeSeries
    line_a: Chamber
    line_b: Chamber
    feed: Chamber
    check_a: CheckValve
    check_b: CheckValve
    relief_a: ReliefValve
    relief_b: ReliefValve
    low: ReliefValve
    purge: PurgeValve
    purged: Chamber
    out: ReliefValve
    motor: FixedPump
    load: Inertia
    drag: LinearSpeedDependentTorque
    tank: Tank = Tank()

    def connections(self) -> Connections:
        ends_a = (self.check_a.b, self.relief_a.a, self.relief_b.b, self.purge.a, self.motor.b)
        ends_b = (self.check_b.b, self.relief_b.a, self.relief_a.b, self.purge.b, self.motor.a)
        return (
            connect(self.drive.flange, self.pump.shaft, self.charge.shaft),
            connect(self.lever.y, self.pump.u),
            connect(self.tank.port, self.charge.a, self.low.b, self.out.b),
            connect(self.charge.b, self.feed.port, self.check_a.a, self.check_b.a, self.low.a),
            connect(self.pump.a, self.line_a.port, *ends_a),
            connect(self.pump.b, self.line_b.port, *ends_b),
            connect(self.purge.c, self.purged.port, self.out.a),
            connect(self.motor.shaft, self.load.a),
            connect(self.load.b, self.drag.flange),
        )


OIL, LOSSES = iso_vg_46(temperature=323.15), WilsonLosses(C_s=2e-9, C_v=1e5, C_f=0.02)
PER_REVOLUTION = 1e-6 / (2.0 * np.pi)  # 1 cm3/rev in m3/rad


def transmission() -> Transmission:
    line, check = Chamber(volume=5e-4, liquid=OIL, p=2e6), CheckValve(conductance=1e-8)
    relief = ReliefValve(conductance=1e-9, cracking_pressure=3e7)
    machine: dict[str, Any] = dict(displacement=28.0 * PER_REVOLUTION, liquid=OIL, losses=LOSSES)
    return Transmission(
        drive=ConstantSpeed(speed=200.0),
        pump=ServoPump(swash=PilotStage(w=60.0, D=0.8, rate=12.0), pump=VariablePump(**machine)),
        charge=FixedPump(displacement=6.0 * PER_REVOLUTION, liquid=OIL, losses=LOSSES),
        lever=TimeSeries(times=jnp.array([0.0, 0.1, 0.6, 1.5, 1.8, 3.0]), values=jnp.array([0.0, 0, 1, 1, -1, -1])),
        line_a=line,
        line_b=line,
        feed=Chamber(volume=2e-4, liquid=OIL, p=2e6),
        check_a=check,
        check_b=check,
        relief_a=relief,
        relief_b=relief,
        low=ReliefValve(conductance=1e-8, cracking_pressure=2.2e6),
        purge=PurgeValve(rated_flow=1e-4, rated_drop=1e6, threshold=5e5, band=5e5),
        purged=Chamber(volume=5e-5, liquid=OIL, p=1.5e6),
        out=ReliefValve(conductance=1e-8, cracking_pressure=1.6e6),
        motor=FixedPump(**machine),
        load=Inertia(J=2.0),
        drag=LinearSpeedDependentTorque(torque=-40.0, w_nominal=200.0),
    )


@pytest.mark.slow
def test_transmission_through_no_displacement() -> None:
    """The charge pump keeps liquid in both lines, and the load ends up turning backward."""
    sol = simulate(transmission(), 3.0, save="steps", energy=True)
    lowest = {name: float(np.min(sol[f"{name}.p"])) for name in ("line_a", "line_b", "feed", "purged")}
    assert min(lowest.values()) > 0.0, lowest
    assert float(np.max(sol["load.w"])) > 50.0
    assert float(sol.final.load.w) < 0.0
    assert float(sol.final.pump.swash.x) == pytest.approx(-1.0, abs=1e-6)
    supplied = np.trapezoid(np.asarray(sol["drive.flange.tau"]) * 200.0, np.asarray(sol.ts))
    assert abs(float(sol.energy.imbalance)) < 1e-6 * abs(supplied)


@pytest.mark.slow
def test_gradients_of_the_transmission() -> None:
    """Gradients of the speed while the swash plate swings, in both modes and by differences."""
    rig = transmission()
    base = {"pump.pump.displacement": 28.0 * PER_REVOLUTION, "load.J": 2.0, "charge.displacement": 6.0 * PER_REVOLUTION}

    def speed(scales: jax.Array, rtol: float = 1e-6) -> jax.Array:
        changed = replace(rig, {name: scales[i] * value for i, (name, value) in enumerate(base.items())})
        return jnp.asarray(simulate(changed, 0.6, save="end", rtol=rtol).final.load.w)

    ones = jnp.ones(3)
    forward, reverse = jax.jacfwd(speed)(ones), jax.grad(speed)(ones)
    np.testing.assert_allclose(forward, reverse, rtol=1e-7)
    run = jax.jit(lambda scales: speed(scales, 1e-9))
    differences = [(run(ones + step) - run(ones - step)) / 2e-4 for step in 1e-4 * np.eye(3)]
    np.testing.assert_allclose(forward, differences, rtol=1e-3, atol=1e-3 * float(jnp.max(jnp.abs(forward))))
