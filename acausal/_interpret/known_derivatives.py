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
# A call, for given leaves, of the program for a function and its derivatives with respect to the numbers of some of
# them, as `with_jacobian` computes them; None if there is no program.
ValueAndJacobian = Callable[[Leaves, tuple[int, ...]], Callable[[], tuple[PyTree, list[Array]]] | None]


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
        is_small = sum(np.size(leaves[i]) for i in moving) <= FEW
        if is_small and all(is_real(leaves[i]) for i in moving) and not are_traced(leaves):
            with outside_transformations():
                call = value_and_jacobian(leaves, moving)
                found = None if call is None else call()
            if found is not None:
                return found[0], tangents_of(*found, [changes[i] for i in moving])
        return pushed(function, primals, tangents)

    differentiated.defjvp(rule, symbolic_zeros=True)
    return differentiated(leaves)


def value_and_jacobian_by_jax(
    function: Callable[[Leaves], PyTree], moving: Sequence[int]
) -> Callable[[Leaves], tuple[PyTree, list[Array]]]:
    """A function for the results of another one, and for the derivatives of its floating-point results with respect to
    each number of the `moving` leaves, along the first axis.
    """

    def both(leaves: Leaves) -> tuple[PyTree, list[Array]]:
        shapes = [np.shape(leaves[i]) for i in moving]
        ends = np.cumsum([0, *(np.prod(shape, dtype=int) for shape in shapes)])

        def of_moving(parts: Leaves) -> PyTree:
            whole = dict(enumerate(leaves)) | dict(zip(moving, parts, strict=True))
            return function(list(whole.values()))

        def along(direction: Array) -> tuple[PyTree, PyTree]:
            parts = [direction[a:b].reshape(shape) for a, b, shape in zip(ends, ends[1:], shapes, strict=False)]
            return jax.jvp(of_moving, ([leaves[i] for i in moving],), (parts,))

        found = jax.vmap(along)(jnp.eye(ends[-1])) if ends[-1] > 1 else _stacked(along(jnp.ones(1)))
        values, changes = (jax.tree.leaves(part) for part in found)
        results = jax.tree.map(lambda x: x[0], found[0])
        return results, [change for value, change in zip(values, changes, strict=True) if is_real(value)]

    return both


def _stacked(one: PyTree) -> PyTree:
    """A batch of one, which compiles faster than `jax.vmap`."""
    return jax.tree.map(lambda x: x[None], one)


def tangents_of(values: PyTree, derivatives: Leaves, changes: Leaves) -> PyTree:
    """The tangents of results, from their derivatives and the tangents of the moving leaves."""
    products = iter(_products(changes, derivatives))
    return jax.tree.map(lambda x: next(products) if is_real(x) else np.zeros(np.shape(x), jax.dtypes.float0), values)


@jax.jit
def _products(changes: Leaves, derivatives: Leaves) -> list[Array]:
    direction = jnp.concatenate([jnp.zeros(0), *map(jnp.ravel, changes)])
    return [jnp.tensordot(direction, derivative, 1).astype(derivative.dtype) for derivative in derivatives]


def is_real(x: Numbers) -> bool:
    """Whether a number can have a derivative."""
    return jnp.issubdtype(jnp.result_type(x), jnp.floating)
