"""Friction that sticks, against closed forms."""

import math
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _rig import Rig
from jax import Array

from acausal import Component, Connections, ParameterError, Scalar, Solution, connect, simulate
from components import blocks, rotational, translational

TIGHT = 1e-10


def times_of(solution: Solution, name: str) -> list[Array]:
    """The times of the events of one name."""
    events = solution.events
    return [events.times[i] for i, here in enumerate(events.names) if here == name]


def wire_slide(force: Any, mass: Any, friction: Any) -> Connections:
    return connect(force.flange, mass.a), connect(mass.b, friction.flange)


def slide(Fc: Scalar, v: Scalar, force: Scalar = 0.0) -> Rig:
    """A mass of 2 kg on Coulomb friction with break-away at 1.5 Fc, pushed."""
    friction = translational.SupportFriction(
        speeds=jnp.array([0.0, 1.0]), forces=jnp.stack([jnp.asarray(Fc, float)] * 2), peak=1.5
    )
    mass = translational.Mass(m=2.0, v=v)
    return Rig(parts=(translational.ConstantForce(force=force), mass, friction), wiring=wire_slide)


def path(Fc: Scalar, v: Scalar, force: Scalar = 0.0, end: float = 3.0) -> Scalar:
    return simulate(slide(Fc, v, force), end, save="end", rtol=TIGHT).final.parts[1].b.s


@pytest.mark.slow
def test_braking_to_rest_and_its_gradient() -> None:
    """From v to rest with F = 4 N: at t = m v / F, after m v^2 / (2 F)."""
    value, backward = jax.value_and_grad(path, argnums=(0, 1))(4.0, 3.0)
    np.testing.assert_allclose(value, 2.25, atol=1e-8)
    for by_force, by_speed in (backward, jax.jacfwd(path, argnums=(0, 1))(4.0, 3.0)):
        np.testing.assert_allclose(by_force, -2.0 * 9.0 / (2.0 * 16.0), rtol=1e-6)
        np.testing.assert_allclose(by_speed, 2.0 * 3.0 / 4.0, rtol=1e-6)


@pytest.mark.slow
def test_a_batch_whose_members_stick_at_other_times_or_never() -> None:
    """The first comes to rest and stays, the second is pushed on, the third breaks away, the last turns back."""
    v, force = jnp.array([3.0, 3.0, 0.0, 1.0]), jnp.array([5.0, 7.0, -7.0, -10.0])
    found = jax.jit(jax.vmap(lambda v, force: path(4.0, v, force)))(v, force)
    t = 3.0
    stopped, back = 2.0 / 14.0, -6.0 / 2.0
    turned = 0.5 * 1.0 * stopped + 0.5 * back * (t - stopped) ** 2
    np.testing.assert_allclose(found[1:], [3.0 * t + 0.25 * 3.0 * t**2, -0.25 * 3.0 * t**2, turned], atol=1e-8)
    # Pushed with more than it slides with, it does not stop.
    np.testing.assert_allclose(found[0], 3.0 * t + 0.25 * t**2, atol=1e-8)


@pytest.mark.thorough
def test_a_held_mass_stays() -> None:
    np.testing.assert_allclose(path(4.0, 0.0, 5.9), 0.0, atol=1e-8)


def wire_belt(belt: Any, block: Any, spring: Any, wall: Any, friction: Any) -> Connections:
    return (
        connect(belt.flange, friction.support),
        connect(block.a, friction.flange, spring.b),
        connect(spring.a, wall.flange),
    )


C, M, V = 100.0, 1.0, 0.2


def stick_slip_times(Fc: Scalar, peak: Scalar, cycles: int) -> tuple[Array, Array]:
    """Break-away and sticking of a block that starts at rest on the belt, by harmonic motion about Fc / C."""
    omega, x0 = math.sqrt(C / M), (peak - 1.0) * Fc / C
    slip = (math.pi + 2.0 * jnp.arctan2(V, omega * x0)) / omega
    stick = 2.0 * x0 / V
    first = peak * Fc / C / V
    breaks = first + (slip + stick) * jnp.arange(cycles)
    return breaks, breaks + slip


@pytest.mark.thorough
def test_stick_slip_on_a_belt() -> None:
    """Closed form of the times of break-away and sticking, and their derivatives with respect to both levels."""

    def run(Fc: Scalar, peak: Scalar) -> Any:
        friction = translational.SupportFriction(
            speeds=jnp.array([0.0, 1.0]),
            forces=jnp.stack([jnp.asarray(Fc, float)] * 2),
            peak=peak,
            support=translational.Flange(),
        )
        block = translational.Mass(m=M, v=V)
        belt, spring = translational.ConstantSpeed(speed=V), translational.Spring(c=C)
        model = Rig(parts=(belt, block, spring, translational.Fixed(), friction), wiring=wire_belt)
        return simulate(model, 2.2, save="end", rtol=TIGHT)

    solution, expected = run(4.0, 1.5), stick_slip_times(4.0, 1.5, 3)
    np.testing.assert_allclose(jnp.stack(times_of(solution, "parts[4].backward"))[:3], expected[0], atol=1e-8)
    np.testing.assert_allclose(times_of(solution, "parts[4].stick"), expected[1], atol=1e-8)
    second = np.flatnonzero(np.array(solution.events.names) == "parts[4].stick")[1]
    found = jax.jacfwd(lambda Fc, peak: run(Fc, peak).events.times[second], argnums=(0, 1))(4.0, 1.5)
    slopes = jax.grad(lambda Fc, peak: stick_slip_times(Fc, peak, 3)[1][1], argnums=(0, 1))(4.0, 1.5)
    np.testing.assert_allclose(found, slopes, rtol=1e-6)


def wire_freewheel(source: Any, torque: Any, driver: Any, clutch: Any, driven: Any, off: Any) -> Connections:
    return (
        connect(source.y, torque.u),
        connect(torque.flange, driver.a),
        connect(driver.b, clutch.a),
        connect(clutch.b, driven.a),
        connect(off.y, clutch.u),
    )


@pytest.mark.thorough
def test_freewheel_drives_and_overruns() -> None:
    """Both are driven by 6 N.m for 1 s; then the driver is braked, and the driven side overruns."""
    parts = (
        blocks.Step(offset=6.0, height=-12.0, start_time=1.0),
        rotational.SignalTorque(),
        rotational.Inertia(J=1.0),
        rotational.OneWayClutch(mu=0.5, fn_max=10.0),
        rotational.Inertia(J=2.0),
        blocks.Constant(k=0.0),
    )
    solution = simulate(Rig(parts=parts, wiring=wire_freewheel), 1.5, save=jnp.array([0.5, 1.5]), rtol=TIGHT)
    np.testing.assert_allclose(solution.parts[2].w, [1.0, -1.0], atol=1e-8)
    np.testing.assert_allclose(solution.parts[4].w, [1.0, 2.0], atol=1e-8)
    np.testing.assert_allclose(solution.parts[3].tau[0], -4.0, atol=1e-8)


class Gearbox(Component):
    """A planetary gear with a brake on its ring, and a clutch that locks sun and carrier together."""

    drive: rotational.ConstantTorque
    sun: rotational.Inertia
    gear: rotational.PlanetaryGear
    ring: rotational.Inertia
    carrier: rotational.Inertia
    brake: rotational.Brake
    clutch: rotational.Clutch
    release: blocks.Step
    press: blocks.Step

    def connections(self) -> Connections:
        return (
            connect(self.drive.flange, self.sun.a),
            connect(self.sun.b, self.gear.sun, self.clutch.a),
            connect(self.gear.carrier, self.carrier.a, self.clutch.b),
            connect(self.gear.ring, self.ring.a, self.brake.flange),
            connect(self.release.y, self.brake.u),
            connect(self.press.y, self.clutch.u),
        )


@pytest.mark.slow
def test_gear_shift_of_a_planetary_gear() -> None:
    """First gear: ring held, w_sun = (1 + r) w_carrier. Direct gear: all turn together. Both accelerate by formula."""
    gearbox = Gearbox(
        drive=rotational.ConstantTorque(torque=3.0),
        sun=rotational.Inertia(J=0.1),
        gear=rotational.PlanetaryGear(ring_to_sun=1.5),
        ring=rotational.Inertia(J=0.2),
        carrier=rotational.Inertia(J=0.5),
        brake=rotational.Brake(mu=0.5, fn_max=100.0),
        clutch=rotational.Clutch(mu=0.5, fn_max=40.0),
        release=blocks.Step(offset=1.0, height=-1.0, start_time=1.0),
        press=blocks.Step(height=1.0, start_time=1.0),
    )
    solution = simulate(gearbox, 3.0, save=jnp.array([0.5, 1.0, 2.5, 3.0]), rtol=TIGHT)
    first = 3.0 / (0.1 + 0.5 / 2.5**2)
    np.testing.assert_allclose(solution.sun.w[:2], [0.5 * first, first], rtol=1e-8)
    np.testing.assert_allclose(solution.carrier.w[:2], solution.sun.w[:2] / 2.5, rtol=1e-8)
    np.testing.assert_allclose(solution.carrier.w[2:], solution.sun.w[2:], atol=1e-8)
    np.testing.assert_allclose(solution.ring.w[2:], solution.sun.w[2:], atol=1e-8)
    np.testing.assert_allclose(solution.sun.w[3] - solution.sun.w[2], 0.5 * 3.0 / 0.8, atol=1e-8)
    assert len(times_of(solution, "clutch.stick")) == 1


def wire_worm(drive: Any, rotor: Any, gear: Any, wheel: Any, load: Any) -> Connections:
    return (
        connect(drive.flange, rotor.a),
        connect(rotor.b, gear.a),
        connect(gear.b, wheel.a),
        connect(wheel.b, load.flange),
    )


@pytest.mark.slow
def test_worm_locks_itself_and_drives() -> None:
    """Ratio 20, efficiency 0.4: no load torque turns the wheel back; lifting, the load at the worm is x / 0.4."""

    def turned(drive: Scalar, load: Scalar) -> Any:
        parts = (
            rotational.ConstantTorque(torque=drive),
            rotational.Inertia(J=1e-3),
            rotational.LossyGear.worm(ratio=20.0, efficiency=0.4),
            rotational.Inertia(J=0.1),
            rotational.ConstantTorque(torque=load),
        )
        return simulate(Rig(parts=parts, wiring=wire_worm), 0.5, save="end", rtol=TIGHT).final.parts[1].w

    drive, load = jnp.array([0.0, 0.3, 0.7]), jnp.array([-5.0, -5.0, -5.0])
    found = jax.vmap(turned)(drive, load)
    np.testing.assert_allclose(found[:2], 0.0, atol=1e-8)
    lifting = (0.7 - 0.25 / 0.4) / (1e-3 + 0.1 / 400.0 / 0.4)
    np.testing.assert_allclose(found[2], 0.5 * lifting, rtol=1e-8)


def wire_lugre(drive: Any, friction: Any) -> Connections:
    return (connect(drive.flange, friction.flange),)


@pytest.mark.thorough
@pytest.mark.parametrize("w", [0.05, -2.0])
def test_lugre_slides_with_its_level(w: float) -> None:
    """Steady sliding: g(w) sign(w) + C w."""
    friction = rotational.LuGreFriction(Tc=1.0, Ts=1.5, ws=0.1, stiffness=1e3, damping=1.0, C=0.2)
    solution = simulate(Rig(parts=(rotational.ConstantSpeed(speed=w), friction), wiring=wire_lugre), 5.0, rtol=TIGHT)
    level = 1.0 + 0.5 * math.exp(-((w / 0.1) ** 2))
    np.testing.assert_allclose(solution.final.parts[1].flange.tau, math.copysign(level, w) + 0.2 * w, rtol=1e-8)


TABLE: dict[str, Any] = dict(speeds=jnp.array([0.0, 1.0]), torques=jnp.array([0.5, 1.0]))


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: rotational.BearingFriction(**TABLE, peak=0.5), "BearingFriction.peak must be at least 1"),
        (
            lambda: rotational.BearingFriction(speeds=jnp.array([0.1, 1.0]), torques=jnp.ones(2)),
            "BearingFriction.speeds must start at 0",
        ),
        (lambda: rotational.StribeckFriction(Tc=2.0, Ts=1.0, ws=1.0), "StribeckFriction.Tc must be at most Ts"),
        (lambda: translational.StribeckFriction(Fc=2.0, Fs=1.0, vs=1.0), "StribeckFriction.Fc must be at most Fs"),
        (lambda: translational.Brake(mu=0.5, fn_max=1.0, peak=0.9), "Brake.peak must be at least 1"),
        (lambda: rotational.LossyGear(ratio=2.0, losses=jnp.ones((1, 4))), "LossyGear.losses must have rows"),
        (
            lambda: rotational.LossyGear(ratio=2.0, losses=jnp.array([[0.0, 1.5, 0.5, 0.0, 0.0]])),
            "LossyGear.losses must have eta1 above 0",
        ),
        (
            lambda: rotational.LuGreFriction(Tc=2.0, Ts=1.0, ws=1.0, stiffness=1.0),
            "LuGreFriction.Tc must be at most Ts",
        ),
    ],
)
def test_bad_parameters(build: Callable[[], Component], message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        build()


@pytest.mark.thorough
@pytest.mark.parametrize(("rtol", "most"), [(1e-6, 1e-4), (1e-8, 1e-6)])
def test_a_mass_comes_to_rest_below_a_peak(rtol: float, most: float) -> None:
    """The step that ends at rest has stages beyond it, where the law continues smoothly."""
    nodes, weights = np.polynomial.legendre.leggauss(200)

    def exact(v: Scalar, static: Scalar, fexp: Scalar) -> Array:
        """The integral of m v / f over the speed, with more points where the law is steep."""
        u = jnp.asarray(0.5 * (nodes + 1.0))
        speeds, widths = v * u**3, 0.5 * weights * 3.0 * v * u**2
        return jnp.sum(widths * 2.0 * speeds / (1.0 + static * jnp.exp(-fexp * speeds)))

    def path(v: Scalar, static: Scalar, fexp: Scalar) -> Scalar:
        friction = translational.TustinFriction(F_prop=0.0, F_Coulomb=1.0, F_Stribeck=static, fexp=fexp)
        parts = (translational.ConstantForce(force=0.0), translational.Mass(m=2.0, v=v), friction)
        return simulate(Rig(parts=parts, wiring=wire_slide), 3.0, save="end", rtol=rtol).final.parts[1].b.s

    draw, n = np.random.default_rng(3), 100
    cases = draw.uniform(0.2, 1.0, n), draw.uniform(0.2, 2.0, n), 10.0 ** draw.uniform(0.5, 3.0, n)
    places, slopes = jax.jit(jax.vmap(jax.value_and_grad(path, argnums=(0, 1))))(*cases)
    expected, expected_slopes = jax.vmap(jax.value_and_grad(exact, argnums=(0, 1)))(*cases)
    np.testing.assert_allclose(places, expected, atol=0.1 * most)
    np.testing.assert_allclose(slopes, expected_slopes, atol=most)


def wire_pulled(pull: Any, spring: Any, mass: Any, friction: Any) -> Connections:
    return connect(pull.flange, spring.a), connect(spring.b, mass.a), connect(mass.b, friction.flange)


@pytest.mark.slow
def test_a_steep_peak_breaks_away_once_in_each_cycle() -> None:
    """With a nominal speed below the speed over which the peak decays."""

    def run(fexp: Array, static: Array, speed: Array) -> tuple[Array, Array]:
        parts = (
            translational.ConstantSpeed(speed=speed),
            translational.SpringDamper(c=100.0, d=1.0),
            translational.Mass(m=1.0),
            translational.TustinFriction(F_prop=0.1, F_Coulomb=1.0, F_Stribeck=static, fexp=fexp),
        )
        log = simulate(Rig(parts=parts, wiring=wire_pulled), 3.0, save="end", nominal={"parts[2].v": 1e-6}).events
        return log.count, log.of_event("parts[3].forward")[:2]

    draw, n = np.random.default_rng(2), 16
    fexp, static = 10.0 ** draw.uniform(4.0, 7.0, n), draw.uniform(0.2, 1.0, n)
    speed = 10.0 ** draw.uniform(-4.0, -0.3, n)
    count, times = jax.jit(jax.vmap(run))(fexp, static, speed)
    first = (1.0 + static - speed) / (100.0 * speed)
    np.testing.assert_allclose(np.min(times, axis=1), np.where(first < 3.0, first, np.inf), rtol=1e-6)
    assert np.all(count < 20)
