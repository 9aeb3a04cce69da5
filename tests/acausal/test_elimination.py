"""Small linear systems with structural zeros: against numpy, and their derivatives against differences."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.test_util import check_grads

from acausal._evaluate.affine import computed
from acausal._evaluate.elimination import SMALL, eliminated


def _system(rng: np.random.Generator, n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """A sparse matrix with zeros on its diagonal, too, a vector, and which of their elements are structural zeros."""
    matrix = np.where(rng.random((n, n)) < 0.5, 0.0, rng.normal(size=(n, n)))
    matrix[np.arange(n), rng.permutation(n)] = 3.0 + rng.random(n)
    constant = np.where(rng.random(n) < 0.3, 0.0, rng.normal(size=n))
    return matrix, constant, matrix == 0, constant == 0


def _solution(matrix: Any, constant: Any, no_matrix: np.ndarray, no_constant: np.ndarray) -> Any:
    rows = [[None if no_matrix[i, j] else matrix[i, j] for j in range(len(matrix))] for i in range(len(matrix))]
    return jnp.stack(
        [
            jnp.asarray(computed(x))
            for x in eliminated(rows, [None if no else b for b, no in zip(constant, no_constant, strict=True)])
        ]
    )


@pytest.mark.thorough
@pytest.mark.parametrize("n", range(1, SMALL + 1))
def test_solution(n: int) -> None:
    for seed in range(10):
        matrix, constant, *structure = _system(np.random.default_rng(seed), n)
        found = _solution(jnp.asarray(matrix), jnp.asarray(constant), *structure)
        np.testing.assert_allclose(found, -np.linalg.solve(matrix, constant), rtol=1e-12, atol=1e-13)


@pytest.mark.parametrize("n", [2, 3, 5])
def test_solution_for_each_element_of_arrays(n: int) -> None:
    matrix, constant, *structure = _system(np.random.default_rng(0), n)
    factors = np.array([1.0, 2.0, -3.0])
    found = _solution(jnp.asarray(matrix[..., None] * np.ones(3)), jnp.asarray(constant[:, None] * factors), *structure)
    np.testing.assert_allclose(found, -np.linalg.solve(matrix, constant)[:, None] * factors, rtol=1e-12, atol=1e-13)


@pytest.mark.thorough
@pytest.mark.parametrize("n", [3, 5])
def test_derivatives_in_both_modes(n: int) -> None:
    matrix, constant, *structure = _system(np.random.default_rng(1), n)
    check_grads(lambda a, b: _solution(a, b, *structure), (matrix, constant), order=2, modes=["fwd", "rev"])


@pytest.mark.parametrize("n", [2, 3, 5])
def test_coefficients_of_very_different_sizes(n: int) -> None:
    """Conductances of open and closed diodes: the residual is as small as rounding of the terms allows."""
    rng, none = np.random.default_rng(2), np.zeros((n, n), bool)
    solution = jax.jit(lambda a, b: _solution(a, b, none, none[0]))
    for _ in range(10):
        matrix, constant = rng.normal(size=(n, n)) * 10.0 ** rng.uniform(-9, 3, (n, n)), rng.normal(size=n)
        found = np.asarray(solution(matrix, constant))
        terms = np.abs(matrix) @ np.abs(found) + np.abs(constant)
        assert (np.abs(matrix @ found + constant) <= 1e-13 * terms).all()
    # Coefficients that happen to be zero are no pivots.
    turned = np.roll(np.eye(n), 1, axis=0)
    np.testing.assert_allclose(solution(turned, np.arange(n) + 1.0), -np.linalg.solve(turned, np.arange(n) + 1.0))
