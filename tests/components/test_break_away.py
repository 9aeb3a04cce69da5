"""Dry friction that breaks away and sticks again while stiff parts swing, against a scheme of small steps."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _rig import Rig
from numpy.typing import NDArray

from acausal import Connections, Scalar, connect, simulate
from components import blocks, rotational, translational

N, END = 24, 1.0
TC, WS, C, ROTOR = 0.4, 0.05, 0.05, 1e-3


def wire(source: Any, push: Any, rotor: Any, spring: Any, load: Any, friction: Any) -> Connections:
    return (
        connect(source.y, push.u),
        connect(push.flange, rotor.a),
        connect(rotor.b, spring.a),
        connect(spring.b, load.a),
        connect(load.b, friction.flange),
    )


def shaken(amplitude: Scalar, frequency: Scalar, J: Scalar, c: Scalar, Ts: Scalar) -> Rig:
    """A rotor, shaken by a torque, swings on a shaft at whose end a load sticks and slides."""
    parts = (
        blocks.Sine(amplitude=amplitude, frequency=frequency),
        rotational.SignalTorque(),
        rotational.Inertia(J=ROTOR),
        rotational.SpringDamper(c=c, d=1e-3 * c),
        rotational.Inertia(J=J),
        rotational.StribeckFriction(Tc=TC, Ts=Ts, ws=WS, C=C),
    )
    return Rig(parts=parts, wiring=wire)


def by_small_steps(cases: tuple[NDArray[Any], ...], steps: int = 40000) -> NDArray[Any]:
    """Final angle of the load; in a step, friction takes at most the whole momentum."""
    amplitude, frequency, J, c, Ts = cases
    dt = END / steps
    rotor, w_rotor, load, w = (np.zeros(N) for _ in range(4))
    for k in range(steps):
        spring = c * (rotor - load) + 1e-3 * c * (w_rotor - w)
        push = amplitude * np.sin(2 * np.pi * frequency * (k + 0.5) * dt)
        w_rotor = w_rotor + dt * (push - spring) / ROTOR
        free = w + dt * spring / J
        level = TC + (Ts - TC) * np.exp(-((w / WS) ** 2)) + C * np.abs(w)
        w = np.sign(free) * np.maximum(np.abs(free) - dt * level / J, 0.0)
        rotor, load = rotor + dt * w_rotor, load + dt * w
    return load


@pytest.mark.thorough
@pytest.mark.computing
def test_break_away_under_a_swinging_torque() -> None:
    draw = np.random.default_rng(0)
    cases = (
        draw.uniform(0.5, 3.0, N),
        draw.uniform(0.3, 3.0, N),
        10.0 ** draw.uniform(-3.0, -1.0, N),
        10.0 ** draw.uniform(1.0, 3.0, N),
        draw.choice([0.4, 0.5, 0.6], N),
    )

    def run(rtol: Scalar, *case: Scalar) -> Any:
        solution = simulate(shaken(*case), END, save="end", rtol=rtol, max_events=256, throw=False)
        return solution.t1, solution.final.parts[4].a.phi

    batch = jax.jit(jax.vmap(run, in_axes=(None, *[0] * len(cases))))
    expected = by_small_steps(cases)
    for rtol in (1e-4, 1e-6, 1e-9):
        t1, phi = batch(rtol, *map(jnp.asarray, cases))
        np.testing.assert_allclose(t1, END)
        np.testing.assert_allclose(phi, expected, atol=2e-3 + 20.0 * rtol, rtol=2e-3)


def held(amplitude: Scalar, frequency: Scalar, start: Scalar, m: Scalar) -> Rig:
    """A mass at rest on a surface that holds up to 1 N, and an alternating force from a time on."""
    parts = (
        blocks.Sine(amplitude=amplitude, frequency=frequency, start_time=start),
        translational.SignalForce(),
        translational.Mass(m=m),
        translational.StribeckFriction(Fc=0.8, Fs=1.0, vs=0.1),
    )
    return Rig(parts=parts, wiring=wire_held)


def wire_held(source: Any, push: Any, mass: Any, friction: Any) -> Connections:
    return connect(source.y, push.u), connect(push.flange, mass.a), connect(mass.b, friction.flange)


@pytest.mark.thorough
def test_breaks_away_in_the_first_period() -> None:
    """For any step size after the time at rest, and any duration for which the force exceeds the break-away force."""
    n, draw = 64, np.random.default_rng(1)
    over, frequency = 10.0 ** draw.uniform(-5.0, 0.5, n), 10.0 ** draw.uniform(-1.0, 4.0, n)
    start, m = 10.0 ** draw.uniform(-2.0, 2.0, n), 10.0 ** draw.uniform(-2.0, 2.0, n)

    def first(amplitude: Scalar, frequency: Scalar, start: Scalar, m: Scalar) -> Any:
        end = start + 10.0 / frequency
        moves = lambda rig: rig.parts[3].acceleration - 1e-6 * amplitude / m  # noqa: E731
        return simulate(held(amplitude, frequency, start, m), end, until=moves, save="end", throw=False).t1 - start

    found = jax.jit(jax.vmap(first))(*map(jnp.asarray, (1.0 + over, frequency, start, m)))
    expected = np.arcsin(1.0 / (1.0 + over)) / (2.0 * np.pi * frequency)
    np.testing.assert_allclose(found * frequency, expected * frequency, atol=1e-4)
