"""Least squares without LAPACK: against numpy, and where numbers differ by many decades."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from acausal._linear_solver import least_squares


@pytest.mark.parametrize(("rows", "columns"), [(1, 1), (4, 4), (9, 2), (30, 7)])
def test_several_right_hand_sides_are_those_of_numpy(rows: int, columns: int) -> None:
    rng = np.random.default_rng(rows)
    a, b = rng.normal(size=(5, rows, columns)), rng.normal(size=(5, rows, 3))
    scale = 10.0 ** rng.uniform(-4.0, 4.0, columns)
    found = scale[:, None] * jax.jit(jax.vmap(least_squares))(a * scale, b)
    expected = [np.linalg.lstsq(*pair, rcond=None)[0] for pair in zip(a, b, strict=True)]
    np.testing.assert_allclose(found, expected, rtol=1e-11, atol=1e-12)


def test_what_normal_equations_lose_is_kept() -> None:
    """With a matrix whose product with its transpose is singular but for rounding (Läuchli), and a fit of degree 8."""
    a, exact = jnp.array([[1.0, 1.0], [1e-9, 0.0], [0.0, 1e-9]]), jnp.array([[1.0], [2.0]])
    np.testing.assert_allclose(least_squares(a, a @ exact), exact, rtol=1e-5)
    vander, coefficients = jnp.vander(jnp.linspace(0.0, 1.0, 40), 9), jnp.arange(1.0, 10.0)[:, None]
    np.testing.assert_allclose(least_squares(vander, vander @ coefficients), coefficients, rtol=1e-8)


def test_a_column_that_is_nearly_a_unit_vector_cancels_nothing() -> None:
    """x + 1e-6 y is least for x = (1 + 1e-6 1e6)/(1 + 1e-12); the first reflection must not subtract equal numbers."""
    for small in (1e-3, 1e-6, 1e-9):
        for sign in (1.0, -1.0):
            a, b = jnp.array([[sign], [small]]), jnp.array([[1.0], [1.0 / small]])
            np.testing.assert_allclose(least_squares(a, b), (sign + 1.0) / (1.0 + small**2), rtol=1e-14, atol=1e-15)


def test_no_call_of_lapack_is_compiled() -> None:
    assert "custom_call" not in jax.jit(least_squares).lower(jnp.ones((4, 2)), jnp.ones((4, 1))).as_text()


@pytest.mark.thorough
def test_derivatives_are_those_of_the_pseudo_inverse() -> None:
    rng = np.random.default_rng(2)
    a, change = rng.normal(size=(2, 5, 3))

    def inverse(a: jax.Array) -> jax.Array:
        return least_squares(a, jnp.eye(5))

    _, tangent = jax.jvp(inverse, (a,), (change,))
    _, expected = jax.jvp(jnp.linalg.pinv, (a,), (change,))
    np.testing.assert_allclose(tangent, expected, rtol=1e-9)
    back = jax.vjp(inverse, a)[1](expected)[0]
    np.testing.assert_allclose(jnp.sum(back * change), jnp.sum(expected**2), rtol=1e-9)
