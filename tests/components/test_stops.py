"""Rigid stops: bouncing, resting, lifting off, against closed forms."""

import math
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _rig import Rig

from acausal import Component, Connections, ParameterError, Scalar, connect, simulate
from acausal.testing import check_power_balance
from components import blocks, hydraulic, rotational, translational

TIGHT = 1e-10
G = 9.81
TINY = {"parts[1].v": 1e-6}


def wire_drop(weight: Any, ball: Any, floor: Any) -> Connections:
    return connect(weight.flange, ball.a), connect(ball.b, floor.flange)


def drop(e: Scalar, end: float, rest: float = 0.3) -> Any:
    """A ball of 2 kg dropped from 1 m."""
    weight = translational.ConstantForce(force=-2.0 * G)
    ball = translational.Mass(m=2.0, a=translational.Flange(s=1.0))
    floor = translational.HardStop(s_min=0.0, restitution=e, rest=rest)
    return simulate(Rig(parts=(weight, ball, floor), wiring=wire_drop), end, save="end", rtol=TIGHT)


def impacts(e: float, count: int) -> np.ndarray:
    """t_0 = sqrt(2 h / g), and from impact to impact 2 e^k v_0 / g."""
    v0 = math.sqrt(2.0 * G)
    return v0 / G * (1.0 + 2.0 * np.cumsum(np.concatenate([[0.0], e ** np.arange(1, count)])))


def height(e: Scalar, end: Scalar) -> Scalar:
    """After the second impact and before the third."""
    v0 = jnp.sqrt(2.0 * G)
    t = end - v0 / G * (1.0 + 2.0 * e)
    return e**2 * v0 * t - 0.5 * G * t**2


def test_bouncing_ball_comes_to_rest() -> None:
    """Speeds after impacts 4.43 e^k: the rebound that would be slower than 0.3 m/s is not made."""
    solution = drop(0.5, 3.0)
    count = 1 + math.ceil(math.log(0.3 / math.sqrt(2.0 * G), 0.5)) - 1
    times = np.asarray(solution.events.times)
    np.testing.assert_allclose(times[np.isfinite(times)], impacts(0.5, count), atol=1e-8)
    _, ball, floor = solution.final.parts
    np.testing.assert_allclose([ball.b.s, ball.v, floor.f], [0.0, 0.0, -2.0 * G], atol=1e-8)
    assert floor.mode == -1.0


@pytest.mark.slow
def test_gradient_through_impacts() -> None:
    final = lambda e: drop(e, 1.3, 0.0).final.parts[1].b.s  # noqa: E731
    value, backward = jax.value_and_grad(final)(0.6)
    np.testing.assert_allclose(value, height(0.6, 1.3), atol=1e-8)
    expected = jax.grad(height)(0.6, 1.3)
    np.testing.assert_allclose(backward, expected, rtol=1e-6)
    np.testing.assert_allclose(jax.jacfwd(final)(0.6), expected, rtol=1e-6)


@pytest.mark.thorough
def test_a_batch_with_different_numbers_of_impacts() -> None:
    e = jnp.array([0.0, 0.6, 1.0])
    found = jax.vmap(lambda e: drop(e, 1.3).final.parts[1].b.s)(e)
    np.testing.assert_allclose(found[:2], [0.0, float(height(0.6, 1.3))], atol=1e-8)
    elastic = math.sqrt(2.0 * G) * (1.3 - impacts(1.0, 1)[0]) - 0.5 * G * (1.3 - impacts(1.0, 1)[0]) ** 2
    np.testing.assert_allclose(found[2], elastic, atol=1e-8)


def wire_spool(ramp: Any, drive: Any, spool: Any, spring: Any, wall: Any, stop: Any) -> Connections:
    return (
        connect(ramp.y, drive.u),
        connect(drive.flange, spool.a),
        connect(spool.b, spring.b, stop.flange),
        connect(spring.a, wall.flange),
    )


@pytest.mark.slow
def test_preloaded_spool_lifts_and_reaches_its_other_stop() -> None:
    """Pushed by 40 N/s t against 10 N of preload: it lifts at 0.25 s, and then m dv/dt = 40 t' - c s."""
    m, c, preload, rate, end = 0.1, 200.0, 10.0, 40.0, 0.02
    parts = (
        blocks.Ramp(height=rate, duration=1.0),
        translational.SignalForce(),
        translational.Mass(m=m),
        translational.Spring(c=c, s_rel0=-preload / c),
        translational.Fixed(),
        translational.HardStop(s_min=0.0, s_max=end),
    )
    solution = simulate(Rig(parts=parts, wiring=wire_spool), 0.6, save=jnp.array([0.2, 0.3, 0.6]), rtol=TIGHT)
    omega, t = math.sqrt(c / m), 0.05
    lift = rate / c * (t - math.sin(omega * t) / omega)
    np.testing.assert_allclose(solution.parts[2].b.s, [0.0, lift, end], atol=1e-8)
    np.testing.assert_allclose(solution.parts[5].f[0], rate * 0.2 - preload, atol=1e-8)
    np.testing.assert_allclose(solution.parts[5].f[2], rate * 0.6 - preload - c * end, atol=1e-8)
    found = dict(zip(solution.events.names, np.asarray(solution.events.times), strict=False))
    np.testing.assert_allclose(found["parts[5].lift_low"], preload / rate, atol=1e-8)


def wire_rub(force: Any, body: Any) -> Connections:
    return (connect(force.flange, body.a),)


@pytest.mark.slow
def test_mass_with_stop_and_friction() -> None:
    """It is driven by 10 N - 4 N, hits the stop at s_max with v = sqrt(2 a s), and is held there."""
    body = translational.MassWithStopAndFriction(m=2.0, L=0.4, s_min=-1.0, s_max=1.7, F_Coulomb=4.0)
    model = Rig(parts=(translational.ConstantForce(force=10.0), body), wiring=wire_rub)
    solution = simulate(model, 2.0, save=jnp.array([0.5, 2.0]), rtol=TIGHT)
    body = solution.parts[1]
    np.testing.assert_allclose(body.s, [0.5 * 3.0 * 0.25, 1.5], atol=1e-8)
    np.testing.assert_allclose(body.v, [1.5, 0.0], atol=1e-8)
    found = dict(zip(solution.events.names, np.asarray(solution.events.times), strict=False))
    np.testing.assert_allclose(found["parts[1].impact_high"], 1.0, atol=1e-8)


def wire_cylinder(source: Any, cylinder: Any, piston: Any) -> Connections:
    return connect(source.port, cylinder.port), connect(cylinder.rod, piston.a)


@pytest.mark.thorough
def test_cylinder_onto_its_end() -> None:
    """Under constant pressure, m a = A p: at the end after sqrt(2 stroke / a), where the end takes the force."""
    cylinder = hydraulic.StoppedCylinder(bore=0.02, stroke=0.05)
    area = math.pi / 4.0 * 0.02**2
    parts = (hydraulic.ConstantPressure(pressure=1e5), cylinder, translational.Mass(m=5.0))
    solution = simulate(Rig(parts=parts, wiring=wire_cylinder), 0.5, save="end", rtol=TIGHT)
    np.testing.assert_allclose(solution.events.times[0], math.sqrt(2.0 * 0.05 * 5.0 / (area * 1e5)), atol=1e-8)
    final = solution.final.parts
    np.testing.assert_allclose([final[2].b.s, final[2].v], [0.05, 0.0], atol=1e-8)
    np.testing.assert_allclose(final[1].stop.f, area * 1e5, rtol=1e-8)


def wire_shaft(drive: Any, rotor: Any, gear: Any, stop: Any) -> Connections:
    return connect(drive.flange, rotor.a), connect(rotor.b, gear.a), connect(gear.b, stop.flange)


@pytest.mark.thorough
def test_rotor_behind_a_gear_bounces_between_stops() -> None:
    """Without torque and loss it runs forth and back: the stop at the gear turns the rotor's speed as well."""
    parts = (
        rotational.ConstantTorque(torque=0.0),
        rotational.Inertia(J=0.1, w=8.0),
        rotational.IdealGear(ratio=4.0),
        rotational.HardStop(phi_min=-1.0, phi_max=1.0, restitution=0.5),
    )
    solution = simulate(Rig(parts=parts, wiring=wire_shaft), 3.5, save="end", rtol=TIGHT)
    times = np.asarray(solution.events.times)
    np.testing.assert_allclose(times[np.isfinite(times)], [0.5, 2.5], atol=1e-8)
    final = solution.final.parts
    np.testing.assert_allclose([final[1].w, final[3].flange.phi], [2.0, -0.5], atol=1e-8)


STOPPED = (
    translational.HardStop(s_min=-0.4, s_max=0.4),
    rotational.HardStop(phi_min=-0.4, phi_max=0.4),
    translational.MassWithStopAndFriction(m=1.3, s_min=-0.4, s_max=0.4, F_Coulomb=0.4),
)


@pytest.mark.parametrize("stop", STOPPED, ids=["translational", "rotational", "with friction"])
def test_stops_generate_nothing_that_they_do_not_declare(stop: Component) -> None:
    """Among the points are some at which a stop draws a body back that is far beyond it, against a load."""
    for seed in (1, 2, 3):
        check_power_balance(stop, sizes=1.0, points=32, seed=seed)


def wire_overlap(weight: Any, ball: Any, floor: Any, ground: Any) -> Connections:
    return connect(weight.flange, ball.a), connect(ball.b, floor.b), connect(floor.a, ground.flange)


@pytest.mark.parametrize("is_contact", [False, True])
def test_work_of_a_start_beyond_a_stop_is_supplied(is_contact: bool) -> None:
    """It lifts a load of 500 N, which starts at -1 mm, by 1 mm (1 - exp(-t/100 s)), because LAG DRAW = 1/(100 s)."""
    weight, ball = translational.ConstantForce(force=-500.0), translational.Mass(m=2.0, s=-1e-3)
    parts: tuple[Any, ...] = (weight, ball, translational.HardStop(s_min=0.0))
    if is_contact:
        parts = (weight, ball, translational.RigidContact(), translational.Fixed())
    wiring = wire_overlap if is_contact else wire_drop
    solution = simulate(Rig(parts=parts, wiring=wiring), 5.0, save="end", energy=True, rtol=1e-8, nominal=TINY)
    supplied = solution.energy.supplied["parts[2]"]
    np.testing.assert_allclose(supplied, 500.0 * 1e-3 * -math.expm1(-0.05), rtol=1e-3)
    assert abs(solution.energy.imbalance) < 1e-6 * supplied


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("values", "message"),
    [
        (dict(s_min=1.0, s_max=0.0), "HardStop.s_min must be smaller than s_max"),
        (dict(restitution=1.1), "HardStop.restitution must be at most 1"),
    ],
)
def test_bad_parameters(values: dict[str, Any], message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        translational.HardStop(**values)
