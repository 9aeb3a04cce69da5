"""The instants at which a function of time changes its law: zeros of a comparison, or steps of a rounding function.

A jaxpr is interpreted on the values that can be computed from time and known numbers. A comparison of such values has
an event indicator, their difference, which is zero at an instant. An event indicator that is affine in time predicts
the next one.
"""

import dataclasses
import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any, Literal, NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from .._jax_private import ClosedJaxpr, JaxprEqn, jaxpr_as_fun
from .._numbers import Numbers, Scalar
from .jaxpr import bind, called, differentiable_call, interpreted, is_floating


def degree_of(eqn: JaxprEqn, degrees: list[int]) -> int:
    """The degree of the outputs between the instants at which a law changes."""
    return _DEGREES.get(eqn.primitive.name, _any_other)(eqn, degrees)


def degrees_of(closed: ClosedJaxpr, inputs: Sequence[int]) -> list[int]:
    """The degrees of all outputs, from those of the inputs."""

    def outputs(eqn: JaxprEqn, degrees: list[int]) -> list[int]:
        inner = called(eqn) or differentiable_call(eqn)
        if inner is not None:
            return degrees_of(inner, degrees)
        return [degree_of(eqn, degrees) if any(degrees) else 0] * len(eqn.outvars)

    return interpreted(closed, inputs, outputs, lambda _: 0)


def _largest(eqn: JaxprEqn, degrees: list[int]) -> int:
    return max(degrees)


def _constant(eqn: JaxprEqn, degrees: list[int]) -> int:
    return 0


def _any_other(eqn: JaxprEqn, degrees: list[int]) -> int:
    return 2


def _of_product(eqn: JaxprEqn, degrees: list[int]) -> int:
    return min(2, sum(degrees))


def _of_quotient(eqn: JaxprEqn, degrees: list[int]) -> int:
    return degrees[0] if degrees[1] == 0 else 2


def _of_choice(eqn: JaxprEqn, degrees: list[int]) -> int:
    """One of several values, selected by an index or a truth value that is constant between instants."""
    return max(degrees[1:]) if degrees[0] == 0 else 2


def _of_picked(eqn: JaxprEqn, degrees: list[int]) -> int:
    return degrees[0] if not any(degrees[1:]) else 2


def _of_conversion(eqn: JaxprEqn, degrees: list[int]) -> int:
    return degrees[0] if is_floating(eqn.outvars[0]) else 0


_DEGREES: dict[str, Callable[[JaxprEqn, list[int]], int]] = {
    **dict.fromkeys(
        ("add", "add_any", "sub", "neg", "max", "min", "abs", "clamp", "reshape", "broadcast_in_dim", "squeeze",
         "transpose", "slice", "rev", "concatenate", "copy", "copy_p", "reduce_sum", "cumsum", "pad", "expand_dims",
         "sort", "reduce_max", "reduce_min", "cummax", "cummin"),
        _largest,
    ),
    **dict.fromkeys(
        ("lt", "le", "gt", "ge", "eq", "ne", "and", "or", "not", "xor", "sign", "floor", "ceil", "round", "argmax",
         "argmin", "is_finite"),
        _constant,
    ),
    "mul": _of_product,
    "dot_general": _of_product,
    "div": _of_quotient,
    "rem": _of_quotient,
    "select_n": _of_choice,
    "gather": _of_picked,
    "dynamic_slice": _of_picked,
    "convert_element_type": _of_conversion,
}  # fmt: skip


Knowledge = Literal["time", "known", "unknown"]  # of an input, as in partial evaluation


class _Value(NamedTuple):
    """A computed value and its degree in time between instants: 0 constant, 1 affine, 2 other."""

    value: Array
    degree: int


@dataclasses.dataclass
class _Found:
    """Event indicators that are zero at instants: `affine` in time or `nonlinear`; `stairs` change at integers."""

    affine: list[Numbers] = dataclasses.field(default_factory=list)
    stairs: list[Numbers] = dataclasses.field(default_factory=list)
    nonlinear: list[Numbers] = dataclasses.field(default_factory=list)

    def compare(self, indicator: Array, degree: int) -> None:
        if degree == 1:
            self.affine.append(indicator)
        elif degree == 2:
            self.nonlinear.append(indicator)

    def compare_all(self, values: Array, others: Array, degree: int) -> None:
        """Compare each of some values with each of others."""
        self.compare(jnp.ravel(values)[:, None] - jnp.ravel(others), degree)

    def step(self, value: Numbers, degree: int) -> None:
        if degree == 1:
            self.stairs.append(value)


@dataclasses.dataclass(frozen=True, eq=False)
class Instants:
    """`closed` maps time and known numbers to event indicators: `n_affine` affine ones, `n_stairs` stairs, then
    nonlinear ones.
    """

    closed: ClosedJaxpr
    n_affine: int
    n_stairs: int

    @property
    def n_scheduled(self) -> int:
        return self.n_affine + self.n_stairs

    @property
    def n_nonlinear(self) -> int:
        return sum(math.prod(aval.shape) for aval in self.closed.out_avals[self.n_scheduled :])

    def indicators(self, t: Numbers, known: Sequence[Numbers]) -> list[Array]:
        return list(jaxpr_as_fun(self.closed)(t, *known))

    def nonlinear(self, t: Numbers, known: Sequence[Numbers]) -> Array:
        """The event indicators whose zeros cannot be predicted, as one flat vector."""
        return _flat(self.indicators(t, known)[self.n_scheduled :])

    def following(self, t: Numbers, known: Sequence[Numbers], forward: Array) -> Array:
        """The first instant after t in the direction of time; infinite if there is none."""

        def scheduled(t: Numbers) -> tuple[Array, Array]:
            found = self.indicators(t, known)
            return _flat(found[: self.n_affine]), _flat(found[self.n_affine : self.n_scheduled])

        (indicator, stair), (slope, rise) = jax.jvp(scheduled, (t,), (jnp.ones_like(t),))
        up = jnp.where(rise * forward > 0, 1.0, -1.0)
        ahead = jax.lax.stop_gradient(up * (jnp.floor(up * stair) + 1.0))
        lack = jnp.concatenate([-indicator, ahead - stair])
        rate = jnp.concatenate([slope, rise])
        moves = rate != 0
        times = t + jnp.where(moves, lack, 0.0) / jnp.where(moves, rate, 1.0)
        return first(jnp.where(moves & (forward * (times - t) > 0), times, forward * jnp.inf), forward)


def first(times: Array, forward: Scalar = 1.0) -> Array:
    """The earliest of several times, infinite for none."""
    if not times.size:
        return jnp.asarray(forward) * jnp.inf
    return times[jnp.argmin(forward * times)]


def _flat(values: Sequence[Array]) -> Array:
    return jnp.concatenate([jnp.zeros(0), *(jnp.ravel(value) for value in values)])


def instants(closed: ClosedJaxpr, inputs: Sequence[Knowledge], shapes: Sequence[tuple[int, ...]]) -> Instants | None:
    """The instants at which the outputs of a jaxpr change their law, as functions of time and known inputs; None if
    there are none.

    `Instants.closed` takes a scalar time, then the known inputs, which have the given `shapes`.
    """
    counts: list[tuple[int, int]] = []

    def traced(t: Numbers, *known: Array) -> list[Array]:
        remaining, found = iter(known), _Found()
        items = [_input(item, var.aval, t, remaining) for item, var in zip(inputs, closed.jaxpr.invars, strict=True)]
        _walk(closed, items, found)
        counts.append((len(found.affine), len(found.stairs)))
        return [jnp.asarray(item, float) for item in (*found.affine, *found.stairs, *found.nonlinear)]

    given = [shape for item, shape in zip(inputs, shapes, strict=True) if item == "known"]
    made = jax.make_jaxpr(traced)(*(jax.ShapeDtypeStruct(shape, float) for shape in ((), *given)))
    return Instants(made, *counts[-1]) if made.jaxpr.outvars else None


def _input(item: Knowledge, aval: Any, t: Numbers, known: Iterator[Array]) -> _Value | None:
    if item == "unknown":
        return None
    return _Value(jnp.broadcast_to(t, aval.shape), 1) if item == "time" else _Value(next(known), 0)


def _walk(closed: ClosedJaxpr, items: Sequence[_Value | None], found: _Found) -> list[_Value | None]:
    """The outputs, None if they cannot be computed. Records comparisons on the way."""
    return interpreted(
        closed, items, lambda eqn, args: _outputs(eqn, args, found), lambda value: _Value(jnp.asarray(value), 0)
    )


def _outputs(eqn: JaxprEqn, args: list[_Value | None], found: _Found) -> list[_Value | None]:
    known = [arg for arg in args if arg is not None]
    inner = called(eqn) or differentiable_call(eqn)
    if inner is not None and any(arg.degree for arg in known):
        return _walk(inner, args, found)
    if len(known) < len(args):
        return [None] * len(eqn.outvars)
    values, degrees = [arg.value for arg in known], [arg.degree for arg in known]
    results, name = bind(eqn, values), eqn.primitive.name
    if not any(degrees):
        return [_Value(result, 0) for result in results]
    if name == "stop_gradient":
        return args
    if name == "cond":
        branches = [_walk(branch, args[1:], found) for branch in eqn.params["branches"]]
        inside = [max(2 if item is None else item.degree for item in items) for items in zip(*branches, strict=True)]
        return [_Value(result, d if degrees[0] == 0 else 2) for result, d in zip(results, inside, strict=True)]
    if name in ("while", "scan"):
        _note_loop(values, degrees, found)
        # The integers that a loop returns, such as the index of a search, are constant between instants.
        return [_Value(x, 2 if is_floating(var) else 0) for x, var in zip(results, eqn.outvars, strict=True)]
    _note(eqn, values, degrees, found)
    degree = degree_of(eqn, degrees)
    return [_Value(result, degree) for result in results]


def _note_loop(values: list[Array], degrees: list[int], found: _Found) -> None:
    """Record that a loop may compare a varying value with all its numbers, as a search in a sorted list does."""
    real = [(x, degree) for x, degree in zip(values, degrees, strict=True) if jnp.issubdtype(x.dtype, jnp.floating)]
    for x, degree in real:
        for other, fixed in real:
            if degree and not fixed:
                found.compare_all(x, other, degree)


def _note(eqn: JaxprEqn, values: list[Array], degrees: list[int], found: _Found) -> None:
    """Record the event indicators of an equation that compares values, and the stairs of one that rounds."""
    name = eqn.primitive.name
    if name in ("lt", "le", "gt", "ge", "max", "min") and is_floating(eqn.invars[0]):
        found.compare(values[0] - values[1], max(degrees))
    elif name in ("abs", "sign"):
        found.compare(values[0], degrees[0])
    elif name in ("sort", "argmax", "argmin", "reduce_max", "reduce_min", "cummax", "cummin"):
        for value, degree in zip(values, degrees, strict=True):
            found.compare_all(value, value, degree)
    elif name == "clamp":
        low, x, high = values
        found.compare(x - low, max(degrees[:2]))
        found.compare(x - high, max(degrees[1:]))
    elif name in ("floor", "ceil"):
        found.step(values[0], degrees[0])
    elif name == "round":
        found.step(values[0] + 0.5, degrees[0])
    elif name == "rem" and degrees[1] == 0:
        found.step(values[0] / values[1], degrees[0])
    elif name == "convert_element_type" and not is_floating(eqn.outvars[0]) and is_floating(eqn.invars[0]):
        found.step(values[0], degrees[0])
