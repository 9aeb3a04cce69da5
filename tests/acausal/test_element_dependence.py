"""The elements on which the elements of an array depend: those of the Jacobian, or all if an operation is unknown."""

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from acausal._reduce.element_dependence import element_dependence

X = np.array([0.3, 1.2, -0.4, 2.5])
LOCAL: list[Callable[[jax.Array], jax.Array]] = [
    lambda x: jnp.diff(x) * x[1:],
    lambda x: jnp.concatenate([x[:1], jnp.sin(x[::-1]), jnp.ones(2)]),
    lambda x: jnp.pad(x**2, (1, 2)),
    lambda x: x[jnp.array([2, 0])] / x[3],
    lambda x: jnp.where(x > x[::-1], 2.0 * x, 3.0 * x),
    lambda x: jnp.outer(x, jnp.ones(2)).T,
    lambda x: jnp.stack([jax.nn.relu(x[0]), jnp.ones(())]),
]
WHOLE: list[Callable[[jax.Array], jax.Array]] = [
    lambda x: jnp.cumsum(x)[:2],
    lambda x: jnp.linalg.solve(jnp.eye(4) + jnp.diag(x), x),
    lambda x: jax.lax.fori_loop(0, 3, lambda _, y: 0.5 * y, x),
]


def structure(function: Callable[[jax.Array], jax.Array]) -> np.ndarray:
    """The structure of a function of X and of a number that does not count."""
    closed = jax.make_jaxpr(lambda p, x: p * function(x))(jnp.ones(()), X)
    (found,) = element_dependence(closed, [False, True])
    return found.toarray() != 0


def jacobian(function: Callable[[jax.Array], jax.Array]) -> np.ndarray:
    """Where the Jacobian differs from zero at one of some points."""
    found = jax.jit(jax.vmap(jax.jacfwd(function)))(jnp.stack([X, X[::-1], np.abs(X)]))
    return np.any(np.reshape(found, (3, -1, len(X))) != 0, axis=0)


@pytest.mark.parametrize("function", LOCAL)
def test_the_structure_is_that_of_the_jacobian(function: Callable[[jax.Array], jax.Array]) -> None:
    found, wanted = structure(function), jacobian(function)
    assert not (wanted & ~found).any()
    if function is not LOCAL[4]:  # the condition reads the other element
        np.testing.assert_array_equal(found, wanted)


@pytest.mark.parametrize("function", WHOLE)
def test_unknown_operations_depend_on_all_elements(function: Callable[[jax.Array], jax.Array]) -> None:
    assert structure(function).all()
