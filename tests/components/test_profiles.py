"""Cam profiles and sampled characteristics against closed forms."""

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import PchipInterpolator

from acausal import Scalar
from components._tables import monotone_cubic, monotone_cubic_integral
from components.rotational import EccentricDisc, TabulatedLift


def over(function: Callable[[Scalar], Scalar], x: Scalar) -> np.ndarray:
    return np.asarray(jax.jit(jax.vmap(function))(jnp.asarray(x)))


ANGLES = jnp.linspace(-4.0, 10.0, 1000)


@settings(deadline=None, max_examples=30)
@given(st.floats(1e-3, 0.9), st.floats(-7.0, 7.0))
def test_eccentric_disc_is_a_slider_crank(e: float, angle: float) -> None:
    """Crank e, rod R = 1: the lift's slope is -(v/w) of the slider (Norton), e sin + e^2 sin cos / sqrt(R^2 - ...)."""
    profile = EccentricDisc(eccentricity=e, radius=1.0)
    rod = np.sqrt(1.0 - (e * np.sin(angle)) ** 2)
    np.testing.assert_allclose(profile.lift(angle), -e * np.cos(angle) + rod - (1.0 - e), atol=1e-14)
    slope = e * np.sin(angle) - e**2 * np.sin(angle) * np.cos(angle) / rod
    np.testing.assert_allclose(profile.slope(angle), slope, atol=1e-13)


def test_eccentric_disc_lifts_by_twice_its_eccentricity() -> None:
    profile = EccentricDisc(eccentricity=5.5e-3, radius=20e-3)
    assert profile.lift(0.0) == 0.0
    assert profile.slope(0.0) == 0.0
    assert profile.lift(np.pi) == pytest.approx(11e-3, rel=1e-12)


def harmonic(angle: Scalar) -> Scalar:
    return 0.01 * (1.0 - jnp.cos(angle)) + 0.002 * jnp.sin(2.0 * angle)


def sampled(n: int) -> TabulatedLift:
    # Uneven knots, so that no symmetry hides an error.
    angles = jnp.linspace(0.0, 2.0 * jnp.pi, n + 1)
    angles = angles + 0.5 / n * jnp.sin(angles)
    return TabulatedLift(angles=angles, lifts=jnp.asarray(harmonic(angles)))


@pytest.mark.thorough
def test_tabulated_lift_converges_with_order_four() -> None:
    coarse, fine = (np.abs(over(sampled(n).lift, ANGLES) - harmonic(ANGLES)) for n in (40, 80))
    assert 14.0 < np.max(coarse) / np.max(fine) < 18.0
    coarse, fine = (np.abs(over(sampled(n).slope, ANGLES) - over(jax.grad(harmonic), ANGLES)) for n in (40, 80))
    assert 7.0 < np.max(coarse) / np.max(fine) < 9.0


@pytest.mark.thorough
def test_tabulated_lift_has_continuous_curvature_at_all_knots() -> None:
    profile = sampled(12)
    left, right = (over(jax.grad(profile.slope), profile.angles + shift) for shift in (-1e-9, 1e-9))
    np.testing.assert_allclose(left, right, atol=1e-9)
    np.testing.assert_allclose(right[0], right[-1], atol=1e-9)


@pytest.mark.thorough
def test_tabulated_lift_is_differentiable_in_its_samples() -> None:
    angles = jnp.linspace(0.0, 2.0 * jnp.pi, 7)

    def lift(scale: Scalar) -> Scalar:
        return TabulatedLift(angles=angles, lifts=scale * harmonic(angles)).lift(1.0)

    np.testing.assert_allclose(jax.jit(jax.jacfwd(lift))(3.0), lift(3.0) / 3.0, rtol=1e-12)


KNOTS = jnp.array([-1.0, -0.2, 0.5, 2.0, 2.1])


@jax.jit
def curve(values: jax.Array, x: jax.Array) -> tuple[jax.Array, jax.Array, jax.Array]:
    """The monotone cubic, its integral and the derivative of the integral."""
    y = jax.vmap(lambda x: monotone_cubic(x, KNOTS, values))(x)
    integral, slope = jax.vmap(jax.value_and_grad(lambda x: monotone_cubic_integral(x, KNOTS, values)))(x)
    return jnp.asarray(y), integral, slope


@pytest.mark.parametrize("values", [[0.0, 0.3, 0.4, 2.0, 2.5], [1.0, 0.2, 0.9, -1.0, -1.1]])
def test_monotone_cubic_is_that_of_scipy_between_inner_knots(values: list[float]) -> None:
    """The same slopes (Fritsch, Butland 1984), with intervals of different lengths; those at the ends differ."""
    x = np.linspace(KNOTS[1], KNOTS[-2], 50)
    np.testing.assert_allclose(curve(jnp.array(values), x)[0], PchipInterpolator(KNOTS, values)(x), atol=1e-14)


@settings(deadline=None, max_examples=30)
@given(st.lists(st.floats(0.0, 1.0), min_size=5, max_size=5))
def test_monotone_cubic_is_monotone_and_integrates(steps: list[float]) -> None:
    values = np.cumsum(np.array(steps))
    y, _, slope_of_integral = curve(values, np.linspace(-2.0, 3.0, 101))
    assert np.all(np.diff(y) >= -1e-12)
    np.testing.assert_allclose(slope_of_integral, y, atol=1e-11)
    np.testing.assert_allclose(curve(values, KNOTS)[0], values, atol=1e-12)
    left, right = (curve(values, KNOTS + shift)[1] for shift in (-1e-12, 1e-12))
    np.testing.assert_allclose(left, right, atol=1e-10)
