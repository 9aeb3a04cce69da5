"""`in_parts`: `jax.jit` for functions of known numbers."""

import functools as ft
from collections.abc import Callable, Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import PyTree

from .._jax_private import ClosedJaxpr, trace_context
from .._jax_settings import programs
from .._made_once import made_once
from .._tracing import is_traced, within_transformation
from .forward import with_jacobian
from .known_derivatives import are_differentiated, value_and_jacobian_by_jax, with_known_derivatives
from .program import REPAYS, Compiler, NumbersProgram
from .simplify import NotPlainError, simplified

Kinds = tuple[tuple[tuple[int, ...], Any], ...]  # shape and type of each number
Call = Callable[[list[Any]], PyTree]

LATER = 100  # calls after which a compiled part is optimised


def in_parts(function: Callable[..., PyTree], static_argnums: Sequence[int] = ()) -> Callable[..., PyTree]:
    """Like `jax.jit`. With known numbers, the function is interpreted first and compiled in parts when that pays."""
    jitted, program = jax.jit(function, static_argnums=static_argnums), _programs(function, static_argnums)

    @ft.wraps(function)
    def call(*arguments: Any) -> PyTree:
        statics = tuple(arguments[i] for i in static_argnums)
        others = [value for i, value in enumerate(arguments) if i not in static_argnums]
        leaves, structure = jax.tree.flatten(others)

        def by_jax(leaves: list[Any]) -> PyTree:
            return jitted(*_merged(statics, static_argnums, structure.unflatten(leaves)))

        return evaluated(leaves, lambda kinds, moving: program(statics, structure, kinds, moving), by_jax)

    return call


def jacobian_in_parts(function: Callable[[Any], PyTree]) -> Callable[[Any], tuple[PyTree, list[Array]]]:
    """A function of an array that computes `function` and the derivatives of its floating-point results, by forward
    mode. The first axes of each derivative are those of the array, flat. It is evaluated like `in_parts`.
    """
    program = _programs(function, ())
    by_jax = jax.jit(value_and_jacobian_by_jax(lambda leaves: function(*leaves), [0]))

    def call(x: Array) -> tuple[PyTree, list[Array]]:
        leaves, structure = jax.tree.flatten([x])
        return evaluated(leaves, lambda kinds, _: program((), structure, kinds, (0,)), by_jax)

    return call


def _programs(function: Callable[..., PyTree], static_argnums: Sequence[int]) -> Callable[..., Call | None]:
    """The programs of a function by its static arguments, the structure and kinds of all others, and the moving leaves
    as in `traced`.
    """

    @made_once(maxsize=256)
    def program(statics: tuple[Any, ...], structure: Any, kinds: Kinds, moving: tuple[int, ...]) -> Call | None:
        shapes = [jax.ShapeDtypeStruct(*kind) for kind in kinds]
        try:
            closed, outputs = traced(
                lambda others: function(*_merged(statics, static_argnums, others)), structure, shapes, moving
            )
        except NotPlainError:
            return None
        name = getattr(function, "__name__", "function").strip("_<>")
        return runner(closed, outputs, Compiler(name), REPAYS // LATER)

    return program


def _merged(statics: Sequence[Any], places: Sequence[int], others: Sequence[Any]) -> list[Any]:
    """All arguments, of which the static ones have these places."""
    rest, given = iter(others), dict(zip(places, statics, strict=True))
    return [given[i] if i in given else next(rest) for i in range(len(others) + len(statics))]


def evaluated(
    leaves: list[Any], program: Callable[[Kinds, tuple[int, ...]], Call | None], by_jax: Callable[[list[Any]], PyTree]
) -> PyTree:
    """The results of a function of leaves, if possible by its programs, also where jax differentiates it.

    `program(kinds, moving)` is the program for numbers of some kinds, as `traced` makes it; None if there is none.
    """

    def call(leaves: list[Any], moving: tuple[int, ...]) -> Callable[[], PyTree] | None:
        numbers = known_numbers(leaves)
        if numbers is None:
            return None
        made = program(tuple((x.shape, x.dtype) for x in numbers), moving)
        return None if made is None else ft.partial(made, numbers)

    if are_differentiated(leaves):
        return with_known_derivatives(by_jax, call, leaves)
    own = call(leaves, ())
    return by_jax(leaves) if own is None else own()


def traced(
    function: Callable[[Any], PyTree], structure: Any, shapes: Sequence[Any], moving: Sequence[int] = ()
) -> tuple[ClosedJaxpr, Any]:
    """The simplified jaxpr of a function, and the structure of its results. Raises `NotPlainError`.

    With `moving` leaves, the results are a pair: the results of the function, and a list of their derivatives with
    respect to these leaves, as `with_jacobian` computes them.
    """
    outputs: list[Any] = []

    def run(*leaves: Any) -> list[Any]:
        found, whole = jax.tree.flatten(function(structure.unflatten(leaves)))
        outputs[:] = [whole]
        return found

    closed = jax.make_jaxpr(run)(*shapes)
    if not moving:
        return simplified(closed), outputs[0]
    if closed.effects or any(jnp.issubdtype(aval.dtype, jnp.complexfloating) for aval in closed.out_avals):
        raise NotPlainError
    try:
        both = with_jacobian(closed, moving)
    except Exception as error:  # such as of a function without a forward mode: jax differentiates it, or refuses it
        raise NotPlainError from error
    n, m = outputs[0].num_leaves, len(both.jaxpr.outvars)
    return simplified(both), jax.tree.structure((outputs[0].unflatten(range(n)), list(range(m - n))))


def runner(closed: ClosedJaxpr, outputs: Any, compiler: Compiler, steps: int) -> Call:
    """The program of a simplified jaxpr, as a function of leaves that returns jax's arrays."""
    program = NumbersProgram(closed, compiler, steps, at_once=not programs.in_parts)
    return lambda leaves: outputs.unflatten(jax.device_put(program(leaves), may_alias=False))


def known_numbers(leaves: Sequence[Any]) -> list[Any] | None:
    """The leaves as arrays of strong types; None if a function of them cannot be evaluated here and now."""
    if within_transformation() or not all(map(_is_plain, leaves)) or not is_usual():
        return None
    return [leaf if isinstance(leaf, jax.Array) and not leaf.weak_type else np.asarray(leaf) for leaf in leaves]


def _is_plain(leaf: Any) -> bool:
    """Whether a leaf is a known number on the default device."""
    if isinstance(leaf, np.ndarray | np.generic | float | int):
        return True
    return isinstance(leaf, jax.Array) and not is_traced(leaf) and len(leaf.devices()) == 1


def is_usual() -> bool:
    """Whether jax compiles for the CPU with the settings that it had when the library was imported."""
    config: Any = jax.config
    others = (config.jax_debug_nans, config.jax_debug_infs, config.jax_disable_jit, config.jax_default_device)
    if any(others) or not config.jax_enable_x64 or trace_context() != programs.context:
        return False
    return jax.default_backend() == "cpu" and jax.device_count() == 1
