"""Values that jax is tracing, functions traced once, and tangents in rules of `jax.custom_jvp`, which can be symbolic
zeros.
"""

import contextlib
from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.custom_derivatives import SymbolicZero
from jaxtyping import PyTree

from ._jax_private import Tracer, get_opaque_trace_state, jaxpr_as_fun
from ._numbers import Numbers

_OUTSIDE = get_opaque_trace_state()


def is_traced(value: object) -> bool:
    """Whether `value` is being traced by a transformation such as `jax.jit` or `jax.grad`."""
    return isinstance(value, Tracer)


def are_traced(*values: object) -> bool:
    """Whether any number in some pytrees is being traced."""
    return any(map(is_traced, jax.tree.leaves(values)))


def within_transformation() -> bool:
    """Whether a function is being traced, even if its numbers are known."""
    return get_opaque_trace_state() != _OUTSIDE


def evaluated_now(*values: object) -> AbstractContextManager[Any]:
    """A context in which functions of `values` have known results if the values are known, also within a function that
    jax traces.
    """
    if are_traced(*values) or not within_transformation():
        return contextlib.nullcontext()
    return jax.ensure_compile_time_eval()


def traced_once(function: Callable[..., PyTree], *examples: PyTree) -> tuple[Callable[..., PyTree], PyTree]:
    """The function, traced for arguments like the examples and replayed by each call, and the shapes of its results.

    Valid within the trace in which it is made, since the function may read other traced numbers.
    """
    closed, shapes = jax.make_jaxpr(function, return_shape=True)(*examples)
    replay, structure = jaxpr_as_fun(closed), jax.tree.structure(shapes)
    return lambda *arguments: structure.unflatten(replay(*jax.tree.leaves(arguments))), shapes


def known(value: object) -> np.ndarray | None:
    """The numbers of a value, also during differentiation; None if `jax.jit` or `jax.vmap` trace it."""
    # The primal of a value that is only differentiated.
    value = jax.lax.stop_gradient(value)
    return None if is_traced(value) else np.asarray(value)


def array_of(tangent: Array | SymbolicZero) -> Numbers:
    """A tangent as an array; a symbolic zero becomes an array of zeros."""
    if not isinstance(tangent, SymbolicZero):
        return tangent
    aval: Any = tangent.aval
    zeros = np.zeros if aval.dtype == jax.dtypes.float0 else jnp.zeros
    return zeros(aval.shape, aval.dtype)


def pushed(
    function: Callable[..., Numbers], primals: tuple[PyTree, ...], tangents: tuple[PyTree, ...]
) -> tuple[Array, Array]:
    """`jax.jvp` along the leaves with a nonzero tangent only."""
    leaves, structure = jax.tree_util.tree_flatten(primals)
    directions = jax.tree_util.tree_leaves(tangents, is_leaf=lambda x: isinstance(x, SymbolicZero))
    moving = [i for i, direction in enumerate(directions) if not isinstance(direction, SymbolicZero)]

    def of_moving(*values: Array) -> Numbers:
        whole = list(leaves)
        for i, value in zip(moving, values, strict=True):
            whole[i] = value
        return function(*structure.unflatten(whole))

    return jax.jvp(of_moving, tuple(leaves[i] for i in moving), tuple(directions[i] for i in moving))
