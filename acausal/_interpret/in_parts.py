"""`in_parts`: `jax.jit` for functions of known numbers."""

import functools as ft
from collections.abc import Callable, Sequence
from typing import Any

import jax
import numpy as np
from jaxtyping import PyTree

from .._jax_private import ClosedJaxpr, trace_context
from .._jax_settings import programs
from .._made_once import made_once
from .._tracing import is_traced, within_transformation
from .program import REPAYS, Compiler, NumbersProgram
from .simplify import NotPlainError, simplified

Kinds = tuple[tuple[tuple[int, ...], Any], ...]  # shape and type of each number
Call = Callable[[list[Any]], PyTree]

LATER = 100  # calls after which a compiled part is optimised


def in_parts(function: Callable[..., PyTree], static_argnums: Sequence[int] = ()) -> Callable[..., PyTree]:
    """Like `jax.jit`. With known numbers, the function is interpreted first and compiled in parts when that pays."""
    jitted = jax.jit(function, static_argnums=static_argnums)

    @made_once(maxsize=256)
    def program(statics: tuple[Any, ...], structure: Any, kinds: Kinds) -> Call | None:
        def of_numbers(arguments: list[Any]) -> PyTree:
            whole, given = iter(arguments), dict(zip(static_argnums, statics, strict=True))
            n = len(arguments) + len(statics)
            return function(*(given[i] if i in given else next(whole) for i in range(n)))

        shapes = [jax.ShapeDtypeStruct(*kind) for kind in kinds]
        try:
            closed, outputs = traced(of_numbers, structure, shapes)
        except NotPlainError:
            return None
        name = getattr(function, "__name__", "function").strip("_<>")
        return runner(NumbersProgram(closed, Compiler(name), REPAYS // LATER, at_once=not programs.in_parts), outputs)

    @ft.wraps(function)
    def call(*arguments: Any) -> PyTree:
        statics = tuple(arguments[i] for i in static_argnums)
        others = [value for i, value in enumerate(arguments) if i not in static_argnums]
        leaves, structure = jax.tree.flatten(others)
        numbers = known_numbers(leaves)
        if numbers is None:
            return jitted(*arguments)
        made = program(statics, structure, tuple((x.shape, x.dtype) for x in numbers))
        return jitted(*arguments) if made is None else made(numbers)

    return call


def traced(function: Callable[[Any], PyTree], structure: Any, shapes: Sequence[Any]) -> tuple[ClosedJaxpr, Any]:
    """The simplified jaxpr of a function, and the structure of its results. Raises `NotPlainError`."""
    outputs: list[Any] = []

    def run(*leaves: Any) -> list[Any]:
        found, whole = jax.tree.flatten(function(structure.unflatten(leaves)))
        outputs[:] = [whole]
        return found

    closed = simplified(jax.make_jaxpr(run)(*shapes))
    return closed, outputs[0]


def runner(program: NumbersProgram, outputs: Any) -> Call:
    """The program as a function of leaves that returns jax's arrays."""
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
