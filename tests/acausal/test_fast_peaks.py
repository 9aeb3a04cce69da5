"""Peaks of what turns many times while nothing makes steps short, and at kinks: against closed forms."""

import math
from typing import Any, Self

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from acausal import Component, Equations, Param, Scalar, Time, Var, eq, replace, simulate

W, K = 80.0, 1.0


class Spindle(Component):
    """An angle that grows evenly beside what decays: both far slower than the sine of the angle."""

    w: Param[Scalar, "rad/s"] = W
    k: Param[Scalar, "1/s"] = K
    t: Time[Scalar, "s"] = 0.0
    phi: Var[Scalar, "rad"] = 0.0
    x: Var[Scalar, "1"] = 1.0

    def equations(self, d: Self) -> Equations:
        return dict(turn=eq(d.phi, self.w), decay=eq(d.x, -self.k * self.x))


def wanted(s: Spindle) -> dict[str, Any]:
    triangle = 1.0 - jnp.abs(jnp.arcsin(jnp.sin(s.phi))) / (0.5 * jnp.pi)
    return {
        "decaying": s.x * jnp.sin(s.phi),
        "growing": (2.0 - s.x) * jnp.cos(s.phi),
        "fourth": s.t * (1.0 - s.t) * jnp.sin(2.0 * s.phi) ** 2,
        "time": (1.0 + s.t) * jnp.sin(s.w * s.t),
        "kinks": (1.0 + s.t) * triangle,
        "lower": jnp.minimum(3.0 * s.t, s.x),
    }


def found(w: Scalar, k: Scalar, save: Any = "end") -> dict[str, Any]:
    return simulate(replace(Spindle(), {"w": w, "k": k}), 1.0, save=save, rtol=1e-9, peaks=wanted).peaks


def largest(function: Any) -> tuple[float, float]:
    """The largest value of a function of time, and its time, on a grid refined around the best place."""
    low, high, best = 0.0, 1.0, 0.0
    for _ in range(6):
        t = np.linspace(low, high, 20_001)
        best = t[np.argmax(function(t))]
        low, high = max(best - 2.0 * (t[1] - t[0]), 0.0), min(best + 2.0 * (t[1] - t[0]), 1.0)
    return float(function(best)), float(best)


@pytest.mark.thorough
def test_thirteen_turns_in_a_few_steps() -> None:
    peaks = found(W, K, np.linspace(0.0, 1.0, 5))
    exact = {
        "decaying": lambda t: np.exp(-K * t) * np.sin(W * t),
        "growing": lambda t: (2.0 - np.exp(-K * t)) * np.cos(W * t),
        "fourth": lambda t: t * (1.0 - t) * np.sin(2.0 * W * t) ** 2,
        "time": lambda t: (1.0 + t) * np.sin(W * t),
        "kinks": lambda t: (1.0 + t) * (1.0 - np.abs(np.arcsin(np.sin(W * t))) / (0.5 * np.pi)),
        "lower": lambda t: np.minimum(3.0 * t, np.exp(-K * t)),
    }
    for name, function in exact.items():
        value, time = largest(function)
        assert float(peaks[name].value) == pytest.approx(value, abs=2e-8), name
        assert float(peaks[name].time) == pytest.approx(time, abs=1e-6), name


@pytest.mark.thorough
def test_what_turns_too_often_is_sampled() -> None:
    """A step is looked at in so many places only, however fast the sine is."""
    peak = simulate(Spindle(w=1e9), 1.0, save="end", peaks=lambda s: (1.0 + s.t) * jnp.sin(s.w * s.t)).peaks
    assert float(peak.value) == pytest.approx(2.0, rel=1e-3)


@pytest.mark.thorough
@pytest.mark.parametrize("derivative", [jax.jacfwd, jax.jacrev])
def test_derivatives_at_turns_and_at_kinks(derivative: Any) -> None:
    """The first crest of exp(-k t) sin(w t) is at atan2(w, k) / w; at a kink, the time is where both sides meet."""
    slopes = derivative(lambda x: {name: found(x[0], x[1])[name] for name in ("decaying", "kinks", "lower")})(
        jnp.array([W, K])
    )
    first = lambda x: jnp.arctan2(x[0], x[1]) / x[0]  # noqa: E731
    x = jnp.array([W, K])
    np.testing.assert_allclose(slopes["decaying"].time, jax.grad(first)(x), rtol=1e-5, atol=1e-9)
    value = lambda x: jnp.exp(-x[1] * first(x)) * jnp.sin(x[0] * first(x))  # noqa: E731
    np.testing.assert_allclose(slopes["decaying"].value, jax.grad(value)(x), rtol=1e-6)
    # The last tip of the triangles is at 25 pi / w, and as high as 1 + t there.
    np.testing.assert_allclose(slopes["kinks"].time, [-25.0 * math.pi / W**2, 0.0], rtol=1e-5, atol=1e-9)
    np.testing.assert_allclose(slopes["kinks"].value, [-25.0 * math.pi / W**2, 0.0], rtol=1e-4, atol=1e-9)
    # 3 t = exp(-k t): dt/dk = -t^2 / (1 + k t).
    t = float(found(W, K)["lower"].time)
    np.testing.assert_allclose(slopes["lower"].time, [0.0, -(t**2) / (1.0 + K * t)], rtol=1e-5, atol=1e-9)
    np.testing.assert_allclose(slopes["lower"].value, [0.0, -3.0 * t**2 / (1.0 + K * t)], rtol=1e-5, atol=1e-9)
