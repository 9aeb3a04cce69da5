import jax
import jax.numpy as jnp
import lineax as lx
import numpy as np

from acausal.design._identify.least_squares import Reflections


def test_least_squares_are_those_of_numpy():
    rng = np.random.default_rng(3)
    matrix, right = rng.normal(size=(5, 30, 3)), rng.normal(size=(5, 30))

    def solved(a, b):
        return lx.linear_solve(lx.MatrixLinearOperator(a), b, Reflections(), throw=False).value

    found = jax.jit(jax.vmap(solved))(jnp.asarray(matrix), jnp.asarray(right))
    expected = [np.linalg.lstsq(a, b, rcond=None)[0] for a, b in zip(matrix, right, strict=True)]
    np.testing.assert_allclose(found, expected, rtol=1e-9)
