"""Rotational and translational drives, wheels, lengths and sensors against closed forms."""

from types import ModuleType
from typing import Any

import jax.numpy as jnp
import numpy as np
import pytest
from _rig import Rig

from acausal import Connections, connect, simulate
from components import blocks, rotational, translational

TIMES = jnp.linspace(0.0, 1.0, 6)


def inertia(domain: ModuleType, value: float, **start: Any) -> Any:
    return rotational.Inertia(J=value, **start) if domain is rotational else translational.Mass(m=value, **start)


def speed(domain: ModuleType) -> str:
    return "w" if domain is rotational else "v"


def wire_drive(drive: Any, body: Any) -> Connections:
    return (connect(drive.flange, body.a),)


@pytest.mark.parametrize("domain", [rotational, translational])
def test_linear_speed_dependent_drive(domain: ModuleType) -> None:
    """A load of -3 at speed 2: 0.5 dw/dt = -1.5 w."""
    load = (
        rotational.LinearSpeedDependentTorque(torque=-3.0, w_nominal=2.0)
        if domain is rotational
        else translational.LinearSpeedDependentForce(force=-3.0, v_nominal=2.0)
    )
    body = inertia(domain, 0.5, **{speed(domain): 4.0})
    solution = simulate(Rig(parts=(load, body), wiring=wire_drive), 1.0, save=TIMES, rtol=1e-9)
    np.testing.assert_allclose(solution[f"parts[1].{speed(domain)}"], 4.0 * np.exp(-3.0 * TIMES), atol=1e-8)


@pytest.mark.parametrize("domain", [rotational, translational])
@pytest.mark.parametrize(("start", "one_sign"), [(4.0, True), (4.0, False), (-4.0, False)])
def test_quadratic_speed_dependent_drive(domain: ModuleType, start: float, one_sign: bool) -> None:
    """A load of -3 at speed 2: 0.5 dw/dt = -0.75 w^2, so that w = w0 / (1 + 1.5 w0 t); drag acts on either sense."""
    load = (
        rotational.QuadraticSpeedDependentTorque(torque=-3.0, w_nominal=2.0, one_sign=one_sign)
        if domain is rotational
        else translational.QuadraticSpeedDependentForce(force=-3.0, v_nominal=2.0, one_sign=one_sign)
    )
    body = inertia(domain, 0.5, **{speed(domain): start})
    solution = simulate(Rig(parts=(load, body), wiring=wire_drive), 1.0, save=TIMES, rtol=1e-9)
    exact = start / (1.0 + 1.5 * abs(start) * np.asarray(TIMES))
    np.testing.assert_allclose(solution[f"parts[1].{speed(domain)}"], exact, atol=1e-7)


def test_quadratic_torque_of_one_sign_drives_a_shaft_that_turns_backward() -> None:
    """0.5 dw/dt = +0.75 w^2 from w0 = -4: the torque is positive whatever the sense."""
    drive = rotational.QuadraticSpeedDependentTorque(torque=3.0, w_nominal=2.0)
    rig = Rig(parts=(drive, rotational.Inertia(J=0.5, w=-4.0)), wiring=wire_drive)
    solution = simulate(rig, 1.0, save=TIMES, rtol=1e-9)
    np.testing.assert_allclose(solution["parts[1].w"], -4.0 / (1.0 + 6.0 * TIMES), atol=1e-7)


def wire_between(drive: Any, one: Any, other: Any, signal: Any) -> Connections:
    return (connect(drive.a, one.a), connect(drive.b, other.a), connect(signal.y, drive.u))


@pytest.mark.parametrize("domain", [rotational, translational])
def test_drive_between_two_bodies_conserves_momentum(domain: ModuleType) -> None:
    drive = rotational.SignalTorque2() if domain is rotational else translational.SignalForce2()
    parts = (drive, inertia(domain, 0.5), inertia(domain, 2.0), blocks.Constant(k=3.0))
    end = simulate(Rig(parts=parts, wiring=wire_between), 1.0, save="end").final.parts
    speeds = [getattr(body, speed(domain)) for body in (end[1], end[2])]
    np.testing.assert_allclose(speeds, [-6.0, 1.5], rtol=1e-9)


def wire_motion(drive: Any, body: Any, signal: Any) -> Connections:
    return connect(drive.flange, body.a), connect(signal.y, drive.u)


F, W = 0.4, 2.0 * np.pi * 0.4
SINE, COSINE = np.sin(W * np.asarray(TIMES)), np.cos(W * np.asarray(TIMES))


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("drive", "position", "rate", "acceleration"),
    [
        (rotational.SignalAngle(), SINE, W * COSINE, -(W**2) * SINE),
        (rotational.SignalSpeed(), (1.0 - COSINE) / W, SINE, W * COSINE),
        (rotational.SignalAcceleration(), np.asarray(TIMES) / W - SINE / W**2, (1.0 - COSINE) / W, SINE),
        (translational.SignalPosition(), SINE, W * COSINE, -(W**2) * SINE),
        (translational.SignalSpeed(), (1.0 - COSINE) / W, SINE, W * COSINE),
        (translational.SignalAcceleration(), np.asarray(TIMES) / W - SINE / W**2, (1.0 - COSINE) / W, SINE),
    ],
    ids=lambda item: f"{type(item).__module__}.{type(item).__name__}" if hasattr(item, "flange") else "",
)
def test_prescribed_motion(drive: Any, position: np.ndarray, rate: np.ndarray, acceleration: np.ndarray) -> None:
    """A sine as angle, speed or acceleration: motion and driving torque of an inertia of 0.5."""
    domain = rotational if "rotational" in type(drive).__module__ else translational
    where, flow = ("phi", "tau") if domain is rotational else ("s", "f")
    parts = (drive, inertia(domain, 0.5), blocks.Sine(amplitude=1.0, frequency=F))
    solution = simulate(Rig(parts=parts, wiring=wire_motion), 1.0, save=TIMES, rtol=1e-9)
    np.testing.assert_allclose(solution[f"parts[1].a.{where}"], position, atol=1e-7)
    np.testing.assert_allclose(solution[f"parts[1].{speed(domain)}"], rate, atol=1e-7)
    np.testing.assert_allclose(solution[f"parts[1].a.{flow}"], 0.5 * acceleration, atol=1e-6)


def wire_sensors(drive: Any, body: Any, *sensors: Any) -> Connections:
    power, multi, acceleration, apart, slip, fixed = sensors
    return (
        connect(drive.flange, power.a),
        connect(power.b, multi.a),
        connect(multi.b, body.a, acceleration.flange, apart.b, slip.b),
        connect(apart.a, slip.a, fixed.flange),
    )


@pytest.mark.parametrize("domain", [rotational, translational])
def test_sensors(domain: ModuleType) -> None:
    """A body of 0.5 driven by 2 from rest: a = 4, v = 4 t, s = 2 t^2, P = 8 t."""
    drive, apart = (
        (rotational.ConstantTorque(torque=2.0), rotational.RelativeAngleSensor())
        if domain is rotational
        else (translational.ConstantForce(force=2.0), translational.RelativePositionSensor())
    )
    sensors = (domain.PowerSensor(), domain.MultiSensor(), domain.AccelerationSensor(), apart)
    parts = (drive, inertia(domain, 0.5), *sensors, domain.RelativeSpeedSensor(), domain.Fixed())
    end = simulate(Rig(parts=parts, wiring=wire_sensors), 3.0, save="end", rtol=1e-9).final.parts
    effort = end[3].torque if domain is rotational else end[3].force
    readings = [end[2].y, end[3].speed, effort, end[3].power, end[4].y, end[5].y, end[6].y]
    np.testing.assert_allclose([y.value for y in readings], [24.0, 12.0, 2.0, 24.0, 4.0, 18.0, 12.0], rtol=1e-8)


def wire_wheel(drive: Any, wheel: Any, mass: Any) -> Connections:
    return connect(drive.flange, wheel.shaft), connect(wheel.rod, mass.a)


@pytest.mark.parametrize(
    ("wheel", "travel"),
    [(rotational.IdealGearR2T(ratio=4.0), 0.25), (rotational.IdealRollingWheel(radius=0.3), 0.3)],
    ids=["IdealGearR2T", "IdealRollingWheel"],
)
def test_wheel(wheel: Any, travel: float) -> None:
    """A torque of 2 on a travel r per angle pushes with 2 / r."""
    parts = (rotational.ConstantTorque(torque=2.0), wheel, translational.Mass(m=1.6))
    end = simulate(Rig(parts=parts, wiring=wire_wheel), 1.0, save="end").final.parts
    np.testing.assert_allclose(end[2].v, 2.0 / travel / 1.6, rtol=1e-9)
    np.testing.assert_allclose(travel * end[1].shaft.phi, end[1].rod.s, rtol=1e-9)


def test_housing_of_a_gear_takes_the_reaction() -> None:
    """The load held, a motor torque of 1 on a gear 1:5 loads the housing with -(1 - 5) = 4, that is its spring."""
    parts = (
        rotational.ConstantTorque(torque=1.0),
        rotational.Disc(delta_phi=0.2),
        rotational.IdealGear(ratio=5.0, support=rotational.Flange()),
        rotational.SpringDamper(c=50.0, d=5.0),
        rotational.Inertia(J=0.1),
        rotational.SpringDamper(c=20.0, d=2.0),
        rotational.Fixed(),
    )

    solution = simulate(Rig(parts=parts, wiring=wire_held_housing), 20.0, save="end", rtol=1e-8).final.parts
    np.testing.assert_allclose([solution[2].b.tau, solution[2].support.tau], [-5.0, 4.0], rtol=1e-6)
    housing, load = -4.0 / 20.0, 5.0 / 50.0
    np.testing.assert_allclose(solution[4].a.phi, housing, rtol=1e-6)
    np.testing.assert_allclose(solution[2].a.phi - housing, 5.0 * (load - housing), rtol=1e-6)
    np.testing.assert_allclose(solution[1].a.phi, solution[2].a.phi - 0.2, rtol=1e-9)


def wire_held_housing(drive: Any, disc: Any, gear: Any, load: Any, housing: Any, spring: Any, wall: Any) -> Connections:
    return (
        connect(drive.flange, disc.a),
        connect(disc.b, gear.a),
        connect(gear.b, load.b),
        connect(gear.support, housing.a),
        connect(housing.b, spring.b),
        connect(load.a, spring.a, wall.flange),
    )


def wire_rods(front: Any, rod: Any, back: Any, push: Any) -> Connections:
    return connect(push.flange, front.a), connect(front.b, rod.a), connect(rod.b, back.a)


def test_lengths_add_up() -> None:
    """Two bodies on a rod move as one, at the distance of their centres."""
    parts = (
        translational.SlidingMass(m=1.0, L=0.4, s=0.1),
        translational.Rod(L=1.0),
        translational.SlidingMass(m=2.0, L=0.6),
        translational.ConstantForce(force=6.0),
    )
    end = simulate(Rig(parts=parts, wiring=wire_rods), 1.0, save="end").final.parts
    np.testing.assert_allclose([end[0].v, end[2].v], 2.0, rtol=1e-9)
    np.testing.assert_allclose([end[0].s, end[2].s], [0.1 + 1.0, 0.1 + 1.0 + 0.2 + 1.0 + 0.3], rtol=1e-9)
    np.testing.assert_allclose(end[1].a.f, 4.0, rtol=1e-9)
