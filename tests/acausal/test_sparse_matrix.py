"""Sparse matrices: colours, elimination and solutions, against dense ones."""

import jax
import jax.numpy as jnp
import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import sparse

from acausal._linear_solver import linear_solver
from acausal._sparse_matrix import SparseMatrix, Structure, column_colours, least_degree, pattern_of


def structure_of(draw: np.random.Generator, n: int, density: float) -> Structure:
    return sparse.csr_array(draw.random((n, n)) < density)


def random_matrix(draw: np.random.Generator, structure: Structure) -> tuple[SparseMatrix, np.ndarray]:
    """A matrix with a dominant diagonal, sparse and dense."""
    pattern = pattern_of(structure, np.inf)
    assert pattern is not None
    entries, diagonal = draw.normal(size=len(pattern.rows)), 3.0 * pattern.n + draw.random(pattern.n)
    dense = np.diag(diagonal)
    np.add.at(dense, (pattern.rows, pattern.columns), entries)
    return SparseMatrix(jnp.asarray(entries), jnp.asarray(diagonal), pattern), dense


@given(st.integers(0, 2**32 - 1), st.integers(1, 12), st.sampled_from([0.0, 0.1, 0.4, 1.0]))
@settings(max_examples=8, deadline=None)
def test_solutions_are_those_of_the_dense_matrix(seed: int, n: int, density: float) -> None:
    draw = np.random.default_rng(seed)
    matrix, dense = random_matrix(draw, structure_of(draw, n, density))
    b = draw.normal(size=n)
    factors = jax.jit(lambda matrix: matrix.factors())(matrix)
    product, solution, transposed = jax.jit(
        lambda factors, b: (factors.matrix @ b, factors.solve(b), factors.substituted_transposed(b))
    )(factors, jnp.asarray(b))
    np.testing.assert_allclose(product, dense @ b, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(solution, np.linalg.solve(dense, b), rtol=1e-11)
    np.testing.assert_allclose(transposed, np.linalg.solve(dense.T, b), rtol=1e-11)


@given(st.integers(0, 2**32 - 1), st.integers(1, 30), st.floats(0.0, 0.5))
def test_columns_of_one_colour_share_no_row(seed: int, n: int, density: float) -> None:
    structure = structure_of(np.random.default_rng(seed), n, density)
    colours = column_colours(structure)
    dense = structure.toarray()
    for colour in range(colours.max() + 1):
        assert dense[:, colours == colour].sum(axis=1).max() <= 1


def test_a_batch_of_matrices_and_of_right_hand_sides() -> None:
    draw = np.random.default_rng(3)
    matrix, dense = random_matrix(draw, structure_of(draw, 9, 0.2))
    scales, b = jnp.array([1.0, -2.0]), jnp.asarray(draw.normal(size=(2, 9)))

    def solved(scale: jax.Array, b: jax.Array) -> jax.Array:
        scaled = SparseMatrix(scale * matrix.entries, scale * matrix.diagonal, matrix.pattern)
        return scaled.factors().solve(b)

    found = jax.jit(jax.vmap(solved))(scales, b)
    np.testing.assert_allclose(found, np.linalg.solve(dense, b.T).T / scales[:, None], rtol=1e-11)
    many = jax.jit(jax.vmap(matrix.factors().solve))(b)
    np.testing.assert_allclose(many, np.linalg.solve(dense, b.T).T, rtol=1e-11)


def test_a_batch_decides_whether_to_solve() -> None:
    draw = np.random.default_rng(5)
    matrix, dense = random_matrix(draw, structure_of(draw, 9, 0.2))
    b = jnp.asarray(draw.normal(size=(2, 9)))

    def solved(is_wanted: jax.Array, b: jax.Array) -> jax.Array:
        return jax.lax.cond(is_wanted, lambda: matrix.factors().solve(b), lambda: b)

    found = jax.jit(jax.vmap(solved))(jnp.array([True, False]), b)
    np.testing.assert_allclose(found, [np.linalg.solve(dense, b[0]), b[1]], rtol=1e-11)


def test_derivatives_with_respect_to_entries_and_right_hand_side() -> None:
    draw = np.random.default_rng(4)
    matrix, dense = random_matrix(draw, structure_of(draw, 6, 0.3))
    pattern, way = matrix.pattern, draw.normal(size=6)
    b, weight = jnp.asarray(draw.normal(size=6)), jnp.asarray(draw.normal(size=6))

    def sparse_one(entries: jax.Array, b: jax.Array) -> jax.Array:
        return weight @ linear_solver(SparseMatrix(entries, matrix.diagonal, pattern))(b)

    def dense_one(entries: jax.Array, b: jax.Array) -> jax.Array:
        full = jnp.diag(matrix.diagonal).at[pattern.rows, pattern.columns].add(entries)
        return weight @ jnp.linalg.solve(full, b)

    for found, expected in zip(
        jax.jit(jax.grad(sparse_one, argnums=(0, 1)))(matrix.entries, b),
        jax.grad(dense_one, argnums=(0, 1))(matrix.entries, b),
        strict=True,
    ):
        np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-14)
    along = jax.jvp(lambda b: sparse_one(matrix.entries, b), (b,), (jnp.asarray(way),))[1]
    np.testing.assert_allclose(along, weight @ np.linalg.solve(dense, way), rtol=1e-10)


def test_a_pivot_that_vanishes_gives_nan() -> None:
    pattern = pattern_of(sparse.csr_array(np.array([[False, True], [True, False]])), np.inf)
    assert pattern is not None
    exchange = SparseMatrix(jnp.ones(2), jnp.zeros(2), pattern)
    nearly = SparseMatrix(jnp.ones(2), jnp.full(2, 1e-12), pattern)
    for matrix in (exchange, nearly):
        assert np.isnan(matrix.factors().solve(jnp.array([1.0, 2.0]))).any()


def test_elimination_of_a_chain_and_of_a_star_fills_nothing_in() -> None:
    n = 50
    chain = sparse.csr_array(np.eye(n, k=1) + np.eye(n, k=-1) > 0.0)
    star = np.zeros((n, n), bool)
    star[n // 2], star[:, n // 2] = True, True
    for structure in (chain, sparse.csr_array(star)):
        pattern = pattern_of(structure, np.inf)
        assert pattern is not None
        assert pattern.elimination.size == n + 2 * (n - 1)
    assert pattern_of(sparse.csr_array(np.ones((n, n), bool)), n) is None
    assert [row for row, _ in least_degree(sparse.csr_array(star), np.inf) or []][-1] in {0, n // 2, n - 1}
