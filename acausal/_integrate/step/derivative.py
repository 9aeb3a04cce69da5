"""Derivatives of a run in both modes, from a program only slightly larger than the run."""

from collections.abc import Callable, Sequence

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.custom_derivatives import SymbolicZero
from jaxtyping import PyTree

from ..._interpret.known_derivatives import FEW
from ..._jax_private import jaxpr_as_fun
from ..._numbers import Numbers
from ..._progress import differentiating
from ..._reduce.jaxpr import DIFFERENTIATED
from ..._tracing import array_of

Arrays = list[Array]
Function = Callable[[Arrays], PyTree]

HELD = 1_000_000  # largest number of elements of this Jacobian


def differentiable(quick: Function, reversible: Function, size: int) -> Function:
    r"""A function of arrays that can be differentiated to any order in both modes.

    It is given in two forms: `quick` supports forward mode only; `reversible` supports both modes, but compiles more
    slowly. If few inputs vary, `quick` computes the Jacobian $J$ as one batch together with the value, and both modes
    multiply by $J$. If many vary, or $J$ is large for a value of this `size`, `reversible` is differentiated.
    """
    quick = _traced_once(quick)
    named = jax.jit(_named(quick, DIFFERENTIATED))

    @jax.custom_jvp
    def function(arrays: Arrays) -> PyTree:
        return named(arrays)

    def rule(primals: tuple[Arrays], tangents: tuple[Arrays]) -> tuple[PyTree, PyTree]:
        differentiating()
        (arrays,), (changes,) = primals, tangents
        moving = [i for i, change in enumerate(changes) if not isinstance(change, SymbolicZero)]
        n = sum(np.size(arrays[i]) for i in moving)
        if n > FEW or n * size > HELD:
            return jax.jvp(reversible, (arrays,), ([array_of(change) for change in changes],))
        both = differentiable(_with_derivatives(quick, moving), _with_derivatives(reversible, moving), (1 + n) * size)
        value, derivatives = both(arrays)
        step = jnp.concatenate([jnp.zeros(0), *(jnp.ravel(changes[i]) for i in moving)])
        return value, jax.tree.map(lambda x, d: _change(x, d, step), value, derivatives)

    function.defjvp(rule, symbolic_zeros=True)
    return function


def _named(function: Function, name: str) -> Function:
    def named(arrays: Arrays) -> PyTree:
        return function(arrays)

    named.__name__ = name
    return named


def _traced_once(function: Function) -> Function:
    """The function, traced once for each set of argument shapes. Its value and its derivatives share the trace."""
    programs: dict[object, Function] = {}

    def program(arrays: Arrays) -> PyTree:
        kinds = tuple((np.shape(x), jnp.result_type(x)) for x in arrays)
        if kinds not in programs:
            closed, shapes = jax.make_jaxpr(function, return_shape=True)(arrays)
            programs[kinds] = lambda arrays: jax.tree.structure(shapes).unflatten(jaxpr_as_fun(closed)(*arrays))
        return programs[kinds](arrays)

    return program


def _with_derivatives(function: Function, moving: Sequence[int]) -> Function:
    """The value of a function, and its stacked derivatives with respect to each number of the `moving` arrays."""

    def both(arrays: Arrays) -> PyTree:
        shapes = [np.shape(arrays[i]) for i in moving]
        ends = np.cumsum([0, *(np.prod(shape, dtype=int) for shape in shapes)])

        def of_moving(parts: Arrays) -> Array:
            whole = dict(enumerate(arrays)) | dict(zip(moving, parts, strict=True))
            return function(list(whole.values()))

        def along(direction: Array) -> PyTree:
            parts = [direction[a:b].reshape(shape) for a, b, shape in zip(ends, ends[1:], shapes, strict=False)]
            return jax.jvp(of_moving, ([arrays[i] for i in moving],), (parts,))

        values, derivatives = jax.vmap(along)(jnp.eye(ends[-1])) if ends[-1] > 1 else _stacked(along(jnp.ones(1)))
        value = jax.tree.map(lambda x: x[0], values)
        return value, jax.tree.map(lambda x, d: d if _is_real(x) else None, value, derivatives)

    return both


def _stacked(one: PyTree) -> PyTree:
    """A batch of one, which compiles faster than `jax.vmap`."""
    return jax.tree.map(lambda x: x[None], one)


def _change(value: Numbers, derivatives: Array | None, step: Array) -> Numbers:
    if derivatives is None:  # the value is not floating point
        return np.zeros(np.shape(value), jax.dtypes.float0)
    return jnp.tensordot(step, derivatives, 1)


def _is_real(x: Array) -> bool:
    return jnp.issubdtype(x.dtype, jnp.floating)
