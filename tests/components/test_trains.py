"""Random sequences of impacts and friction against a mode-by-mode integration: events, times, derivatives."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _by_hand import HIGH, LOW, V_REST, Shaken, followed
from _rig import Rig
from numpy.typing import NDArray

from acausal import Connections, connect, simulate
from components import blocks, translational

pytestmark = pytest.mark.computing
N, END, TIGHT = 48, 2.0, 1e-10


def cases(seed: int) -> NDArray[Any]:
    """Random numbers of `Shaken`, a row for each case."""
    draw = np.random.default_rng(seed)
    columns = Shaken(
        m=draw.uniform(0.5, 3.0, N),
        v=draw.uniform(-4.0, 4.0, N),
        push=draw.uniform(-2.0, 2.0, N),
        amplitude=draw.uniform(0.0, 8.0, N),
        f=draw.uniform(0.3, 2.0, N),
        level=draw.uniform(0.2, 2.0, N),
        excess=draw.uniform(0.0, 1.0, N) * draw.integers(0, 2, N),
        fexp=10.0 ** draw.uniform(1.0, 3.0, N),
        viscous=draw.uniform(0.0, 0.5, N),
        e=draw.choice([0.0, 0.3, 0.6, 0.9], N),
        c=10.0 ** draw.uniform(2.0, 4.0, N),
        d=10.0 ** draw.uniform(-1.0, 2.0, N),
    )
    return np.stack(columns, axis=1)


def wire_rigid(source: Any, push: Any, body: Any) -> Connections:
    return connect(source.y, push.u), connect(push.flange, body.a)


def wire_compliant(source: Any, push: Any, body: Any, friction: Any, low: Any, high: Any, wall: Any) -> Connections:
    return (
        *wire_rigid(source, push, body),
        connect(body.b, friction.flange, low.b, high.a),
        connect(low.a, high.b, wall.flange),
    )


def model_of(x: Shaken, *, is_rigid: bool) -> Rig:
    source = blocks.Sine(offset=x.push, amplitude=x.amplitude, frequency=x.f)
    law: Any = dict(F_prop=x.viscous, F_Coulomb=x.level, F_Stribeck=x.excess, fexp=x.fexp)
    if is_rigid:
        body = translational.MassWithStopAndFriction(
            m=x.m, v=x.v, s_min=LOW, s_max=HIGH, restitution=x.e, rest_at_stop=V_REST, **law
        )
        return Rig(parts=(source, translational.SignalForce(), body), wiring=wire_rigid)
    parts = (
        source,
        translational.SignalForce(),
        translational.Mass(m=x.m, v=x.v),
        translational.TustinFriction(**law),
        translational.ElastoGap(c=x.c, d=x.d, s_rel0=LOW),
        translational.ElastoGap(c=x.c, d=x.d, s_rel0=-HIGH),
        translational.Fixed(),
    )
    return Rig(parts=parts, wiring=wire_compliant)


def run(row: Any, *, is_rigid: bool, energy: bool = False, rtol: Any = TIGHT) -> Any:
    model = model_of(Shaken(*row), is_rigid=is_rigid)
    return simulate(model, END, save="end", rtol=rtol, max_events=64, throw=False, energy=energy)


IMPACTS = ("impact_low", "impact_high")
NAMES = dict(
    s=("stick",), t=("stick", "reverse"), b=("forward", "backward", "lift_low", "lift_high"), r=IMPACTS, l=IMPACTS
)


@pytest.mark.thorough
@pytest.mark.parametrize("is_rigid", [True, False])
def test_random_trains(is_rigid: bool) -> None:
    """Stops with rebound and without, and compliant ones; friction with and without a peak; shaken until it sticks.

    A peak that is gone at 1e-8 m/s takes a tolerance to match: what breaks away grows from errors of that size.
    """
    rows, part = cases(0), "parts[2]" if is_rigid else "parts[3]"

    def ends(row: Any, rtol: Any) -> Any:
        solution = run(row, is_rigid=is_rigid, energy=True, rtol=rtol)
        body = solution.final.parts[2]
        return body.b.s, body.v, solution.energy.imbalance, solution.events

    run_all = jax.jit(jax.vmap(ends, in_axes=(0, None)))
    place, speed, imbalance, log = run_all(rows, TIGHT)
    expected = [followed(Shaken(*row), END, is_rigid=is_rigid) for row in rows]
    np.testing.assert_allclose(place, [end.s for end in expected], atol=1e-8)
    np.testing.assert_allclose(speed, [end.v for end in expected], atol=1e-7)
    np.testing.assert_allclose(imbalance, 0.0, atol=1e-7)
    for i, end in enumerate(expected):
        for letter, t in zip(end.happened, end.times, strict=True):
            names = [f"{part}.{name}" for name in NAMES[letter] if f"{part}.{name}" in log.labels]
            found = [np.asarray(log.of_event(name))[i] for name in names]
            np.testing.assert_allclose(np.min(np.abs(np.concatenate(found) - t)), 0.0, atol=1e-7)
        if is_rigid:
            impacts = [np.asarray(log.of_event(f"{part}.{name}"))[i] for name in IMPACTS]
            assert np.sum(np.isfinite(impacts)) == sum(letter in "rl" for letter in end.happened)
    if is_rigid:
        draw, steep = np.random.default_rng(5), rows.copy()
        steep[:, Shaken._fields.index("excess")] = draw.uniform(0.1, 1.0, N)
        steep[:, Shaken._fields.index("fexp")] = 10.0 ** draw.uniform(5.0, 8.0, N)
        expected = [followed(Shaken(*row), END, is_rigid=True) for row in steep[:16]]
        place, speed, _, _ = run_all(steep, 1e-12)
        np.testing.assert_allclose(place[:16], [end.s for end in expected], atol=2e-6)
        np.testing.assert_allclose(speed[:16], [end.v for end in expected], atol=2e-6)


@pytest.mark.slow
@pytest.mark.parametrize("is_rigid", [True, False])
def test_derivatives_of_random_trains(is_rigid: bool) -> None:
    """Along random directions, against differences of trains in which the same happens."""
    rows, draw = cases(1)[: N if is_rigid else 12], np.random.default_rng(2)
    ways = draw.normal(size=rows.shape) * (rows != 0.0)
    weights = draw.normal(size=(len(rows), 2))

    def end(row: Any) -> Any:
        body = run(row, is_rigid=is_rigid).final.parts[2]
        return jnp.stack([body.b.s, body.v])

    forward = jax.jit(jax.vmap(lambda row, way: jax.jvp(end, (row,), (way,))[1]))(rows, ways)
    if is_rigid:
        slope = jax.jit(jax.vmap(lambda row, weight: jax.grad(lambda row: jnp.sum(weight * end(row)))(row)))
        found = jnp.sum(slope(rows, weights) * ways, axis=1)
        np.testing.assert_allclose(found, jnp.sum(weights * forward, axis=1), rtol=1e-7, atol=1e-9)
    step, compared = 1e-5, 0
    for row, way, slopes in zip(rows, ways, np.asarray(forward), strict=True):
        high, low = (followed(Shaken(*(row + h * way)), END, is_rigid=is_rigid) for h in (step, -step))
        if high.happened == low.happened:
            compared += 1
            expected = [(high.s - low.s) / (2.0 * step), (high.v - low.v) / (2.0 * step)]
            np.testing.assert_allclose(slopes, expected, rtol=1e-4, atol=1e-4)
    assert compared > 0.9 * len(rows)
