"""Second derivatives of peaks and of their times, against closed forms and differences of first derivatives."""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from acausal import Component, Equations, Events, Param, Scalar, Var, eq, replace, simulate, when
from docs.drive import drive

SECOND = {"forward": lambda f: jax.jacfwd(jax.jacfwd(f)), "reverse": lambda f: jax.jacfwd(jax.jacrev(f))}


class Sprung(Component, partial=True):
    """A mass of 1 kg on a spring, released at x = 1: x = cos(w t), w = sqrt(c)."""

    c: Param[Scalar, "1/s2"] = 4.0
    wall: Param[Scalar, "1"] = 0.5
    x: Var[Scalar, "1"] = 1.0
    v: Var[Scalar, "1/s"] = 0.0

    def equations(self, d: Any) -> Equations:
        return dict(speed=eq(d.x, self.v), spring=eq(d.v, -self.c * self.x))


class Free(Sprung):
    """It swings on."""


class Bouncing(Sprung):
    """It hits a wall at x = -wall, before it turns."""

    def events(self) -> Events:
        return dict(impact=when(self.x < -self.wall, v=-0.5 * self.v))


def looked_at(s: Sprung) -> dict[str, Any]:
    """A smooth peak, one where the run ends or the wall is hit, and one where a minimum has a kink."""
    return {"smooth": 0.3 * s.x - s.v, "last": -2.0 * s.x - s.v, "kink": jnp.minimum(-s.v, s.wall + s.x)}


def exact(c: Scalar, wall: Scalar) -> dict[str, tuple[Scalar, Scalar]]:
    """The peaks and their times: angles w t with tan = w/0.3, cos = -wall, and w sin - cos = wall."""
    w = jnp.sqrt(c)
    last = jnp.arccos(-wall)
    kink = jnp.arctan2(1.0, w) + jnp.arcsin(wall / jnp.sqrt(c + 1.0))
    return {
        "smooth": (jnp.sqrt(c + 0.09), jnp.arctan2(w, 0.3) / w),
        "last": (2.0 * wall + w * jnp.sin(last), last / w),
        "kink": (w * jnp.sin(kink), kink / w),
    }


def hit(c: Scalar, wall: Scalar) -> dict[str, Any]:
    return simulate(Bouncing(c=c, wall=wall), 1.2, peaks=looked_at, rtol=1e-10, save="end").peaks


def stopped(c: Scalar, wall: Scalar) -> dict[str, Any]:
    model = Free(c=c, wall=wall)
    return simulate(model, 3.0, until=lambda s: s.x + wall, peaks=looked_at, rtol=1e-10, save="end").peaks


def read(c: Scalar, wall: Scalar) -> dict[str, Any]:
    """The same as `hit`, read after the run."""
    return simulate(Bouncing(c=c, wall=wall), 1.2, rtol=1e-10, save="dense", max_steps=256).peak(looked_at)


@pytest.mark.parametrize("run", [hit, stopped, pytest.param(read, marks=pytest.mark.thorough)])
@pytest.mark.parametrize("mode", ["forward", pytest.param("reverse", marks=pytest.mark.slow)])
def test_second_derivatives_of_values_and_times(run: Callable[..., dict[str, Any]], mode: str) -> None:
    def both(x: Any) -> Any:
        return jnp.stack([jnp.stack(tuple(peak)) for _, peak in sorted(run(x[0], x[1]).items())])

    def closed(x: Any) -> Any:
        return jnp.stack([jnp.stack(pair) for _, pair in sorted(exact(x[0], x[1]).items())])

    x = jnp.array([4.0, 0.5])
    np.testing.assert_allclose(SECOND[mode](both)(x), jax.hessian(closed)(x), rtol=1e-5, atol=1e-6)


@pytest.mark.slow
def test_peaks_of_a_drive_against_differences_of_first_derivatives() -> None:
    """The largest current and torque as the motor starts, and when."""

    def wanted(s: Any) -> Any:
        return s.motor.inductor.i, s.spring.b.tau

    def found(ratio: Scalar) -> Any:
        model = replace(drive, {"gear.ratio": ratio})
        peaks = simulate(model, 0.5, peaks=wanted, rtol=1e-10, save="end").peaks
        return jnp.stack([jnp.stack(tuple(peak)) for peak in peaks])

    slope, step = jax.jit(jax.jacfwd(found)), 1e-2
    once, twice = ((slope(20.0 + h) - slope(20.0 - h)) / (2.0 * h) for h in (step, 2.0 * step))
    np.testing.assert_allclose(jax.jacfwd(slope)(20.0), (4.0 * once - twice) / 3.0, rtol=1e-4)
