"""Loops with tables that start on a knot, come to rest on a knot, or are stiff."""

from typing import Any, Self

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from acausal import (
    Component,
    Connections,
    Equations,
    Param,
    Result,
    Scalar,
    Var,
    Vector,
    connect,
    eq,
    simulate,
)
from components._tables import linear
from components.blocks import Integrator, Ramp, Sine, Sum, Table1D
from components.hydraulic import LaminarResistance, PilotCheckValve, Volume


class Charged(Component):
    """A capacitor with a diode, in numbers."""

    source: Ramp | Sine
    sum: Sum
    capacitor: Integrator
    diode: Table1D

    def connections(self) -> Connections:
        return (
            connect(self.source.y, self.sum.u1),
            connect(self.diode.y, self.sum.u2),
            connect(self.sum.y, self.capacitor.u),
            connect(self.capacitor.y, self.diode.u),
        )


KNOTS, CURRENTS = np.array([0.0, 0.55, 0.65, 0.7, 0.75]), np.array([0.0, 1e-3, 0.1, 1.0, 5.0])


@pytest.mark.thorough
@pytest.mark.parametrize("smooth", [False, True])
@pytest.mark.parametrize("source", [Ramp(height=2.0, duration=5.0), Sine(amplitude=1.0, frequency=1.0, phase=0.3)])
def test_a_loop_that_begins_on_a_knot(source: Ramp | Sine, smooth: bool) -> None:
    """The first step starts there; the sign of its error has no effect."""
    diode = Table1D(
        points=jnp.concatenate([-KNOTS[:0:-1], KNOTS]),
        values=jnp.concatenate([-CURRENTS[:0:-1], CURRENTS]),
        smooth=smooth,
        extrapolation="linear",
    )

    def end(capacity: float, rtol: float) -> Any:
        model = Charged(source=source, sum=Sum(k1=1.0, k2=-1.0), capacitor=Integrator(k=1.0 / capacity), diode=diode)
        run = simulate(model, 1.0, save="end", rtol=rtol)
        return run.final.capacitor.y.value

    run = jax.jit(end)
    for capacity in (1e-5, 1e-4, 1e-3, 1e-2):
        exact = run(capacity, 1e-10)
        for rtol in (1e-3, 1e-4, 1e-6, 1e-8):
            np.testing.assert_allclose(run(capacity, rtol), exact, atol=10 * rtol)


class Sprung(Component):
    """A mass whose spring and damper are tables."""

    places: Param[Vector, "1"]
    pulls: Param[Vector, "1"]
    speeds: Param[Vector, "1"]
    drags: Param[Vector, "1"]
    push: Param[Scalar, "1"]
    x: Var[Scalar, "1"]
    v: Var[Scalar, "1"] = 0.0

    def equations(self, d: Self) -> Equations:
        pull = linear(self.x, self.places, self.pulls)
        drag = linear(self.v, self.speeds, self.drags)
        rates = dict(x=(d.x, self.v), v=(d.v, self.push - pull - drag))
        return {name: eq(left, right, check_units=False) for name, (left, right) in rates.items()}


def _table(rng: np.random.Generator, steepest: float) -> tuple[np.ndarray, np.ndarray]:
    """Five knots of a rising polyline; the third is the origin."""
    knots, slopes = np.cumsum(10.0 ** rng.uniform(-2.0, 0.0, 5)), 10.0 ** rng.uniform(-0.5, steepest, 4)
    values = np.concatenate([[0.0], np.cumsum(slopes * np.diff(knots))])
    return knots - knots[2], values - values[2]


@pytest.mark.thorough
def test_random_springs_and_dampers_by_tables() -> None:
    """Each for 3 s from rest on knots of both tables, and from beyond all knots."""
    rng = np.random.default_rng(0)

    def run(rtol: float, t1: float, **data: Any) -> Any:
        solution = simulate(Sprung(**data), t1, save="end", rtol=rtol, max_steps=20_000, throw=False)
        return solution.result == Result.reached_end, solution.final.x

    compiled = jax.jit(run)
    for _ in range(25):
        (places, pulls), (speeds, drags) = _table(rng, 4.0), _table(rng, 3.0)
        for x in (0.0, places[3], places[4] + 0.3):
            data = dict(places=places, pulls=pulls, speeds=speeds, drags=drags, push=10.0 ** rng.uniform(-1.0, 1.0))
            data |= dict(x=x)
            has_ended, exact = compiled(1e-10, 3.0, **data)
            assert has_ended
            for rtol in (1e-4, 1e-6, 1e-8):
                has_ended, found = compiled(rtol, 3.0, **data)
                assert has_ended
                np.testing.assert_allclose(found, exact, atol=100 * rtol)


class Equalising(Component):
    """Volumes that equalise through a valve that opens at any pressure difference."""

    main: Volume
    load: Volume
    pilot: Volume
    valve: PilotCheckValve
    leak: LaminarResistance
    line: LaminarResistance

    def connections(self) -> Connections:
        return (
            connect(self.main.port, self.valve.a, self.leak.a, self.line.a),
            connect(self.load.port, self.valve.b, self.leak.b),
            connect(self.pilot.port, self.valve.pilot, self.line.b),
        )


@pytest.mark.thorough
def test_volumes_that_become_equal_by_a_piloted_valve() -> None:
    def end(p: float, more: float, volume: float, rtol: float) -> Any:
        model = Equalising(
            main=Volume(volume=volume, bulk_modulus=1e9, p=p + more),
            load=Volume(volume=volume, bulk_modulus=1e9, p=p),
            pilot=Volume(volume=volume, bulk_modulus=1e9, p=p),
            valve=PilotCheckValve(rated_flow=1e-3, rated_drop=1e6, band=1e5, cracking=0.0, ratio=3.0),
            leak=LaminarResistance(resistance=1e9),
            line=LaminarResistance(resistance=1e10),
        )
        return simulate(model, 1.0, save="end", rtol=rtol).final.load.p

    run = jax.jit(end)
    for p in (1e6, 3e7):
        for more in (1e3, 1e6):
            for volume in (1e-5, 1e-3):
                for rtol in (1e-4, 1e-6):
                    mean = p + more / 3.0  # of three equal volumes
                    np.testing.assert_allclose(run(p, more, volume, rtol), mean, rtol=0.1 * rtol, atol=1e-3 * more)
