"""A gear with mesh and bearing losses under a reversing load."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _rig import Rig
from jax import Array
from numpy.typing import NDArray

from acausal import Connections, ParameterError, Scalar, connect, simulate
from components import blocks, rotational

RATIO, MOTOR, LOAD, END, N = 3.0, 0.02, 0.3, 2.0, 24


def losses(*row: Scalar) -> Array:
    return jnp.stack([jnp.zeros(()), *map(jnp.asarray, row)])[None]


def bearing_at_a(eta1: Any, eta2: Any, bearing1: Any, bearing2: Any) -> Any:
    """The friction of the bearings at a, by bearing1 = eta1 at_a + at_b and bearing2 = at_a / eta2 + at_b."""
    return (bearing1 - bearing2) / (eta1 - 1.0 / eta2)


def at_b(tau_a: Any, direction: Any, eta1: Any, eta2: Any, bearing1: Any, bearing2: Any) -> Any:
    """Transmitted torque x = tau_a minus the losses, with the driver as in MSL."""
    tau_eta = tau_a - direction * bearing_at_a(eta1, eta2, bearing1, bearing2)
    a_drives = tau_eta * direction > 0.0
    return np.where(a_drives, eta1, 1.0 / eta2) * tau_a - direction * np.where(a_drives, bearing1, bearing2)


def wire_driven(source: Any, gear: Any, load: Any) -> Connections:
    return (connect(source.flange, gear.a), connect(gear.b, load.flange))


def test_steady_torque_is_that_of_msl_and_continuous() -> None:
    """Forward and backward, each with a driving and with b driving, at a speed between the rows of a table."""
    slow, fast = np.array([0.9, 0.6, 0.1, 0.3]), np.array([0.8, 0.5, 0.2, 0.25])
    table = jnp.array([[0.0, *slow], [5.0, *fast]])
    speeds, row = np.array([2.0, -2.0]), slow + 0.4 * (fast - slow)
    at_switch = at_b(bearing_at_a(*row), 1.0, *row)  # of x, forward; backward it is at -at_switch
    near = np.array([1e-3, 1e-6])
    x = np.concatenate(
        [np.linspace(-2.0, 2.0, 41), *(m * at_switch + s * near for m in (1.0, -1.0) for s in (1.0, -1.0))]
    )

    def torque(speed: Scalar, x: Scalar) -> tuple[Scalar, Scalar]:
        parts = (
            rotational.ConstantSpeed(speed=speed),
            rotational.LossyGear(ratio=RATIO, losses=table),
            rotational.ConstantTorque(torque=-RATIO * x),
        )
        gear = simulate(Rig(parts=parts, wiring=wire_driven), 0.01, save="end").final.parts[1]
        return gear.a.tau, gear.x

    found, ideal = jax.jit(jax.vmap(jax.vmap(torque, in_axes=(None, 0)), in_axes=(0, None)))(speeds, x)
    np.testing.assert_allclose(ideal, np.broadcast_to(x, ideal.shape), rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(at_b(found, np.sign(speeds)[:, None], *row), ideal, atol=1e-9)
    assert np.all((found - ideal) * speeds[:, None] > 0.0)
    for at, tau in zip(ideal, found, strict=True):
        order = np.argsort(at)
        steps, rises = np.diff(at[order]), np.diff(tau[order])
        assert np.all(rises <= steps / row[0] + 1e-9)
        assert np.all(rises >= steps * row[1] - 1e-9)


def wire(source: Any, push: Any, motor: Any, gear: Any, wheel: Any, load: Any) -> Connections:
    return (
        connect(source.y, push.u),
        connect(push.flange, motor.a),
        connect(motor.b, gear.a),
        connect(gear.b, wheel.a),
        connect(wheel.b, load.flange),
    )


def shaken(amplitude: Scalar, frequency: Scalar, torque: Scalar, *row: Scalar) -> Rig:
    parts = (
        blocks.Sine(amplitude=amplitude, frequency=frequency),
        rotational.SignalTorque(),
        rotational.Inertia(J=MOTOR),
        rotational.LossyGear(ratio=RATIO, losses=losses(*row)),
        rotational.Inertia(J=LOAD),
        rotational.ConstantTorque(torque=torque),
    )
    return Rig(parts=parts, wiring=wire)


def draw() -> tuple[NDArray[Any], ...]:
    """Amplitude, frequency, load and losses of ordinary gears."""
    draw = np.random.default_rng(0)
    ranges = ((0.5, 4.0), (0.3, 2.0), (-3.0, 3.0), (0.5, 0.95), (0.3, 0.95), (0.0, 0.3), (0.0, 0.3))
    return tuple(draw.uniform(low, high, N) for low, high in ranges)


def by_small_steps(cases: tuple[NDArray[Any], ...], steps: int = 20000) -> tuple[NDArray[Any], NDArray[Any]]:
    """The speed at the end and the energy lost, with the motion and the driver by trial in every step."""
    amplitude, frequency, torque, eta1, eta2, bearing1, bearing2 = cases
    at_a = bearing_at_a(eta1, eta2, bearing1, bearing2)
    wheel, load, dt = LOAD / RATIO**2, torque / RATIO, END / steps

    def accelerations(push: Any, direction: float) -> Any:
        """Acceleration of a from x = eta tau_a - bearing, with tau_a = push - MOTOR a and x = wheel a - load."""
        found = np.full(N, np.nan)
        for eta, bearing, sign in ((eta1, bearing1, direction), (1.0 / eta2, bearing2, -direction)):
            a = (eta * push - direction * bearing + load) / (wheel + eta * MOTOR)
            found = np.where(sign * (push - MOTOR * a - direction * at_a) >= 0.0, a, found)
        assert not np.any(np.isnan(found))
        return found

    w, lost = np.zeros(N), np.zeros(N)
    for k in range(steps):
        push = amplitude * np.sin(2 * np.pi * frequency * (k + 0.5) * dt)
        forward, backward = accelerations(push, 1.0), accelerations(push, -1.0)
        from_rest = np.where(forward > 0.0, forward, np.where(backward < 0.0, backward, 0.0))
        a = np.where(w > 0.0, forward, np.where(w < 0.0, backward, from_rest))
        to_rest = np.clip(np.where(a * w < 0.0, -w / np.where(a == 0.0, 1.0, a), dt), 0.0, dt)
        stopped = np.where(to_rest < dt, 0.0, w + dt * a)
        for slope, h, end in ((a, to_rest, stopped), (from_rest, dt - to_rest, stopped + (dt - to_rest) * from_rest)):
            lost += h * 0.5 * (w + end) * (push - (MOTOR + wheel) * slope + load)
            w = end
    return w, lost


@pytest.mark.thorough
def test_load_reverses_under_a_swinging_torque() -> None:
    cases = draw()

    def run(*case: Scalar) -> Any:
        solution = simulate(shaken(*case), END, save="end", rtol=1e-10, max_events=128, energy=True, throw=False)
        return solution.t1, solution.final.parts[2].w, solution.energy.dissipated["parts[3]"], solution.energy.imbalance

    t1, w, lost, imbalance = jax.jit(jax.vmap(run))(*map(jnp.asarray, cases))
    by_steps, lost_by_steps = by_small_steps(cases)
    np.testing.assert_allclose(t1, END)
    np.testing.assert_allclose(w, by_steps, atol=2e-6)
    np.testing.assert_allclose(lost, lost_by_steps, atol=2e-6)
    np.testing.assert_allclose(imbalance, 0.0, atol=1e-6)
    assert np.all(lost >= 0.0)


@pytest.mark.thorough
def test_gradients_through_reversals() -> None:
    """Both modes, along random directions, against differences."""
    cases = jnp.stack([jnp.asarray(values) for values in draw()], axis=1)
    ways = jnp.asarray(np.random.default_rng(1).normal(size=cases.shape))

    def at_end(case: Any) -> Any:
        return simulate(shaken(*case), END, save="end", rtol=1e-9, max_events=128).final.parts[2].w

    along = jax.jit(jax.vmap(lambda case, way: jax.jvp(at_end, (case,), (way,))))
    slopes = jax.jit(jax.vmap(jax.grad(at_end)))(cases)
    _, forward = along(cases, ways)
    size = np.linalg.norm(slopes, axis=1) * np.linalg.norm(ways, axis=1)
    np.testing.assert_allclose(np.sum(slopes * ways, axis=1) / size, forward / size, atol=1e-9)
    high, low = (along(cases + step * ways, ways)[0] for step in (1e-5, -1e-5))
    np.testing.assert_allclose((high - low) / 2e-5 / size, forward / size, atol=1e-5)


def test_bearings_that_would_give_power_are_refused() -> None:
    with pytest.raises(ParameterError, match="losses must have bearing2 at most"):
        rotational.LossyGear(ratio=1.0, losses=losses(0.5, -1.0, 0.1, 0.5))
    rotational.LossyGear(ratio=1.0, losses=losses(0.5, -1.0, 0.1, 0.3))
