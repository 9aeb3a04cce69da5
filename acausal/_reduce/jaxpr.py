"""Small operations on jaxprs: slicing, interpretation, recursion into calls."""

from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple, TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from .._errors import ModelError
from .._jax_private import (
    Atom,
    ClosedJaxpr,
    DebugInfo,
    Jaxpr,
    JaxprEqn,
    Literal,
    Var,
    high_level,
    high_level_body,
    jaxpr_as_fun,
    pruned,
    spelled_out,
)
from .._numbers import Numbers

T = TypeVar("T")

# Primitives that only move elements, those that join arrays along an axis, and those that combine truth values.
MOVES = frozenset(("copy", "slice", "reshape", "squeeze", "expand_dims", "broadcast_in_dim", "transpose", "rev"))
JOINS = {"stack": (np.stack, "axis"), "concatenate": (np.concatenate, "dimension")}
LOGIC = frozenset(("and", "or", "not", "xor", "reduce_and", "reduce_or"))


class Slice(NamedTuple):
    """A part of a jaxpr that computes some of its outputs, and the inputs that it reads."""

    jaxpr: ClosedJaxpr
    used: tuple[int, ...]


def joined(eqn: JaxprEqn, arrays: Sequence[np.ndarray]) -> np.ndarray:
    """Arrays of objects, joined as by an equation."""
    function, axis = JOINS[eqn.primitive.name]
    return function([array.astype(object) for array in arrays], axis=eqn.params[axis])


def slice_output(closed: ClosedJaxpr, output: int) -> Slice:
    """The part that computes output number `output`, without unused equations and inputs."""
    return slice_outputs(closed, slice(output, output + 1))


def slice_outputs(closed: ClosedJaxpr, outputs: slice) -> Slice:
    """The part that computes some of the outputs. Calls and branches in it compute nothing else either."""
    places = range(len(closed.jaxpr.outvars))[outputs]
    jaxpr, is_used = pruned(closed.jaxpr, [i in places for i in range(len(closed.jaxpr.outvars))])
    used = tuple(i for i, reads in enumerate(is_used) if reads)
    read = {
        atom
        for atoms in (jaxpr.outvars, *(eqn.invars for eqn in jaxpr.eqns))
        for atom in atoms
        if isinstance(atom, Var)
    }
    constants = [pair for pair in zip(jaxpr.constvars, closed.consts, strict=True) if pair[0] in read]
    sliced = assembled(jaxpr.invars, jaxpr.outvars, jaxpr.eqns, [var for var, _ in constants])
    return Slice(ClosedJaxpr(sliced, [value for _, value in constants]), used)


def interpreted(
    closed: ClosedJaxpr,
    inputs: Sequence[T],
    outputs: Callable[[JaxprEqn, list[T]], Sequence[T]],
    constant: Callable[[Any], T],
    literal: Callable[[Literal], T] | None = None,
) -> list[T]:
    """The outputs of a jaxpr, computed with other objects than numbers.

    `outputs` maps an equation and its arguments to its results, `constant` maps a known number, and `literal` a number
    written in an equation, if that differs.
    """
    jaxpr = closed.jaxpr
    known: dict[Var, T] = dict(zip(jaxpr.invars, inputs, strict=True))
    known |= {var: constant(value) for var, value in zip(jaxpr.constvars, closed.consts, strict=True)}

    def read(atom: Var | Literal) -> T:
        if isinstance(atom, Literal):
            return constant(atom.val) if literal is None else literal(atom)
        return known[atom]

    for eqn in jaxpr.eqns:
        known |= dict(zip(eqn.outvars, outputs(eqn, [read(atom) for atom in eqn.invars]), strict=True))
    return [read(atom) for atom in jaxpr.outvars]


def check_effects(closed: ClosedJaxpr, where: str) -> None:
    """Raise `ModelError` if the trace of a method has side effects."""
    if closed.effects:
        names = sorted({eqn.primitive.name for eqn in closed.jaxpr.eqns if eqn.effects})
        raise ModelError(
            f"{where} has a side effect, such as jax.debug.print ({', '.join(names)}). Its equations are reordered, "
            "and the engine evaluates only their results. Remedy: remove it, and look at "
            "variables in the solution, as in solution['spring.tau'], or print them in a function given as peaks."
        )


def assembled(
    invars: Sequence[Var], outvars: Sequence[Atom], eqns: Sequence[JaxprEqn], constvars: Sequence[Var] = ()
) -> Jaxpr:
    """A jaxpr of equations without side effects."""
    return Jaxpr(constvars, invars, outvars, eqns, debug_info=DebugInfo("acausal", "equation", None, None))


def as_function(closed: ClosedJaxpr) -> Callable[..., Array]:
    """The jaxpr with one output as a function of its inputs."""
    function = jaxpr_as_fun(closed)
    return lambda *args: function(*args)[0]


# The name of a call that is the whole body of a function with derivative rules of its own. It says that the rules for
# the forward mode give the derivatives of that body.
DIFFERENTIATED = "differentiated_in_forward_mode"


def plain_call(eqn: JaxprEqn) -> ClosedJaxpr | None:
    """The jaxpr of a plain call (`jit`); None for other equations."""
    if eqn.primitive.name in ("jit", "pjit", "closed_call", "core_call"):
        return eqn.params.get("jaxpr") or eqn.params.get("call_jaxpr")
    return None


def called(eqn: JaxprEqn) -> ClosedJaxpr | None:
    """The jaxpr of a plain call or a composite primitive; None for other equations."""
    return plain_call(eqn) or spelled_out(eqn)


def inner_jaxprs(eqn: JaxprEqn) -> list[ClosedJaxpr]:
    """The jaxprs among the parameters of an equation, such as the branches of a `cond`."""
    values = [part for v in eqn.params.values() for part in (v if isinstance(v, tuple | list) else (v,))]
    return [value for value in values if isinstance(value, ClosedJaxpr)]


def differentiable_call(eqn: JaxprEqn) -> ClosedJaxpr | None:
    """The body of a function with custom derivative rules, such as `custom_jvp`; for analysis only."""
    if (operation := high_level(eqn)) is not None:
        return high_level_body(operation)
    for name in ("call_jaxpr", "fun_jaxpr"):
        if eqn.primitive.name.startswith("custom_") and name in eqn.params:
            return eqn.params[name]
    return None


def bind(eqn: JaxprEqn, values: Sequence[Numbers]) -> list[Array]:
    """Evaluate one equation. One with inner jaxprs is evaluated as a jaxpr of that single equation."""
    if any(isinstance(value, Jaxpr | ClosedJaxpr) or callable(value) for value in eqn.params.values()):
        return _bind_call(eqn, values)
    results = eqn.primitive.bind(*values, **eqn.params)
    return list(results) if eqn.primitive.multiple_results else [results]


def _bind_call(eqn: JaxprEqn, values: Sequence[Numbers]) -> list[Array]:
    given = {var: value for var, value in zip(eqn.invars, values, strict=True) if not isinstance(var, Literal)}
    whole = assembled(list(given), eqn.outvars, [eqn])
    return list(jaxpr_as_fun(ClosedJaxpr(whole, []))(*given.values()))


def arrays_in(closed: ClosedJaxpr) -> Iterator[Any]:
    """The arrays in a jaxpr and in its inner jaxprs."""
    yield from closed.consts
    yield from _literals(closed.jaxpr)


def _literals(jaxpr: Jaxpr) -> Iterator[Any]:
    kinds = (Jaxpr, ClosedJaxpr)
    for eqn in jaxpr.eqns:
        yield from (atom.val for atom in eqn.invars if isinstance(atom, Literal) and np.ndim(atom.val))
        for inner in jax.tree_util.tree_leaves(eqn.params, is_leaf=lambda value: isinstance(value, kinds)):
            if isinstance(inner, kinds):
                yield from arrays_in(inner) if isinstance(inner, ClosedJaxpr) else _literals(inner)
    yield from (atom.val for atom in jaxpr.outvars if isinstance(atom, Literal) and np.ndim(atom.val))


def shape_of(atom: Any) -> tuple[int, ...]:
    """The shape of a variable or literal of a jaxpr."""
    return tuple(atom.aval.shape)


def dtype_of(atom: Any) -> np.dtype:
    """The type of a variable or literal of a jaxpr."""
    return atom.aval.dtype


def is_floating(atom: Any) -> bool:
    """Whether a variable or literal of a jaxpr is a floating-point number."""
    return bool(jnp.issubdtype(atom.aval.dtype, jnp.floating))


def structs(shapes: Sequence[tuple[int, ...]]) -> list[jax.ShapeDtypeStruct]:
    return [jax.ShapeDtypeStruct(shape, jax.dtypes.canonicalize_dtype(float)) for shape in shapes]
