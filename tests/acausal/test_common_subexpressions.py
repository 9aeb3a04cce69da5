"""Programs in which each operation is done once."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from acausal._evaluate.common_subexpressions import once, without_repetition


def _names(function: Any, *args: Any) -> list[str]:
    return [eqn.primitive.name for eqn in without_repetition(jax.make_jaxpr(function)(*args)).jaxpr.eqns]


def test_the_same_of_the_same_is_computed_once_and_what_nothing_needs_never() -> None:
    def function(x: Any, y: Any) -> Any:
        jnp.cos(y)
        return (jnp.exp(x) + y) * (jnp.exp(x) + y) - jnp.exp(y)

    assert sorted(_names(function, 1.0, 2.0)) == ["add", "exp", "exp", "mul", "sub"]


def test_literals_that_are_equal_but_for_their_sign_or_type_are_told_apart() -> None:
    x = jnp.array(3.0)
    signs = once(lambda: (jnp.arctan2(0.0, -x), jnp.arctan2(-0.0, -x)))
    np.testing.assert_allclose(signs, [np.pi, -np.pi])
    assert len(_names(lambda x: (x * 2.0, x * 2.0, x * 3.0), 1.0)) == 2


def test_of_several_results_another_one_may_be_read_each_time() -> None:
    matrix = jnp.array([[2.0, 1.0], [1.0, 3.0]])

    def function(a: Any) -> Any:
        return jnp.linalg.eigh(a)[0], jnp.linalg.eigh(a)[1]

    values, vectors = once(lambda: function(matrix))
    np.testing.assert_allclose(vectors @ jnp.diag(values) @ vectors.T, matrix, rtol=1e-12)
    assert jax.jit(lambda a: once(lambda: function(a)))(matrix)[0].tolist() == values.tolist()


def test_both_modes_of_differentiation_and_batches_go_through() -> None:
    def function(x: Any) -> Any:
        return once(lambda: jnp.sin(x) * jnp.sin(x) + jax.nn.relu(x))

    x = jnp.linspace(0.1, 1.0, 4)
    expected = jnp.sin(2.0 * x) + 1.0
    np.testing.assert_allclose(jax.vmap(jax.grad(function))(x), expected, rtol=1e-12)
    np.testing.assert_allclose(jax.vmap(jax.jacfwd(function))(x), expected, rtol=1e-12)
