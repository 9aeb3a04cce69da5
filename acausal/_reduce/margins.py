"""Conditions as relations and their logic; the margin of a relation is a number that is positive where it holds."""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, TypeAlias

import jax.numpy as jnp
from jax.extend.core import ClosedJaxpr, JaxprEqn, Literal

from .jaxpr import bind, called, is_floating

LEAST = 1e-300  # in place of zero, whose sign tells whether a relation holds between equal numbers
Bounds: TypeAlias = tuple[Any, Any]  # a lower and an upper bound


class Logic(NamedTuple):
    """A truth value: that of relation `number`, or what a rule makes of those of its parts."""

    number: int
    rule: Callable[..., Bounds] | None = None
    parts: tuple["Logic", ...] = ()

    @property
    def numbers(self) -> frozenset[int]:
        """The relations that it is made of."""
        return frozenset({self.number} - {-1}).union(*(part.numbers for part in self.parts))

    def combined(self, low: Sequence[Any], high: Sequence[Any]) -> Bounds:
        """Bounds of the margin from those of the relations: of `&` it is the smaller one, of `|` the larger one."""
        if self.rule is None:
            return low[self.number], high[self.number]
        return self.rule(*(part.combined(low, high) for part in self.parts))


def _margin_of(difference: Callable[[Any, Any], Any], of_equals: float) -> Callable[[Any, Any], Any]:
    """The difference, which keeps its derivative where it is zero."""
    return lambda a, b: difference(a, b) + jnp.where(a == b, of_equals, 0.0)


_RELATIONS: dict[str, Callable[[Any, Any], Any]] = {
    "gt": _margin_of(lambda a, b: a - b, -LEAST),
    "ge": _margin_of(lambda a, b: a - b, LEAST),
    "lt": _margin_of(lambda a, b: b - a, -LEAST),
    "le": _margin_of(lambda a, b: b - a, LEAST),
}


def _both(function: Callable[..., Any]) -> Callable[..., Bounds]:
    return lambda *pairs: (function(*(pair[0] for pair in pairs)), function(*(pair[1] for pair in pairs)))


def _not(a: Bounds) -> Bounds:
    return -a[1], -a[0]


def _and(a: Bounds, b: Bounds) -> Bounds:
    return _both(jnp.minimum)(a, b)


def _or(a: Bounds, b: Bounds) -> Bounds:
    return _both(jnp.maximum)(a, b)


def _differ(a: Bounds, b: Bounds) -> Bounds:
    return _or(_and(a, _not(b)), _and(_not(a), b))


def _choice(which: Bounds, if_false: Bounds, if_true: Bounds) -> Bounds:
    return _or(_and(_not(which), if_false), _and(which, if_true))


_RULES: dict[str, Callable[[JaxprEqn], Callable[..., Bounds]]] = {
    "and": lambda eqn: _and,
    "or": lambda eqn: _or,
    "not": lambda eqn: _not,
    "xor": lambda eqn: _differ,
    "ne": lambda eqn: _differ,
    "eq": lambda eqn: lambda a, b: _not(_differ(a, b)),
    "select_n": lambda eqn: _choice,
    "reduce_and": lambda eqn: _both(lambda x: jnp.min(x, axis=eqn.params["axes"])),
    "reduce_or": lambda eqn: _both(lambda x: jnp.max(x, axis=eqn.params["axes"])),
    **dict.fromkeys(
        ("copy", "squeeze", "reshape", "broadcast_in_dim", "slice", "transpose"),
        lambda eqn: _both(lambda x: bind(eqn, [x])[0]),
    ),
}


def relations(closed: ClosedJaxpr, inputs: Sequence[Any], count: int) -> tuple[list[Any], list[Logic]]:
    """The margins of the relations that the first outputs of a jaxpr are made of, and the logic of these outputs.

    The margin of a relation is the difference of its sides, where these are equal a tiny number of the right sign. What
    is neither a relation between real numbers nor made of them, such as a comparison of modes, has the margin 1 or -1.
    A real output is its own margin.
    """
    margins: list[Any] = []
    outputs = _walk(closed, [(value, None) for value in inputs], margins)[:count]
    return margins, [_node(value, node, margins) for value, node in outputs]


def _walk(
    closed: ClosedJaxpr, inputs: Sequence[tuple[Any, Logic | None]], margins: list[Any]
) -> list[tuple[Any, Logic | None]]:
    """The values of the outputs with their logic, as far as it is known."""
    jaxpr = closed.jaxpr
    found: dict[Any, tuple[Any, Logic | None]] = dict(zip(jaxpr.invars, inputs, strict=True))
    found |= {var: (value, None) for var, value in zip(jaxpr.constvars, closed.consts, strict=True)}

    def read(atom: Any) -> tuple[Any, Logic | None]:
        return (jnp.asarray(atom.val), None) if isinstance(atom, Literal) else found[atom]

    for eqn in jaxpr.eqns:
        args = [read(atom) for atom in eqn.invars]
        inner = called(eqn)
        if inner is not None:
            found |= dict(zip(eqn.outvars, _walk(inner, args, margins), strict=True))
            continue
        values = bind(eqn, [value for value, _ in args])
        found |= {var: (value, None) for var, value in zip(eqn.outvars, values, strict=True)}
        node = _logic(eqn, args, margins)
        if node is not None:
            found[eqn.outvars[0]] = (values[0], node)
    return [read(atom) for atom in jaxpr.outvars]


def _logic(eqn: JaxprEqn, args: Sequence[tuple[Any, Logic | None]], margins: list[Any]) -> Logic | None:
    name = eqn.primitive.name
    if name in _RELATIONS and is_floating(eqn.invars[0]):
        return _relation(_RELATIONS[name](*(value for value, _ in args)), margins)
    is_truth = all(value.dtype == bool for value, _ in args)
    if name not in _RULES or not is_truth or all(node is None for _, node in args):
        return None
    return Logic(-1, _RULES[name](eqn), tuple(_node(value, node, margins) for value, node in args))


def _node(value: Any, node: Logic | None, margins: list[Any]) -> Logic:
    if node is not None:
        return node
    return _relation(jnp.where(value, 1.0, -1.0) if value.dtype == bool else value, margins)


def _relation(margin: Any, margins: list[Any]) -> Logic:
    margins.append(margin)
    return Logic(len(margins) - 1)
