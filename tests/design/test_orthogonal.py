import jax
import jax.numpy as jnp
import lineax as lx
import numpy as np
import pytest

from acausal.design._orthogonal import Reflections


@pytest.mark.parametrize(("rows", "columns"), [(1, 1), (4, 4), (30, 3), (200, 12)])
def test_least_squares_are_those_of_numpy(rows, columns):
    rng = np.random.default_rng(rows)
    matrix = rng.normal(size=(5, rows, columns)) * 10.0 ** rng.uniform(-4, 4, columns)
    right = rng.normal(size=(5, rows))

    def solved(a, b):
        return lx.linear_solve(lx.MatrixLinearOperator(a), b, Reflections(), throw=False).value

    found = jax.jit(jax.vmap(solved))(jnp.asarray(matrix), jnp.asarray(right))
    expected = [np.linalg.lstsq(a, b, rcond=None)[0] for a, b in zip(matrix, right, strict=True)]
    np.testing.assert_allclose(found, expected, rtol=1e-9)


def test_an_ill_conditioned_fit_keeps_the_digits_that_normal_equations_lose():
    t = np.linspace(0.0, 1.0, 40)
    matrix = np.vander(t, 9)
    exact = np.arange(1.0, 10.0)
    found = lx.linear_solve(lx.MatrixLinearOperator(jnp.asarray(matrix)), jnp.asarray(matrix @ exact), Reflections())
    np.testing.assert_allclose(found.value, exact, rtol=1e-8)


def test_no_call_of_lapack_is_compiled():
    solve = jax.jit(lambda a, b: lx.linear_solve(lx.MatrixLinearOperator(a), b, Reflections(), throw=False).value)
    assert "custom_call" not in solve.lower(jnp.ones((4, 2)), jnp.ones(4)).as_text()
