"""Friction and stops together, and friction at its edges, against closed forms."""

from typing import Any, Self

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _rig import Rig

from acausal import Component, Connections, Equations, Param, Scalar, UnitError, connect, nonnegative, simulate
from components import blocks, rotational, translational

TIGHT = 1e-10


def bounces(v: float, force: float, e: float, end: float) -> tuple[float, float, int]:
    """Position, path slid and impacts of a mass of 1 kg that starts at 0 between stops at -0.4 and 0.6."""
    s, t, slid, count = 0.0, 0.0, 0.0, 0
    while v != 0.0:
        wall = 0.6 if v > 0.0 else -0.4
        gap, speed = abs(wall - s), abs(v)
        reaches = speed**2 > 2.0 * force * gap
        needed = (speed - np.sqrt(speed**2 - 2.0 * force * gap)) / force if reaches else speed / force
        if t + needed >= end:
            left = end - t
            path = speed * left - 0.5 * force * left**2
            return s + np.sign(v) * path, slid + path, count
        t += needed
        path = gap if reaches else speed**2 / (2.0 * force)
        s, slid = s + np.sign(v) * path, slid + path
        v = -np.sign(v) * e * (speed - force * needed) if reaches else 0.0
        count += reaches
        v = 0.0 if abs(v) <= 1e-3 else v
    return s, slid, count


def wire_pushed(push: Any, body: Any) -> Connections:
    return (connect(push.flange, body.a),)


def bouncing(v: Scalar, force: Scalar, e: Scalar) -> Rig:
    body = translational.MassWithStopAndFriction(
        m=1.0, L=0.2, s_min=-0.5, s_max=0.7, F_Coulomb=force, restitution=e, v=v
    )
    return Rig(parts=(translational.ConstantForce(force=0.0), body), wiring=wire_pushed)


@pytest.mark.thorough
def test_random_trains_of_impacts_with_friction() -> None:
    """Impacts with restitution and dry friction in between, until it sticks; nothing of the energy is lost."""
    rng = np.random.default_rng(4)
    v, force, e = rng.uniform(-8.0, 8.0, 12), rng.uniform(0.1, 2.0, 12), rng.uniform(0.2, 1.0, 12)
    expected = np.array([bounces(*case, 3.0) for case in zip(v, force, e, strict=True)])
    assert np.max(expected[:, 2]) > 8

    def run(v: Scalar, force: Scalar, e: Scalar) -> Any:
        solution = simulate(bouncing(v, force, e), 3.0, save="end", rtol=TIGHT, energy=True)
        body = solution.final.parts[1]
        return body.s, solution.energy.dissipated["parts[1]"], solution.energy.imbalance

    place, dissipated, imbalance = jax.jit(jax.vmap(run))(v, force, e)
    np.testing.assert_allclose(place, expected[:, 0], atol=1e-7)
    np.testing.assert_allclose(dissipated, force * expected[:, 1], atol=1e-6)
    np.testing.assert_allclose(imbalance, 0.0, atol=1e-6)


@pytest.mark.slow
def test_gradient_through_impacts_with_friction() -> None:
    end = lambda x: simulate(bouncing(*x), 1.2, save="end", rtol=TIGHT).final.parts[1].s  # noqa: E731
    x, step = np.array([4.0, 0.8, 0.7]), 1e-6
    place = lambda x: bounces(float(x[0]), float(x[1]), float(x[2]), 1.2)[0]  # noqa: E731
    expected = [(place(x + h) - place(x - h)) / (2.0 * step) for h in step * np.eye(3)]
    np.testing.assert_allclose(jax.grad(end)(jnp.asarray(x)), expected, rtol=1e-5)
    np.testing.assert_allclose(jax.jacfwd(end)(jnp.asarray(x)), expected, rtol=1e-5)


def wire_slide(source: Any, force: Any, mass: Any, friction: Any) -> Connections:
    return connect(source.y, force.u), connect(force.flange, mass.a), connect(mass.b, friction.flange)


@pytest.mark.thorough
def test_what_was_held_one_way_breaks_away_the_other_way() -> None:
    """A force from -50 to 100 N breaks away at 60 N, after 11/15 s, and then pulls against C v alone."""
    friction = translational.TustinFriction(F_prop=200.0, F_Coulomb=60.0, F_Stribeck=0.0, fexp=0.0)
    ramp = blocks.Ramp(offset=-50.0, height=150.0, duration=1.0)
    parts = (ramp, translational.SignalForce(), translational.Mass(m=1.0), friction)
    solution = simulate(Rig(parts=parts, wiring=wire_slide), 1.0, save="end", rtol=TIGHT)
    t = 1.0 - 11.0 / 15.0
    expected = 150.0 / 200.0 * (t - (1.0 - np.exp(-200.0 * t)) / 200.0)
    np.testing.assert_allclose(solution.final.parts[2].v, expected, rtol=1e-6)
    assert list(solution.events.names).count("parts[3].forward") == 1


def wire_stop(mass: Any, friction: Any, low: Any, high: Any) -> Connections:
    return connect(mass.a, low.flange, friction.flange), connect(mass.b, high.flange)


@pytest.mark.thorough
@pytest.mark.parametrize("start", [(1.0, -4.0), (0.1, 0.0), (1.3, 4.0), (2.9, 0.0)])
def test_a_mass_with_a_length_comes_to_rest_at_its_stops(start: tuple[float, float]) -> None:
    """With e = 0 it stays where it hits; at the stop without load, it causes no further events."""
    parts = (
        translational.SlidingMass(m=1.0, L=0.2, s=start[0], v=start[1]),
        translational.StribeckFriction(Fc=1.0, Fs=1.5, vs=0.1),
        translational.HardStop(s_min=0.0),
        translational.HardStop(s_max=3.0),
    )
    solution = simulate(Rig(parts=parts, wiring=wire_stop), 4.0, rtol=TIGHT)
    final = solution.final.parts[0]
    np.testing.assert_allclose([final.s, final.v], [0.1 if start[0] < 1.1 else 2.9, 0.0], atol=1e-8)
    assert len(solution.events.names) <= 4
    if start[1] == 0.0:
        assert solution.stats["num_rejected_steps"] == 0


def wire_pressed(ramp: Any, push: Any, mass: Any, friction: Any, stop: Any) -> Connections:
    return connect(ramp.y, push.u), connect(push.flange, mass.a, friction.flange, stop.flange)


@pytest.mark.thorough
def test_what_rests_at_a_stop_breaks_away_with_its_static_friction() -> None:
    """Pressed on by 1 N until t = 1; at 1 - 1.5 (t - 1) = -peak Fc it leaves, whatever rounding left at the stop."""
    rng, n = np.random.default_rng(0), 12
    s_max = rng.uniform(0.1, 0.9, n) * rng.choice([1.0, 100.0], n)
    v, Fc, peak = s_max * rng.uniform(2.0, 8.0, n), rng.uniform(0.1, 0.4, n), rng.uniform(1.0, 2.5, n)

    def run(v: Scalar, s_max: Scalar, Fc: Scalar, peak: Scalar) -> Any:
        friction = translational.SupportFriction(speeds=jnp.array([0.0, 1.0]), forces=jnp.stack([Fc, Fc]), peak=peak)
        ramp = blocks.Ramp(offset=1.0, height=-3.0, duration=2.0, start_time=1.0)
        parts = (
            ramp,
            translational.SignalForce(),
            translational.Mass(m=1.0, v=v),
            friction,
            translational.HardStop(s_max=s_max),
        )
        solution = simulate(Rig(parts=parts, wiring=wire_pressed), 3.0, save="end", rtol=1e-8)
        return solution.final.parts[2].b.s, solution.events.of_event("parts[3].backward")

    place, times = jax.jit(jax.vmap(run))(v, s_max, Fc, peak)
    leaves = 1.0 + (1.0 + Fc * peak) / 1.5
    left = 3.0 - leaves
    np.testing.assert_allclose(np.min(times, axis=1), leaves, rtol=1e-9)
    np.testing.assert_allclose(place, s_max - 0.5 * Fc * (peak - 1.0) * left**2 - 0.25 * left**3, rtol=1e-9)


class Wet(translational.DryFriction):
    """A custom law: sliding force F0 + k v^2, break-away at 3 F0."""

    F0: Param[Scalar, "N", nonnegative]
    k: Param[Scalar, "N.s2/m2", nonnegative]

    def sliding(self, speed: Scalar) -> Scalar:
        return self.F0 + self.k * speed**2

    def breakaway(self) -> Scalar:
        return 3.0 * self.F0

    def equations(self, d: Self) -> Equations:
        return super().equations(d)


class Seal(rotational.ShaftFriction):
    """A constant torque."""

    tau0: Param[Scalar, "N.m", nonnegative]

    def sliding(self, speed: Scalar) -> Scalar:
        del speed
        return self.tau0

    def equations(self, d: Self) -> Equations:
        return super().equations(d)


class Wrong(rotational.ShaftFriction):
    """A torque with the unit of a power."""

    tau0: Param[Scalar, "N.m", nonnegative]

    def sliding(self, speed: Scalar) -> Scalar:
        return self.tau0 * speed

    def equations(self, d: Self) -> Equations:
        return super().equations(d)


def wire_brought_to_rest(mass: Any, friction: Any, rotor: Any, seal: Any) -> Connections:
    return connect(mass.b, friction.flange), connect(rotor.b, seal.flange)


@pytest.mark.thorough
def test_friction_of_ones_own() -> None:
    """m dv/dt = -F0 - k v^2 stops after m / sqrt(F0 k) arctan(v0 sqrt(k / F0)); a constant torque after J w0 / tau0."""
    parts: tuple[Component, ...] = (
        translational.Mass(m=2.0, v=3.0),
        Wet(F0=4.0, k=1.0),
        rotational.Inertia(J=0.5, w=2.0),
        Seal(tau0=0.8),
    )
    solution = simulate(Rig(parts=parts, wiring=wire_brought_to_rest), 3.0, rtol=TIGHT, energy=True)
    times = dict(zip(solution.events.names, np.asarray(solution.events.times), strict=True))
    np.testing.assert_allclose(times["parts[1].stick"], 2.0 / 2.0 * np.arctan(1.5), atol=1e-8)
    np.testing.assert_allclose(times["parts[3].stick"], 0.5 * 2.0 / 0.8, atol=1e-8)
    np.testing.assert_allclose(solution.energy.dissipated["parts[3]"], 1.0, atol=1e-7)


@pytest.mark.thorough
def test_units_of_friction_of_ones_own_are_checked() -> None:
    with pytest.raises(UnitError, match="friction"):
        simulate(Rig(parts=(rotational.Inertia(J=0.5), Wrong(tau0=1.0)), wiring=wire_shaft), 1.0)


def wire_shaft(rotor: Any, friction: Any) -> Connections:
    return (connect(rotor.b, friction.flange),)
