"""The search for roots: by Newton's method, then in a trust region, from several starts, and its derivatives."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from numpy.testing import assert_allclose

from acausal._evaluate.roots import scaled_root


def anywhere(x: Any, p: Any) -> Any:
    return jnp.stack([p * x[0] + x[1] ** 2 - 3.0, x[0] - x[1]]), True


def positive(x: Any, p: Any) -> Any:
    return x**2 - p, jnp.all(x >= 0.0)


def bounded(x: Any, p: Any) -> Any:
    """Newton's method diverges from a far start."""
    return jnp.arctan(x) - p, jnp.all(jnp.abs(x) < 1e3)


def none(x: Any, p: Any) -> Any:
    return x**2 + p, True


@pytest.mark.parametrize(
    ("residual", "starts", "p", "root"),
    [
        (anywhere, [[1.0, 1.0]], 2.0, [1.0, 1.0]),
        (anywhere, [[9.0, 0.1]], 2.0, [1.0, 1.0]),
        (positive, [[1.0]], 2.0, [np.sqrt(2.0)]),
        (positive, [[-1.0], [3.0]], 2.0, [np.sqrt(2.0)]),  # nothing inside is reached from the first start
        (positive, [[2.0]], 0.0, [0.0]),  # a double root at the edge
        (bounded, [[30.0]], 0.5, [np.tan(0.5)]),
        (none, [[1.0], [2.0]], 1.0, [np.nan]),
    ],
)
def test_roots(residual: Any, starts: list[list[float]], p: float, root: list[float]) -> None:
    assert_allclose(scaled_root(residual, jnp.array(starts), p), root, rtol=1e-9, atol=1e-7)


def test_derivatives_of_a_root() -> None:
    """x^2 = p has the root p^(1/2), also where the function has no derivative on the way."""

    def root(p: Any) -> Any:
        return scaled_root(positive, jnp.array([[1.0]]), p)[0]

    assert_allclose(jax.grad(root)(4.0), 0.25)
    assert_allclose(jax.jacfwd(root)(4.0), 0.25)
    assert_allclose(jax.grad(jax.grad(root))(4.0), -1.0 / 32.0)
    assert_allclose(jax.vmap(jax.grad(root))(jnp.array([1.0, 4.0])), [0.5, 0.25])


def ring(x: Any, p: Any) -> Any:
    """x_i^3 + p_0 x_(i+1) = p_1 i, around a ring."""
    return x**3 + p[0] * jnp.roll(x, -1) - p[1] * jnp.arange(1.0, len(x) + 1.0), True


@pytest.mark.parametrize("n", range(1, 9))
def test_both_modes_agree_for_any_number_of_unknowns(n: int) -> None:
    """Small systems are eliminated entry by entry, larger ones as arrays, the largest by LU factors."""
    p = jnp.array([1.0, 2.0])
    root = lambda p: scaled_root(ring, jnp.ones((1, n)), p)  # noqa: E731
    forward = jax.jacfwd(root)(p)
    ends = [root(p + step) for step in 1e-6 * jnp.array([[1.0, 0.0], [-1.0, 0.0]])]
    assert_allclose(forward[:, 0], (ends[0] - ends[1]) / 2e-6, rtol=1e-6, atol=1e-9)
    assert_allclose(jax.jacrev(root)(p), forward, rtol=1e-12, atol=1e-14)
    assert_allclose(jax.jit(jax.jacrev(root))(p), forward, rtol=1e-12, atol=1e-14)
