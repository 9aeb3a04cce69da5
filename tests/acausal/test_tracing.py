"""Functions that are traced once and replayed."""

import jax
import jax.numpy as jnp
import numpy as np

from acausal._tracing import traced_once


def test_a_function_is_traced_once() -> None:
    calls = []

    def function(x: jax.Array, y: dict[str, jax.Array]) -> tuple[jax.Array, dict[str, jax.Array]]:
        calls.append(1)
        return jnp.sin(x) * y["a"], {"b": y["a"]}

    replayed, shapes = traced_once(function, 1.0, {"a": jnp.ones(3)})
    assert shapes[0].shape == (3,)
    for x in (0.5, 2.0):
        found, rest = replayed(x, {"a": jnp.arange(3.0)})
        np.testing.assert_allclose(found, np.sin(x) * np.arange(3.0), rtol=1e-15)
        np.testing.assert_array_equal(rest["b"], np.arange(3.0))
    assert len(calls) == 1


def test_a_replayed_function_reads_traced_numbers_and_is_differentiated_by_them() -> None:
    def of(p: jax.Array) -> jax.Array:
        replayed, _ = traced_once(lambda x: p * x**2, jnp.asarray(1.0))
        return replayed(replayed(jnp.asarray(2.0)))  # p (4 p)^2

    for differentiate in (jax.grad, jax.jacfwd):
        np.testing.assert_allclose(jax.jit(differentiate(of))(3.0), 3 * 16 * 9.0, rtol=1e-14)
