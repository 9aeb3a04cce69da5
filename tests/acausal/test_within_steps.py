"""Values within steps of unknowns that multiply small differences of states, against closed forms."""

import math
from typing import Self

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax import Array

from acausal import Component, Discrete, Equations, Events, Param, Scalar, Time, Var, eq, simulate, when

C, W, A, R = 1e-3, 10.0 * math.pi, 10.0, 100.0


class Follower(Component, partial=True):
    """A volume with a leak, fed from u = A cos(W t) through something that hardly resists: p is u but for what drives
    the flow q.
    """

    R: Param[Scalar, ""] = R
    t: Time[Scalar, "s"] = 0.0
    p: Var[Scalar, ""] = A
    q: Var[Scalar, ""] = 0.0
    n: Discrete[Scalar, "1"] = 0.0
    last: Discrete[Scalar, "s"] = 0.0

    def flow(self, drop: Scalar) -> Scalar:
        """The flow that a drop drives."""
        raise NotImplementedError

    def equations(self, d: Self) -> Equations:
        return dict(
            feed=eq(self.q, self.flow(A * jnp.cos(W * self.t) - self.p), check_units=False),
            storage=eq(C * d.p, self.q - self.p / self.R, check_units=False),
        )

    def events(self) -> Events:
        return dict(reverse=when(self.q > 0.0, n=self.n + 1.0, last=self.t))


class Resistive(Follower):
    """As a capacitor behind a small resistance."""

    r: Param[Scalar, ""] = 1e-5

    def flow(self, drop: Scalar) -> Scalar:
        return drop / self.r


class Stiffening(Follower):
    """As a damped piston that a stiff contact moves, harder the more it is pressed."""

    k: Param[Scalar, ""] = 1e5

    def flow(self, drop: Scalar) -> Scalar:
        return self.k * (drop + 1e5 * drop**3)


def flow(t: np.ndarray) -> np.ndarray:
    """In the limit in which nothing resists."""
    return -A * W * C * np.sin(W * t) + A / R * np.cos(W * t)


TOP = A * math.hypot(W * C, 1.0 / R)
# The flow becomes positive at once, and where tan(W t) = 1 / (W R C), once in each of the three periods.
CROSSING = (math.atan(1.0 / (W * C * R)) + math.pi) / W + 0.4


@pytest.mark.parametrize(
    ("model", "share"), [(Resistive, 1e-3), pytest.param(Stiffening, 1e-2, marks=pytest.mark.slow)]
)
def test_what_multiplies_differences_of_states_is_read_within_steps(model: type[Follower], share: float) -> None:
    """By a run whose steps are a tenth of a period, at saved times and in dense output, for peaks and by conditions."""
    times = np.linspace(0.06, 0.6, 541)
    run = simulate(model(), 0.6, save=jnp.asarray(times), peaks=lambda s: {"q": s.q})
    np.testing.assert_allclose(run.q, flow(times), atol=share * TOP)
    np.testing.assert_allclose(run.peaks["q"].value, TOP, rtol=share)
    np.testing.assert_array_equal(run.final.n, 4.0)
    np.testing.assert_allclose(run.final.last, CROSSING, atol=0.02 * share)
    dense = simulate(model(), 0.6, save="dense")
    np.testing.assert_allclose(dense.at(jnp.asarray(times)).q, flow(times), atol=share * TOP)


@pytest.mark.thorough
def test_derivatives_of_what_is_read_within_steps() -> None:
    """Derivatives of the time at which a flow changes its sign, and of its peak, in both modes."""

    def found(R: Scalar) -> Array:
        run = simulate(Resistive(R=R), 0.55, save="end", peaks=lambda s: s.q, rtol=1e-8)
        return jnp.stack([run.final.last, run.peaks.value, run.peaks.time])

    place = -C / (1.0 + (W * C * R) ** 2)
    exact = [place, -(A / R**3) / math.hypot(W * C, 1.0 / R), place]
    for mode in (jax.jacfwd, jax.jacrev):
        np.testing.assert_allclose(np.asarray(mode(found)(R)) / exact, 1.0, atol=5e-3)


@pytest.mark.thorough
def test_an_end_at_what_multiplies_differences_of_states() -> None:
    run = simulate(Resistive(), 0.6, until=lambda s: s.q - 0.2, direction="up")
    phase = math.acos(0.2 / TOP)  # flow = TOP cos(W t + b), tan(b) = W R C
    exact = (2.0 * math.pi - phase - math.atan(W * R * C)) / W
    np.testing.assert_allclose(run.t1, exact, atol=1e-5)
    np.testing.assert_allclose(run.final.q, 0.2, rtol=1e-8)
