"""Evaluation of jaxprs on values that are affine in a few symbols, which solves an equation without algebra.

An `Affine` is base + sum of coefficient x symbol. Zeros are omitted, and factors 1 and -1 are not multiplied, so
the trace equals an equation solved by hand.
"""

import dataclasses
import math
from collections.abc import Callable, Sequence
from typing import Any, TypeAlias

import jax
import jax.numpy as jnp
from jax import Array

from .._errors import StructureError
from .._jax_private import ClosedJaxpr, JaxprEqn, Literal
from .._numbers import Numbers, Scalar
from .._reduce.jaxpr import bind, called, differentiable_call, interpreted, is_floating, shape_of


@jax.tree_util.register_dataclass
@dataclasses.dataclass(frozen=True)
class Minus:
    """A negated array, evaluated late: most signs cancel on the way."""

    array: Array


Value: TypeAlias = Numbers | Minus


@dataclasses.dataclass(frozen=True)
class Affine:
    """base + sum_j terms[j] x symbol j; a base of None is zero. Values are arrays, `Minus` arrays or python floats."""

    base: Any = None
    terms: dict[int, Any] = dataclasses.field(default_factory=dict)

    def value(self) -> Numbers:
        return 0.0 if self.base is None else computed(self.base)


def computed(value: Any) -> Numbers:
    """A value as an array or a number."""
    return -value.array if isinstance(value, Minus) else value


def negated(value: Any) -> Any:
    return -value if isinstance(value, float) else value.array if isinstance(value, Minus) else Minus(value)


def times(a: Any, b: Any) -> Any:
    for x, y in ((a, b), (b, a)):
        if isinstance(x, float) and x in (1.0, -1.0):
            return y if x > 0 else negated(y)
        if isinstance(x, Minus):
            return negated(times(x.array, y))
    return a * b


def over(a: Any, b: Numbers) -> Any:
    for x in (a, b):
        if isinstance(x, Minus):
            return negated(over(x.array, b) if x is a else over(a, x.array))
    if isinstance(b, float) and b == 0.0:
        raise StructureError(
            "Equations cancel: in a set of ideal elements, such as storages of one kind that are the only links of a "
            "part of the model, one flow or across variable has no equation. Remedy: connect that part to "
            "a reference, or give one of the elements a resistance."
        )
    return times(a, 1.0 / b) if isinstance(b, float) else a / b


def plus(a: Any, b: Any) -> Any:
    """The sum of two values; None is zero."""
    if a is None or b is None:
        return b if a is None else a
    if isinstance(a, Minus):
        return Minus(a.array + b.array) if isinstance(b, Minus) else b - a.array
    return a - b.array if isinstance(b, Minus) else a + b


def add(a: Affine, b: Affine) -> Affine:
    terms = dict(a.terms)
    for symbol, value in b.terms.items():
        terms[symbol] = plus(terms.get(symbol), value)
    return Affine(plus(a.base, b.base), terms)


def scale(a: Affine, factor: Numbers) -> Affine:
    base = None if a.base is None else times(a.base, factor)
    return Affine(base, {symbol: times(value, factor) for symbol, value in a.terms.items()})


def divide(a: Affine, divisor: Numbers) -> Affine:
    base = None if a.base is None else over(a.base, divisor)
    return Affine(base, {symbol: over(value, divisor) for symbol, value in a.terms.items()})


def solved_for(residual: Affine, symbol: int) -> Affine:
    """The symbol as an affine function of the others, from residual = 0."""
    rest = Affine(residual.base, {j: value for j, value in residual.terms.items() if j != symbol})
    return scale(divide(rest, residual.terms[symbol]), -1.0)


def _product(a: Affine, b: Affine) -> Affine:
    if not a.terms:
        a, b = b, a
    return Affine() if b.base is None or (a.base is None and not a.terms) else scale(a, b.base)


def _mapped(eqn: JaxprEqn, args: Sequence[Affine]) -> Affine:
    """A linear operation on the first argument, applied to its base and terms."""
    others = [arg.value() for arg in args[1:]]
    shape = shape_of(eqn.invars[0])

    def apply(value: Numbers) -> Array:
        return bind(eqn, [jnp.broadcast_to(jnp.asarray(computed(value), float), shape), *others])[0]

    base = None if args[0].base is None else apply(args[0].base)
    return Affine(base, {symbol: apply(value) for symbol, value in args[0].terms.items()})


def _selected(eqn: JaxprEqn, args: Sequence[Affine]) -> Affine:
    """One of several affine values, selected independently of the symbols."""
    which, *cases = args
    shapes = [shape_of(atom) for atom in eqn.invars[1:]]

    def pick(values: Sequence[Scalar | None]) -> Array | None:
        if all(value is None for value in values):
            return None
        filled = [
            jnp.broadcast_to(jnp.asarray(0.0 if value is None else computed(value), float), shape)
            for value, shape in zip(values, shapes, strict=True)
        ]
        return bind(eqn, [which.value(), *filled])[0]

    symbols = dict.fromkeys(symbol for case in cases for symbol in case.terms)
    terms = {symbol: pick([case.terms.get(symbol) for case in cases]) for symbol in symbols}
    return Affine(pick([case.base for case in cases]), terms)


_RULES: dict[str, Callable[..., Affine]] = {
    "add": add,
    "add_any": add,
    "sub": lambda a, b: add(a, scale(b, -1.0)),
    "neg": lambda a: scale(a, -1.0),
    "mul": _product,
    "div": lambda a, b: divide(a, b.base),
    "copy": lambda a: a,
    "copy_p": lambda a: a,
    "integer_pow": lambda a: a,
}


def _apply(eqn: JaxprEqn, args: list[Affine]) -> list[Affine]:
    inner = called(eqn)
    if inner is not None:
        return evaluate(inner, args)
    symbolic = any(arg.terms for arg in args)
    if symbolic and (body := differentiable_call(eqn)) is not None:
        return evaluate(body, args)
    if symbolic or eqn.primitive.name == "neg" or any(arg.base is None or isinstance(arg.base, Minus) for arg in args):
        rule = _RULES.get(eqn.primitive.name) if _is_plain(eqn) else None
        if rule is not None and (symbolic or eqn.primitive.name != "integer_pow"):
            return [rule(*args)]
    if symbolic and eqn.primitive.name == "select_n":
        return [_selected(eqn, args)]
    if symbolic:
        return [_mapped(eqn, args)]
    return [
        Affine(value) for value in bind(eqn, [_filled(arg, var) for arg, var in zip(args, eqn.invars, strict=True)])
    ]


def _is_plain(eqn: JaxprEqn) -> bool:
    """Whether an operation is elementwise on operands of one shape or scalars."""
    shape = shape_of(eqn.outvars[0])
    return all(shape_of(var) == shape or math.prod(shape_of(var)) == 1 for var in eqn.invars)


def _filled(arg: Affine, atom: Any) -> Numbers:
    """A value for `bind`: zeros and Python floats become arrays."""
    if arg.base is None or isinstance(arg.base, float):
        return jnp.full(shape_of(atom), arg.value(), atom.aval.dtype)
    return arg.value()


def evaluate(closed: ClosedJaxpr, inputs: Sequence[Affine]) -> list[Affine]:
    """The outputs of a jaxpr; its dependence on the symbols must be linear."""
    return interpreted(closed, inputs, _apply, Affine, _literal)


def _literal(atom: Literal) -> Affine:
    if jnp.ndim(atom.val) == 0 and is_floating(atom):
        return Affine(None if atom.val == 0 else float(atom.val))
    return Affine(atom.val)
