"""Derivatives of a function at known numbers, from a program that computes its value and Jacobian together."""

from collections.abc import Callable, Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.custom_derivatives import SymbolicZero
from jaxtyping import PyTree

from .._jax_private import outside_transformations
from .._numbers import Numbers
from .._progress import differentiating
from .._tracing import are_traced, is_traced, known, pushed

FEW = 100  # largest number of varying inputs for which the full Jacobian is computed in forward mode

Leaves = list[Any]
# The results of a function and a list of their derivatives with respect to the numbers of some leaves, as
# `with_jacobian` gives them; None if there is no program for them.
ValueAndJacobian = Callable[[Leaves, tuple[int, ...]], tuple[PyTree, list[Array]] | None]


def are_differentiated(leaves: Sequence[Any]) -> bool:
    """Whether all numbers are known, and jax differentiates with respect to some of them."""
    return any(map(is_traced, leaves)) and all(not is_traced(leaf) or known(leaf) is not None for leaf in leaves)


def with_known_derivatives(
    function: Callable[[Leaves], PyTree], value_and_jacobian: ValueAndJacobian, leaves: Leaves
) -> PyTree:
    """The results of a function of leaves that jax differentiates at known numbers, in either mode.

    With respect to many numbers, and for higher derivatives, jax differentiates `function` itself.
    """

    @jax.custom_jvp
    def differentiated(leaves: Leaves) -> PyTree:
        return function(leaves)

    def rule(primals: tuple[Leaves], tangents: tuple[Leaves]) -> tuple[PyTree, PyTree]:
        differentiating()
        (leaves,), (changes,) = primals, tangents
        moving = tuple(i for i, change in enumerate(changes) if not isinstance(change, SymbolicZero))
        found = None
        is_small = sum(np.size(leaves[i]) for i in moving) <= FEW
        if is_small and all(_is_real(leaves[i]) for i in moving) and not are_traced(leaves):
            with outside_transformations():
                found = value_and_jacobian(leaves, moving)
        if found is None:
            return pushed(function, primals, tangents)
        values, derivatives = found
        products = iter(_products([changes[i] for i in moving], derivatives))
        return values, jax.tree.map(lambda x: next(products) if _is_real(x) else _no_tangent(x), values)

    differentiated.defjvp(rule, symbolic_zeros=True)
    return differentiated(leaves)


@jax.jit
def _products(changes: Leaves, derivatives: Leaves) -> list[Array]:
    """The products of derivatives with a direction."""
    direction = jnp.concatenate(list(map(jnp.ravel, changes)))
    return [jnp.tensordot(direction, derivative, 1).astype(derivative.dtype) for derivative in derivatives]


def _no_tangent(x: Numbers) -> np.ndarray:
    return np.zeros(np.shape(x), jax.dtypes.float0)


def _is_real(x: Numbers) -> bool:
    return jnp.issubdtype(jnp.result_type(x), jnp.floating)
