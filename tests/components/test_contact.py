"""Backlash and gaps: the contact law, against closed forms."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _rig import Rig
from numpy.typing import NDArray

from acausal import Connections, ParameterError, Scalar, connect, simulate
from acausal.testing import check_law
from components import rotational, translational


@pytest.mark.parametrize(
    ("phi_rel", "w_rel", "tau"),
    [
        (0.35, 5.0, 0.0),  # within the play
        (0.5, 0.0, 100.0),
        (0.5, 2.0, 120.0),
        (0.5, 50.0, 200.0),  # damping no larger than the elastic torque
        (0.5, -50.0, 0.0),  # so that the stop does not pull
        (-0.3, -2.0, -120.0),
        (-0.3, 50.0, 0.0),
    ],
)
def test_law_of_backlash(phi_rel: float, w_rel: float, tau: float) -> None:
    """c = 1000, d = 10, play of 0.6 about 0.1: stops at 0.4 and -0.2."""
    backlash = rotational.ElastoBacklash(c=1000.0, d=10.0, play=0.6, phi_rel0=0.1)
    check_law(backlash, {"phi_rel": phi_rel, "w_rel": w_rel}, {"tau": tau}, atol=1e-9)


@pytest.mark.parametrize(
    ("s_rel", "v_rel", "f"),
    [(0.5, -9.0, 0.0), (0.16, 0.0, -8.0), (0.16, -0.1, -9.0), (0.16, 9.0, 0.0), (0.16, -9.0, -16.0)],
)
def test_law_of_gap(s_rel: float, v_rel: float, f: float) -> None:
    """c = 1000, d = 10, n = 1.5, contact at 0.2: an indentation of 0.04 gives 8 N."""
    gap = translational.ElastoGap(c=1000.0, d=10.0, s_rel0=0.2, n=1.5)
    check_law(gap, {"s_rel": s_rel, "v_rel": v_rel}, {"f": f}, atol=1e-9)


def test_exponent_of_gap_has_to_be_at_least_one() -> None:
    with pytest.raises(ParameterError, match=r"ElastoGap.n must be at least 1"):
        translational.ElastoGap(c=1.0, d=0.0, n=0.5)


def wire_drop(ball: Any, gap: Any, floor: Any) -> Connections:
    return connect(gap.a, floor.flange), connect(gap.b, ball.a)


@pytest.mark.thorough
def test_rebound_of_an_elastic_ball() -> None:
    """Without damping it leaves with the speed it came with, after the half period of the spring; and its gradient.

    From s = 0.5 with v = -2: contact at 0.25 s, half a period of pi sqrt(m/c) later it is off, and flies for the rest.
    """

    def end(c: Scalar) -> Any:
        gap = translational.ElastoGap(c=c, d=0.0)
        parts = (translational.SlidingMass(m=1.0, s=0.5, v=-2.0), gap, translational.Fixed())
        return simulate(Rig(parts=parts, wiring=wire_drop), 1.0, save="end", rtol=1e-9).final.parts[0]

    c = 400.0
    contact = np.pi / np.sqrt(c)
    np.testing.assert_allclose(end(c).v, 2.0, rtol=1e-7)
    np.testing.assert_allclose(end(c).s, 2.0 * (1.0 - 0.25 - contact), rtol=1e-7)
    slope = jax.jacfwd(lambda c: end(c).s)(jnp.asarray(c))
    np.testing.assert_allclose(slope, contact / c, rtol=1e-7)


def wire_row(first: Any, gap: Any, second: Any, other: Any, third: Any) -> Connections:
    return connect(first.b, gap.a), connect(gap.b, second.a), connect(second.b, other.a), connect(other.b, third.a)


def by_small_steps(cases: NDArray[Any], c: float, end: float, steps: int = 5000) -> NDArray[Any]:
    """Places and speeds of three masses of 1 kg, by the method of Runge and Kutta."""
    first, last, gap, other, d = cases

    def rates(y: NDArray[Any]) -> NDArray[Any]:
        s, v = y[:3], y[3:]
        depth, speed = np.maximum(s[:-1] - s[1:], 0.0), v[:-1] - v[1:]
        force = c * depth + np.clip(d * speed, -c * depth, c * depth)
        return np.stack([*v, -force[0], force[0] - force[1], force[1]])

    y, h = np.stack([-gap, 0.0 * gap, other, first, 0.0 * gap, last]), end / steps
    for _ in range(steps):
        k1 = rates(y)
        k2 = rates(y + 0.5 * h * k1)
        k3 = rates(y + 0.5 * h * k2)
        y = y + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + rates(y + h * k3))
    return y


@pytest.mark.thorough
def test_masses_in_a_row() -> None:
    """They hit each other one after the other or at one instant; some touch at the start, and damping is heavy."""
    c, end = 1e4, 0.5

    def run(first: Any, last: Any, gap: Any, other: Any, d: Any) -> Any:
        masses = [translational.Mass(m=1.0, s=s, v=v) for s, v in ((-gap, first), (0.0, 0.0), (other, last))]
        gaps = [translational.ElastoGap(c=c, d=d) for _ in range(2)]
        parts = (masses[0], gaps[0], masses[1], gaps[1], masses[2])
        final = simulate(Rig(parts=parts, wiring=wire_row), end, save="end", rtol=1e-8).final.parts
        return jnp.stack([getattr(part, name) for name in "sv" for part in final[::2]])

    draw = np.random.default_rng(0)
    n = 16
    cases = np.stack([
        draw.uniform(0.5, 2.0, n), draw.choice([0.0, -1.0, -2.0], n), draw.choice([0.0, 0.1, 0.2], n),
        draw.choice([0.0, 0.1], n), draw.choice([0.0, 1.0, 50.0, 200.0, 1000.0], n),
    ])  # fmt: skip
    cases[:, 0] = 1.0, -1.0, 0.1, 0.1, 20.0
    cases[:, 1] = 2.0, 0.0, 0.1, 0.0, 200.0
    found = jax.jit(jax.vmap(run))(*cases)
    np.testing.assert_allclose(found.T, by_small_steps(cases, c, end), atol=1e-4)
