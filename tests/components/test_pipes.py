"""Pipes: water hammer against the method of characteristics and published figures, natural frequencies, steady flow."""

from collections.abc import Callable
from typing import Any

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from acausal import Component, Connections, ParameterError, connect, initialise, linearise, replace, simulate
from components.blocks import Ramp
from components.hydraulic import (
    BlasiusFriction,
    ChurchillFriction,
    ConstantPressure,
    FrictionMemory,
    LaminarFriction,
    LinearLiquid,
    Liquid,
    NoFriction,
    Pipe,
    PipeFriction,
    SignalFlow,
    UnsteadyFrictionPipe,
    iso_vg_46,
)

LENGTH, DIAMETER, DENSITY, MODULUS, RESERVOIR, CLOSING = 20.0, 0.01, 1060.0, 1.5e9, 5e6, 0.02
AREA = 0.25 * np.pi * DIAMETER**2
SPEED = np.sqrt(MODULUS / DENSITY)  # of sound
LAMINAR, TURBULENT = (1.0, 15e-6), (2.0, 2e-6)  # speed of the flow in m/s, kinematic viscosity in m2/s
EXPLICIT = diffrax.Tsit5()  # waves are not stiff


class Hammer(Component):
    """A reservoir, a pipe, and a valve that closes evenly."""

    reservoir: ConstantPressure
    pipe: Pipe | UnsteadyFrictionPipe
    closing: Ramp
    valve: SignalFlow = SignalFlow()

    def connections(self) -> Connections:
        return (
            connect(self.reservoir.port, self.pipe.a),
            connect(self.pipe.b, self.valve.port),
            connect(self.closing.y, self.valve.u),
        )


def gradient(friction: PipeFriction, v: float, nu: float) -> float:
    """Pressure lost per metre in steady flow."""
    ratio = float(jnp.asarray(friction.ratio(jnp.asarray(v * DIAMETER / nu), DIAMETER)))
    return 32.0 * DENSITY * nu * v / DIAMETER**2 * ratio


def hammer(n: int, friction: PipeFriction, flow: tuple[float, float], memory: FrictionMemory | None = None) -> Hammer:
    v, nu = flow
    args: dict[str, Any] = dict(
        n=n, length=LENGTH, diameter=DIAMETER, friction=friction, q=v * AREA,
        liquid=LinearLiquid(density=DENSITY, bulk_modulus=MODULUS, viscosity=nu),
        p=RESERVOIR - gradient(friction, v, nu) * np.linspace(0.0, LENGTH, n + 1),
    )  # fmt: skip
    return Hammer(
        reservoir=ConstantPressure(pressure=RESERVOIR),
        pipe=Pipe(**args) if memory is None else UnsteadyFrictionPipe(memory=memory, **args),
        closing=Ramp(height=v * AREA, duration=CLOSING, offset=-v * AREA),
    )


def characteristics(friction: PipeFriction, flow: tuple[float, float], n: int = 400) -> tuple[np.ndarray, np.ndarray]:
    """Times and pressures at the valve by the method of characteristics (Wylie, Streeter), of second order.

    dp +- rho c dv +- c R(v) dt = 0 along dx = +- c dt, the friction as a mean of both ends with the speed of a first
    guess at the new one.
    """
    v0, nu = flow
    step, z = LENGTH / n / SPEED, DENSITY * SPEED
    v, p = np.full(n + 1, v0), RESERVOIR - gradient(friction, v0, nu) * np.linspace(0.0, LENGTH, n + 1)
    ratio = jax.jit(lambda re: friction.ratio(re, DIAMETER))

    def lost(v: np.ndarray) -> np.ndarray:
        return 32.0 * DENSITY * nu / DIAMETER**2 * v * np.asarray(ratio(np.abs(v) * DIAMETER / nu)) * LENGTH / n

    times = step * np.arange(round(4.5 * 4.0 * LENGTH / SPEED / step) + 1)
    found = [p[-1]]
    for t in times[1:]:
        old, new = lost(v), lost(v)
        next_p, next_v = np.empty(n + 1), np.empty(n + 1)
        for _ in range(2):
            plus = p[:-1] + z * v[:-1] - 0.5 * (old[:-1] + new[1:])  # on the way to b
            minus = p[1:] - z * v[1:] + 0.5 * (old[1:] + new[:-1])  # on the way to a
            next_p[1:-1], next_v[1:-1] = 0.5 * (plus[:-1] + minus[1:]), 0.5 * (plus[:-1] - minus[1:]) / z
            next_p[0], next_v[0] = RESERVOIR, (RESERVOIR - minus[0]) / z
            next_v[-1] = v0 * max(1.0 - t / CLOSING, 0.0)
            next_p[-1] = plus[-1] - z * next_v[-1]
            new = lost(next_v)
        p, v = next_p, next_v
        found.append(p[-1])
    return times, np.array(found)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("friction", "flow"), [(LaminarFriction(), LAMINAR), (ChurchillFriction(), TURBULENT)], ids=["laminar", "turbulent"]
)
def test_water_hammer(friction: PipeFriction, flow: tuple[float, float]) -> None:
    """Rise, period and decay over four periods, to 1 % of Joukowsky's rise; and to 2 % the corners of the wave, which
    are as sharp as those of the closing.
    """
    times, wanted = characteristics(friction, flow)
    sol = simulate(hammer(100, friction, flow), times[-1], save=jnp.asarray(times), solver=EXPLICIT)
    found, rise = np.asarray(sol["pipe.p_b"]), DENSITY * SPEED * flow[0]
    assert np.max(np.abs(found - wanted)) < 0.02 * rise
    assert np.sqrt(np.mean((found - wanted) ** 2)) < 0.005 * rise
    # The valve closes before the wave comes back: the whole rise, and what friction took before.
    assert rise < found.max() - found[0] < rise + gradient(friction, *flow) * LENGTH
    crossings = [_last_rise(times, trace - RESERVOIR) for trace in (found, wanted)]
    assert crossings[0] == pytest.approx(crossings[1], rel=1e-3)
    period = 4.0 * LENGTH / SPEED
    peaks = [
        [trace[(times > k * period) & (times < (k + 1) * period)].max() for k in range(4)] for trace in (found, wanted)
    ]
    np.testing.assert_allclose(*np.subtract(peaks, RESERVOIR), rtol=0.02)


def _last_rise(times: np.ndarray, signal: np.ndarray) -> float:
    i = np.flatnonzero((signal[:-1] < 0.0) & (signal[1:] >= 0.0))[-1]
    return float(times[i] - signal[i] * (times[i + 1] - times[i]) / (signal[i + 1] - signal[i]))


# Pressures at the valve at (0.3 + 0.8 i) length/speed of sound, by the Laplace transform and by characteristics.
PUBLISHED = (
    (NoFriction(), LAMINAR, None, (5318000.0, 6166000.0, 6260952.021292, 4776952.021292)),
    (LaminarFriction(), LAMINAR, None, (5218160.84572, 6089927.428317, 6224684.457096, 4875069.752823)),
    (LaminarFriction(), LAMINAR, "kagawa", (5229895.050496, 6163475.383707, 6338926.12126, 5226231.890199)),
    (BlasiusFriction(), TURBULENT, None, (5505993.328395, 7242366.759033, 7485419.440963, 4677065.60062)),
)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("friction", "flow", "memory", "wanted"), PUBLISHED, ids=["none", "laminar", "zielke", "blasius"]
)
def test_published_water_hammer(
    friction: PipeFriction, flow: tuple[float, float], memory: str | None, wanted: tuple[float, ...]
) -> None:
    rig = hammer(100, friction, flow, FrictionMemory.kagawa() if memory else None)
    times = (0.3 + 0.8 * np.arange(4)) * LENGTH / SPEED
    sol = simulate(rig, times[-1], save=jnp.asarray(times), solver=EXPLICIT)
    np.testing.assert_allclose(sol["pipe.p_b"], wanted, atol=0.01 * DENSITY * SPEED * flow[0])


@pytest.mark.thorough
def test_natural_frequencies() -> None:
    """n segments with half a capacity at each end, open at one end: 2/sqrt(l c) sin((2 k - 1) pi/(4 n))."""
    n = 5
    rig = replace(hammer(n, LaminarFriction(), LAMINAR), {"closing.height": 0.0, "closing.offset": 0.0})
    rig = replace(rig, {"pipe.p_inner": jnp.full(n - 1, RESERVOIR), "pipe.p_b": RESERVOIR, "pipe.q": jnp.zeros(n)})
    found = linearise(rig).poles
    waves, decays = np.imag(found), np.real(found)
    k = np.arange(1, n + 1)
    natural = 2.0 * SPEED * n / LENGTH * np.sin((2 * k - 1) * np.pi / (4 * n))
    decay = 16.0 * LAMINAR[1] / DIAMETER**2
    np.testing.assert_allclose(np.sort(waves[waves > 0.0]), np.sqrt(natural**2 - decay**2), rtol=1e-9)
    np.testing.assert_allclose(decays, -decay, rtol=1e-6)


@pytest.mark.thorough
def test_steady_laminar_flow() -> None:
    """The law of Hagen and Poiseuille."""
    rig = hammer(8, ChurchillFriction(), LAMINAR)
    rest = initialise(
        replace(rig, {"closing.height": 0.0, "pipe.p_inner": None, "pipe.p_b": None, "pipe.q": None}), steady=True
    )
    v, nu = LAMINAR
    lost = 32.0 * nu * DENSITY * LENGTH * v / DIAMETER**2
    assert RESERVOIR - float(rest.pipe.p_b) == pytest.approx(lost, rel=1e-9)


def test_friction_factors() -> None:
    """Darcy's f of the Moody chart: laminar; smooth pipes by Blasius; rough ones by Colebrook and White."""
    diameter = 0.02
    smooth, rough = ChurchillFriction(roughness=0.0), ChurchillFriction(roughness=2e-4)
    for law in (smooth, rough, BlasiusFriction()):
        np.testing.assert_allclose(law.ratio(jnp.array([0.0, 1e-3, 1.0, 500.0]), diameter), 1.0, rtol=1e-4)

    def factor(law: PipeFriction, re: float) -> float:
        return float(64.0 / re * jnp.asarray(law.ratio(jnp.asarray(re), diameter)))

    assert factor(smooth, 1e4) == pytest.approx(0.3164 * 1e4**-0.25, rel=0.03)
    assert factor(BlasiusFriction(), 1e4) == pytest.approx(0.3164 * 1e4**-0.25, rel=1e-6)
    for re, wanted in ((1e5, 0.0385), (1e6, 0.0380)):  # Colebrook and White for a relative roughness of 0.01
        assert factor(rough, re) == pytest.approx(wanted, rel=0.03)


@pytest.mark.thorough
def test_a_program_does_not_grow_with_the_segments() -> None:
    """Below some ten states, matrices are inverted in another way."""

    def equations(n: int) -> int:
        rig = hammer(n, ChurchillFriction(), TURBULENT)
        return str(jax.make_jaxpr(lambda rig: simulate(rig, 0.1, save="end").final.pipe.p_b)(rig)).count(" = ")

    assert equations(200) == equations(100)


@pytest.mark.thorough
def test_a_gradient_does_not_grow_with_the_segments() -> None:
    """The program of all derivatives along parameters; below some ten states, matrices are inverted in another way."""

    def equations(n: int) -> int:
        rig = hammer(n, ChurchillFriction(), TURBULENT)
        rig = replace(rig, {"pipe.p_inner": None, "pipe.p_a": None, "pipe.p_b": None, "pipe.q": None})
        slope = jax.grad(lambda rig: jnp.asarray(simulate(rig, 0.1, save="end").final.pipe.p_b))
        return str(jax.make_jaxpr(slope)(rig)).count(" = ")

    assert equations(200) == equations(100)


@pytest.mark.thorough
def test_column_separation() -> None:
    """A flow that is cut off at the near end runs on and leaves vapour: the pressure stays above that of the vapour,
    what is left in the pipe is what has not flown out, and the column that comes back shuts the void with a blow.
    """
    oil: Liquid = iso_vg_46(air=1e-3)
    n, v = 10, 1.0
    rig = Hammer(
        reservoir=ConstantPressure(pressure=2e5),
        pipe=Pipe(n=n, length=LENGTH, diameter=DIAMETER, liquid=oil, friction=NoFriction(), p=2e5, q=-v * AREA),
        closing=Ramp(height=-v * AREA, duration=0.005, offset=v * AREA),
    )
    sol = simulate(rig, 0.2, save="steps", energy=True, solver=EXPLICIT)
    at_valve, atmosphere = np.asarray(sol["pipe.p_b"]), float(oil.atmosphere)
    assert at_valve.min() > float(oil.vapour_pressure) - atmosphere
    assert at_valve.min() < -0.9 * atmosphere
    assert at_valve.max() > 8e5
    assert abs(float(sol.energy.imbalance)) < 1e-3 * 0.5 * DENSITY * AREA * LENGTH * v**2


GRADIENT_OF = ("pipe.length", "pipe.diameter", "pipe.wall", "pipe.liquid.air", "pipe.liquid.bulk_modulus")


@pytest.mark.thorough
@pytest.mark.parametrize("build", [Pipe, UnsteadyFrictionPipe])
def test_gradients(build: Callable[..., Pipe | UnsteadyFrictionPipe]) -> None:
    """Gradients of the pressure at the closing valve: both modes agree with differences."""
    pipe = build(n=3, length=2.0, diameter=DIAMETER, liquid=iso_vg_46(), wall=1e-10, p=RESERVOIR, q=AREA)
    rig = Hammer(
        reservoir=ConstantPressure(pressure=RESERVOIR),
        pipe=pipe,
        closing=Ramp(height=AREA, duration=2e-3, offset=-AREA),
    )
    base = jnp.array([2.0, DIAMETER, 1e-10, 0.005, 1.8e9])

    def pressure(scales: jax.Array) -> jax.Array:
        changed = replace(rig, dict(zip(GRADIENT_OF, base * scales, strict=True)))
        return jnp.asarray(simulate(changed, 3e-3, save="end", rtol=1e-9).final.pipe.p_b)

    ones, ways = jnp.ones(len(base)), jnp.eye(len(base))
    along = jax.jit(lambda scales, way: jax.jvp(pressure, (scales,), (way,)))
    forward, reverse = np.array([along(ones, way)[1] for way in ways]), jax.grad(pressure)(ones)
    differences = [(along(ones + step, step)[0] - along(ones - step, step)[0]) / 2e-5 for step in 1e-5 * ways]
    np.testing.assert_allclose(forward, reverse, rtol=1e-6)
    np.testing.assert_allclose(forward, differences, rtol=1e-4, atol=1.0)


BAD = (
    (dict(n=1), r"n must be a whole number of segments, at least 2, got 1"),
    (dict(diameter=0.0), r"diameter must be positive and finite, got 0.0 m"),
    (dict(p=[0.0, 1.0]), r"p must be one number or 4 of them, got an array of shape \(2,\)"),
    (dict(wall=-1e-9), r"wall must be nonnegative"),
)


@pytest.mark.parametrize(("change", "text"), BAD, ids=["n", "diameter", "p", "wall"])
def test_bad_arguments(change: dict, text: str) -> None:
    with pytest.raises(ParameterError, match=rf"^(Pipe|Segments)\.{text}"):
        Pipe(**{"n": 3, "length": 1.0, "diameter": 0.01, "liquid": iso_vg_46(), **change})


@pytest.mark.thorough
def test_memory_of_another_length_is_refused() -> None:
    with pytest.raises(ParameterError, match=r"^FrictionMemory\.weights must be one-dimensional"):
        FrictionMemory(weights=jnp.ones(2), rates=jnp.ones(3))


@pytest.mark.parametrize("terms", [0, 11, 2.5, -1])
def test_terms_that_a_memory_lacks_are_refused(terms: Any) -> None:
    assert len(FrictionMemory.kagawa(10).weights) == 10
    with pytest.raises(ParameterError, match=rf"^FrictionMemory\.kagawa has 1 to 10 terms, got {terms}"):
        FrictionMemory.kagawa(terms)
