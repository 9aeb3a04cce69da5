"""Passage through knots that are close together or coincide, including starts and jumps onto them."""

from typing import Any, Self

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from acausal import (
    Component,
    Connections,
    Discrete,
    Equations,
    Events,
    Param,
    Scalar,
    Var,
    Vector,
    at,
    connect,
    eq,
    ifelse,
    segment,
    simulate,
)
from components.blocks import FirstOrder, Limiter, Ramp, Table1D


class Broken(Component):
    """The integral of a line of u that is zero at the first knot and has other slopes between the others; u moves at
    the speed v, and jumps at T to `place` and goes on at the speed `then`.
    """

    knots: Param[Vector, "1"]
    slopes: Param[Vector, "1"]
    T: Param[Scalar, "s"] = 100.0
    place: Param[Scalar, "1"] = 0.0
    then: Param[Scalar, "1/s"] = 0.0
    u: Var[Scalar, "1"] = 0.0
    total: Var[Scalar, "s"] = 0.0
    v: Discrete[Scalar, "1/s"] = 1.0

    def line(self) -> Scalar:
        piece, rises = segment(self.u, self.knots), self.slopes[1:-1] * jnp.diff(self.knots)
        values = jnp.concatenate([jnp.zeros(2), jnp.cumsum(rises)])
        starts = jnp.concatenate([self.knots[:1], self.knots])
        return values[piece] + self.slopes[piece] * (self.u - starts[piece])

    def equations(self, d: Self) -> Equations:
        return dict(move=eq(d.u, self.v), total=eq(d.total, self.line()))

    def events(self) -> Events:
        return dict(jump=at(self.T, u=self.place, v=self.then))


def total(t1: float, **data: Any) -> Any:
    """Result of a run with events, and of 2e6 samples of the path."""
    data = {name: jnp.asarray(value, float) for name, value in data.items()}
    found = simulate(Broken(**data), t1, save="end", rtol=1e-8).final.total
    t = (np.arange(2_000_000) + 0.5) * (t1 / 2_000_000)
    T, place, then = (float(data.get(name, default)) for name, default in (("T", 100.0), ("place", 0.0), ("then", 0.0)))
    u = np.where(t < T, float(data["u"]) + float(data["v"]) * t, place + then * (t - T))
    knots, slopes = np.asarray(data["knots"]), np.asarray(data["slopes"])
    line = slopes[0] * np.minimum(u - knots[0], 0.0) + slopes[-1] * np.maximum(u - knots[-1], 0.0)
    for slope, low, high in zip(slopes[1:-1], knots[:-1], knots[1:], strict=True):
        line += slope * (np.clip(u, low, high) - low)
    return found, np.mean(line) * t1


@pytest.mark.parametrize("gap", [0.0, 1e-12, 1e-10, 1e-6, 1e-3])
@pytest.mark.parametrize("v", [1.0, -1.0])
def test_close_knots(gap: float, v: float) -> None:
    found, exact = total(2.0, u=-v, v=v, knots=[0.0, gap], slopes=[1.0, 2.0, 3.0])
    np.testing.assert_allclose(found, exact, rtol=1e-6)


@pytest.mark.parametrize("v", [1.0, -1.0])
@pytest.mark.parametrize("knots", [[0.5, 0.5], [0.5, 0.8], [0.2, 0.5]])
def test_starts_on_knots(knots: list[float], v: float) -> None:
    """u leaves the knot, comes back by a jump, and passes it."""
    data = dict(u=0.5, v=v, T=1.0, place=0.5 + 0.7 * v, then=-v, knots=knots, slopes=[1.0, 2.0, 4.0])
    found, exact = total(3.0, **data)
    np.testing.assert_allclose(found, exact, rtol=1e-6)


@pytest.mark.parametrize("then", [1.0, -1.0, 1e-6])
@pytest.mark.parametrize("u", [2.5, 0.5, -2.5])
@pytest.mark.parametrize("place", [0.0, 1e-13, -1e-13, 1.0])
def test_jumps_onto_a_knot(u: float, place: float, then: float) -> None:
    data = dict(u=u, v=0.0, T=1.0, place=place, then=then, knots=[0.0, 1.0], slopes=[1.0, 2.0, 4.0])
    found, exact = total(2.0, **data)
    np.testing.assert_allclose(found, exact, rtol=1e-6, atol=1e-9)


class Filtered(Component):
    """A ramp through a block, whose output is filtered."""

    ramp: Ramp
    block: Component
    filter: FirstOrder

    def connections(self) -> Connections:
        return connect(self.ramp.y, self.block.u), connect(self.block.y, self.filter.u)  # pyright: ignore[reportAttributeAccessIssue]


BLOCKS = {
    "limiter": (Limiter(u_min=-1e-3, u_max=1e-3), 1e-3),
    "table": (Table1D(points=jnp.array([0.0, 1e-6, 1e3]), values=jnp.array([0.0, 1.0, 2.0]), smooth=False), 2.0),
}


@pytest.mark.thorough
@pytest.mark.parametrize("rtol", [1e-3, 1e-6, 1e-9])
@pytest.mark.parametrize("name", BLOCKS)
def test_knots_much_closer_than_the_signal_is_large(name: str, rtol: float) -> None:
    block, exact = BLOCKS[name]
    model = Filtered(ramp=Ramp(offset=-1e4, height=2e4, duration=20.0), block=block, filter=FirstOrder(T=0.5))
    final = simulate(model, 25.0, save="end", rtol=rtol, nominal={"filter.x": exact}).final
    np.testing.assert_allclose(final.filter.y.value, exact, rtol=2 * rtol)


class Rectified(Component):
    """A swing of the size 1e6, which falls to 1e-1, on springs that are stiffer on one side."""

    x: Var[Scalar, "1"] = 1e6
    v: Var[Scalar, "1"] = 0.0

    def equations(self, d: Self) -> Equations:
        pull = ifelse(self.x > 0.0, 1.0, 4.0) * self.x + 0.5 * self.v
        return dict(x=eq(d.x, self.v, check_units=False), v=eq(d.v, -pull, check_units=False))


@pytest.mark.thorough
def test_a_signal_that_becomes_small_passes_its_knots() -> None:
    run = jax.jit(lambda rtol: simulate(Rectified(), 60.0, save="end", rtol=rtol).final.x)
    exact = run(1e-11)
    for rtol in (1e-3, 1e-4, 1e-6):
        np.testing.assert_allclose(run(rtol), exact, atol=2.0 * rtol)
