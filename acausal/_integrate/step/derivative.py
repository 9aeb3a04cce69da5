"""Derivatives of a run in both modes, from a program that is little larger than the run."""

from collections.abc import Callable, Sequence

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.custom_derivatives import SymbolicZero
from jaxtyping import PyTree

from ..._jax_private import jaxpr_as_fun
from ..._numbers import Numbers
from ..._progress import differentiating
from ..._tangents import array_of

Arrays = list[Array]
Function = Callable[[Arrays], PyTree]

FEW = 100  # with up to so many numbers that vary, derivatives are computed along each of them
HELD = 1_000_000  # if all derivatives together have no more numbers than this


def differentiable(quick: Function, reversible: Function, size: int) -> Function:
    r"""A function of some arrays, to be differentiated to any order in both modes.

    It is given twice: as `quick`, of which there is only the forward mode, and as `reversible`, of which there are
    both, and which compiles for longer. Where few numbers vary, the derivatives $J$ along all of them are computed as
    one batch beside the value, by `quick`, and in either mode what follows is a product with $J$. Where many vary, or
    where $J$ would be large with the `size` of the value, it is `reversible` that is differentiated.
    """
    quick = _traced_once(quick)

    @jax.custom_jvp
    def function(arrays: Arrays) -> PyTree:
        return quick(arrays)

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


def _traced_once(function: Function) -> Function:
    """The function as a program for each shape of its arrays: its value and its derivatives are made from one trace."""
    programs: dict[object, Function] = {}

    def program(arrays: Arrays) -> PyTree:
        kinds = tuple((np.shape(x), jnp.result_type(x)) for x in arrays)
        if kinds not in programs:
            closed, shapes = jax.make_jaxpr(function, return_shape=True)(arrays)
            programs[kinds] = lambda arrays: jax.tree.structure(shapes).unflatten(jaxpr_as_fun(closed)(*arrays))
        return programs[kinds](arrays)

    return program


def _with_derivatives(function: Function, moving: Sequence[int]) -> Function:
    """The value of a function, and its derivatives along each number of some of its arrays, stacked."""

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
    """As a batch of one; `jax.vmap` would compile more for it."""
    return jax.tree.map(lambda x: x[None], one)


def _change(value: Numbers, derivatives: Array | None, step: Array) -> Numbers:
    if derivatives is None:  # of what is no real number
        return np.zeros(np.shape(value), jax.dtypes.float0)
    return jnp.tensordot(step, derivatives, 1)


def _is_real(x: Array) -> bool:
    return jnp.issubdtype(x.dtype, jnp.floating)
