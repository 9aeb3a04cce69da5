"""Piecewise laws: values and derivatives at the default tolerance when a run passes their kinks."""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _rig import Rig
from scipy.interpolate import RegularGridInterpolator

from acausal import Component, Connections, Scalar, Vector, connect, simulate
from components import blocks, electrical, rotational, translational
from components._tables import monotone_cubic
from components.blocks import Input

END = 1.7
FIRST, SECOND = 2.0 * np.pi, 3.1
POINTS, VALUES = jnp.array([-0.9, -0.35, 0.1, 0.4, 0.85]), jnp.array([1.0, -0.5, 0.7, 0.2, 1.3])
GRID = jnp.outer(VALUES, VALUES[:3] ** 2) + POINTS[:, None]
Law = Callable[[np.ndarray, np.ndarray], np.ndarray]


def bilinear(u: np.ndarray, v: np.ndarray) -> np.ndarray:
    table = RegularGridInterpolator((POINTS, POINTS[:3]), GRID, bounds_error=False, fill_value=None)  # pyright: ignore[reportArgumentType]
    return table(np.stack([u, v], axis=-1))


BLOCKS: dict[str, tuple[Component, Law]] = {
    "limiter": (blocks.Limiter(u_min=-0.3, u_max=0.6), lambda u, v: np.clip(u, -0.3, 0.6)),
    "dead zone": (blocks.DeadZone(u_min=-0.3, u_max=0.6), lambda u, v: u - np.clip(u, -0.3, 0.6)),
    "minimum": (blocks.Minimum(), np.minimum),
    "modulation": (blocks.PWMAverage(duty_min=-0.4), lambda u, v: np.clip(u, -0.4, 1.0) * v),
    "switch": (blocks.Switch(threshold=0.2), lambda u, v: np.where(u >= 0.2, v, u)),
    "lines": (
        blocks.Table1D(points=POINTS, values=VALUES, smooth=False),
        lambda u, v: np.interp(u, POINTS, VALUES),
    ),
    "curve": (
        blocks.Table1D(points=POINTS, values=VALUES, extrapolation="linear"),
        lambda u, v: np.asarray(jax.vmap(lambda u: monotone_cubic(u, POINTS, VALUES))(u)),
    ),
    "bilinear": (
        blocks.Table2D(points1=POINTS, points2=POINTS[:3], values=GRID, smooth=False, extrapolation="linear"),
        bilinear,
    ),
}


class Bench(Component):
    """Blocks with one or more inputs, driven by two waves, and the integrals of their outputs."""

    u: blocks.Sine
    v: blocks.Sine
    blocks: tuple[Component, ...]
    integrals: tuple[blocks.Integrator, ...]

    def connections(self) -> Connections:
        made: list[Any] = []
        first, second = [], []
        for block, integral in zip(self.blocks, self.integrals, strict=True):
            inputs = {name: port for name, port in vars(block).items() if isinstance(port, Input)}
            a, *others = [inputs[name] for name in ("control", "duty", "supply", "u", "u1", "u2") if name in inputs]
            first.append(a)
            # What a switch passes: the second wave, and the first one itself.
            second += others[:1]
            first += others[1:]
            made.append(connect(vars(block)["y"], integral.u))
        return (connect(self.u.y, *first), connect(self.v.y, *second), *made)


def bench(amplitude: Scalar) -> Bench:
    return Bench(
        u=blocks.Sine(amplitude=amplitude, frequency=FIRST / (2.0 * np.pi)),
        v=blocks.Sine(amplitude=0.8, frequency=SECOND / (2.0 * np.pi), phase=0.4),
        blocks=tuple(block for block, _ in BLOCKS.values()),
        integrals=tuple(blocks.Integrator() for _ in BLOCKS),
    )


def integrals(amplitude: Scalar) -> Vector:
    solution = simulate(bench(amplitude), END, save="end")
    return jnp.stack([integral.x for integral in solution.final.integrals])


def quadrature(amplitude: float) -> np.ndarray:
    """The same by the trapezoidal rule, with a point on either side of what the switch does."""
    angle = np.arcsin(0.2 / amplitude)
    switched = np.concatenate([angle + FIRST * np.arange(2), np.pi - angle + FIRST * np.arange(2)]) / FIRST
    t = np.union1d(np.linspace(0.0, END, 400_001), np.concatenate([switched - 1e-13, switched + 1e-13]))
    u, v = amplitude * np.sin(FIRST * t), 0.8 * np.sin(SECOND * t + 0.4)
    return np.array([np.trapezoid(law(u, v), t) for _, law in BLOCKS.values()])


@pytest.mark.slow
def test_blocks() -> None:
    """Integrals of their outputs, and their derivatives in both modes, against sums over a fine grid."""
    found, forward = jax.jvp(jax.jit(integrals), (1.1,), (1.0,))
    np.testing.assert_allclose(found, quadrature(1.1), atol=3e-5)
    step = 1e-4
    np.testing.assert_allclose(forward, (quadrature(1.1 + step) - quadrature(1.1 - step)) / (2.0 * step), atol=1e-4)
    weights = jnp.arange(1.0, len(forward) + 1.0)
    backward = jax.grad(lambda amplitude: weights @ integrals(amplitude))(1.1)
    np.testing.assert_allclose(backward, weights @ forward, rtol=1e-9)


def wire_loops(
    wave: Any, swing: Any, slew: Any, control: Any, plant: Any, sensor: Any,
    weight: Any, ball: Any, gap: Any, ground: Any,
    torque: Any, driver: Any, backlash: Any, driven: Any,
    supply: Any, divider: Any, load: Any, capacitor: Any, earth: Any,
) -> Connections:  # fmt: skip
    return (
        connect(wave.y, slew.u, control.u_s, divider.u),
        connect(swing.y, torque.u),
        connect(control.y, plant.u),
        connect(plant.y, sensor.u),
        connect(sensor.y, control.u_m),
        connect(weight.flange, ball.a, gap.b),
        connect(gap.a, ground.flange),
        connect(torque.flange, driver.a),
        connect(driver.b, backlash.a),
        connect(backlash.b, driven.a),
        connect(supply.p, divider.p),
        connect(divider.contact, load.p),
        connect(load.n, capacitor.p),
        connect(supply.n, divider.n, capacitor.n, earth.p),
    )


def loops(scale: Scalar) -> Rig:
    """A follower, a controlled plant, a ball that bounces, a play that is turned to and fro, a divider with a load."""
    return Rig(
        parts=(
            blocks.Sine(amplitude=scale, frequency=1.0, offset=0.2),
            blocks.Sine(amplitude=scale, frequency=1.3),
            blocks.SlewRateLimiter(rising=3.0, falling=2.0, Td=0.02),
            blocks.LimPID(k=5.0 * scale, Ti=0.5, Td=0.1, y_min=-1.0, y_max=1.1),
            blocks.FirstOrder(T=0.3, k=2.0),
            blocks.FirstOrder(T=0.1),
            translational.ConstantForce(force=-9.81),
            translational.Mass(m=1.0, a=translational.Flange(s=0.5)),
            translational.ElastoGap(c=2e4 * scale, d=20.0, n=1.5),
            translational.Fixed(),
            rotational.SignalTorque(),
            rotational.Inertia(J=0.1),
            rotational.ElastoBacklash(c=100.0, d=0.5, play=0.4 * scale),
            rotational.Inertia(J=0.05),
            electrical.ConstantVoltage(V=10.0),
            electrical.Potentiometer(R=100.0 * scale),
            electrical.Resistor(R=300.0),
            electrical.Capacitor(C=1e-3),
            electrical.Ground(),
        ),
        wiring=wire_loops,
    )


@jax.jit
def ends(scale: Scalar, rtol: Scalar) -> Vector:
    parts = simulate(loops(scale), 1.2, rtol=rtol, save="end").final.parts
    return jnp.stack([parts[2].x, parts[4].x, parts[7].v, parts[13].w, parts[17].v])


@pytest.mark.slow
def test_loops() -> None:
    """Ends of a run at the default tolerance, and both derivatives of them, against runs with a tight tolerance."""
    exact = ends(1.0, 1e-11)
    found, forward = jax.jvp(lambda scale: ends(scale, 1e-6), (1.0,), (1.0,))
    np.testing.assert_allclose(found, exact, rtol=1e-4)
    step = 1e-5
    slopes = (ends(1.0 + step, 1e-11) - ends(1.0 - step, 1e-11)) / (2.0 * step)
    np.testing.assert_allclose(forward, slopes, rtol=1e-3)
    weights = jnp.arange(1.0, len(forward) + 1.0)
    backward = jax.grad(lambda scale: weights @ ends(scale, 1e-6))(1.0)
    np.testing.assert_allclose(backward, weights @ forward, rtol=1e-9)


def wire_rest(
    level: Any, limiter: Any, lag: Any, limited: Any, ramp: Any, slew: Any, other: Any, larger: Any, table: Any,
    zone: Any, store: Any, push: Any, held: Any, bristles: Any,
) -> Connections:  # fmt: skip
    return (
        connect(level.y, limiter.u, lag.u, other.u, table.u),
        connect(lag.y, limited.u, larger.u1),
        connect(other.y, larger.u2),
        connect(ramp.y, slew.u),
        connect(store.y, zone.u),
        connect(zone.y, store.u),
        connect(push.flange, held.a),
        connect(held.b, bristles.flange),
    )


@pytest.mark.thorough
def test_what_rests_on_a_kink_does_not_chatter() -> None:
    """Signals at, or tending to, a kink: a limit, a rate limit, another signal, a sample, the end of a dead zone."""
    parts = (
        blocks.Constant(k=0.7),
        blocks.Limiter(u_min=-1.0, u_max=0.7),
        blocks.FirstOrder(T=0.1),
        blocks.Limiter(u_min=-1.0, u_max=0.7),
        blocks.Ramp(height=3.0, duration=3.0),
        blocks.SlewRateLimiter(rising=1.0, falling=1.0, Td=0.01),
        blocks.FirstOrder(T=0.1),
        blocks.Maximum(),
        blocks.Table1D(points=jnp.array([0.0, 0.7, 1.0]), values=jnp.array([0.0, 1.0, 0.0]), smooth=False),
        blocks.DeadZone(u_min=-0.1, u_max=0.3),
        blocks.Integrator(k=-5.0, x=2.0),
        translational.ConstantForce(force=0.9),
        translational.Mass(m=1.0),
        translational.LuGreFriction(Fc=1.0, Fs=1.5, vs=0.1, stiffness=1e4, damping=50.0),
    )
    solution = simulate(Rig(parts=parts, wiring=wire_rest), 20.0, save="end")
    assert solution.stats["num_steps"] < 200
    _, limiter, _, limited, _, slew, _, larger, table, _, store, _, _, bristles = solution.final.parts
    np.testing.assert_allclose(
        [limiter.y.value, limited.y.value, slew.x, larger.y.value, table.y.value, store.x, bristles.z],
        [0.7, 0.7, 3.0, 0.7, 1.0, 0.3, 0.9e-4], atol=1e-5,
    )  # fmt: skip
