"""Derivatives of a run in both modes, from a program only slightly larger than the run."""

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.custom_derivatives import SymbolicZero
from jax.flatten_util import ravel_pytree
from jaxtyping import PyTree

from ..._interpret.known_derivatives import FEW, is_real, tangents_of, value_and_jacobian_by_jax
from ..._progress import differentiating
from ..._reduce.jaxpr import DIFFERENTIATED
from ..._tracing import pushed, traced_once

Arrays = list[Array]
Function = Callable[[Arrays], PyTree]

LARGEST_JACOBIAN = 1_000_000  # its largest number of elements: 8 MB


def differentiable(quick: Function, reversible: Function, size: int) -> Function:
    r"""A function of arrays that can be differentiated to any order in both modes.

    It is given in two forms: `quick` supports forward mode only; `reversible` supports both modes, but compiles more
    slowly. If few inputs vary, `quick` computes the Jacobian $J$ as one batch together with the value, and both modes
    multiply by $J$. If many vary, or $J$ is large for a value of this `size`, `reversible` is differentiated.
    """
    quick = _traced_by_kinds(quick)
    named = jax.jit(_named(lambda arrays: _mapped_together(quick(arrays), arrays), DIFFERENTIATED))

    @jax.custom_jvp
    def function(arrays: Arrays) -> PyTree:
        return named(arrays)

    def rule(primals: tuple[Arrays], tangents: tuple[Arrays]) -> tuple[PyTree, PyTree]:
        differentiating()
        (arrays,), (changes,) = primals, tangents
        moving = [i for i, change in enumerate(changes) if not isinstance(change, SymbolicZero)]
        n = sum(np.size(arrays[i]) for i in moving)
        if n > FEW or n * size > LARGEST_JACOBIAN:
            return pushed(reversible, primals, tangents)
        quick_both, reversible_both = (value_and_jacobian_by_jax(form, moving) for form in (quick, reversible))
        value, derivatives = differentiable(quick_both, reversible_both, (1 + n) * size)(arrays)
        return value, tangents_of(value, derivatives, [changes[i] for i in moving])

    function.defjvp(rule, symbolic_zeros=True)
    return function


def _named(function: Function, name: str) -> Function:
    def named(arrays: Arrays) -> PyTree:
        return function(arrays)

    named.__name__ = name
    return named


def _mapped_together(results: PyTree, arguments: Arrays) -> PyTree:
    """The same results. `jax.vmap` maps all real ones if it maps any argument.

    Each tangent reads all arguments. jax mistakes the shape of a result that is not mapped if its tangent is, where it
    differentiates a mapped `jax.custom_jvp` within `jax.jit`. So a truth that reads them chooses between equals.
    """
    numbers = ravel_pytree(arguments)[0]
    either = jnp.any(numbers != numbers)
    return jax.tree.map(lambda x: jax.lax.select_n(either, x, x) if is_real(x) else x, results)


def _traced_by_kinds(function: Function) -> Function:
    """The function, traced once for each set of argument shapes. Its value and its derivatives share the trace."""
    programs: dict[object, Function] = {}

    def program(arrays: Arrays) -> PyTree:
        kinds = tuple((np.shape(x), jnp.result_type(x)) for x in arrays)
        if kinds not in programs:
            programs[kinds], _ = traced_once(function, arrays)
        return programs[kinds](arrays)

    return program
