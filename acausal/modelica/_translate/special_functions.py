"""Functions of the language that depend on more than the values of their arguments (Modelica 3.6, section 3.7).

Each takes its arguments as terms, the scope, and the function that evaluates a term.
"""

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any, TypeAlias

import jax
import jax.numpy as jnp

from ..._declare.history import recall
from ..._declare.ifelse import held_relation
from .._syntax import expressions as e
from .branches import choose
from .builtins import FUNCTIONS
from .scope import NotKnown, Scope
from .terms import SlotValue
from .values import Value, is_known, number

Args: TypeAlias = Sequence[Any]
Evaluate: TypeAlias = Callable[[Any, Scope], Value]


def _smooth(args: Args, at: Scope, evaluate: Evaluate) -> Value:
    order = evaluate(args[0], at)
    return evaluate(args[1], at.without_events() if order >= 1 else at)


def _semilinear(args: Args, at: Scope, evaluate: Evaluate) -> Value:
    zero, (x, up, down) = e.Const(0.0), args
    return evaluate(e.If(((e.Binary("Ge", x, zero), e.Binary("Mul", up, x)),), e.Binary("Mul", down, x)), at)


def _derivative(args: Args, at: Scope, evaluate: Evaluate) -> Value:
    (x,) = args
    if not at.rates:
        raise NotKnown("a derivative")
    if _is_part(x):
        return evaluate(x, dataclasses.replace(at, values=at.rates))
    moving = [i for i, rate in enumerate(at.rates) if rate is not None]

    def along(*values: Value) -> Value:
        whole = list(at.values)
        for i, value in zip(moving, values, strict=True):
            whole[i] = value
        return jnp.asarray(evaluate(x, dataclasses.replace(at, values=whole, holds=False)), float)

    start = [jnp.asarray(at.values[i], float) for i in moving]
    return jax.jvp(along, start, [jnp.asarray(at.rates[i], float) for i in moving])[1]


def _is_part(x: Any) -> bool:
    """Whether a term is a variable, or an element of one at a fixed place."""
    if isinstance(x, e.Subscript) and all(isinstance(sub, e.Const | e.Colon) for sub in x.subs):
        x = x.base
    return isinstance(x, SlotValue)


def _root(args: Args, at: Scope, evaluate: Evaluate) -> Value:
    """A square root, whose slope at 0 is infinite. That of max(low, x) is constant where x is less. That of a sum of
    squares is a length, whose slope at 0 is 0, the mean of those on both sides.
    """
    root = FUNCTIONS["Sqrt"]
    if _is_sum_of_squares(args[0]):
        value = number(evaluate(args[0], at))
        return root(value) if is_known(value) else choose(value > 0.0, lambda: root(value), lambda: 0.0 * value)
    match args[0]:
        case e.Builtin("Max", (e.Const() as low, x)) | e.Builtin("Max", (x, e.Const() as low)):
            value = number(evaluate(x, at))
            if not is_known(value):
                return choose(value > low.value, lambda: root(value), lambda: root(low.value))
    return root(evaluate(args[0], at))


def _is_sum_of_squares(x: Any) -> bool:
    match x:
        case e.Binary("Add", left, right):
            return _is_sum_of_squares(left) and _is_sum_of_squares(right)
        case e.Binary("Mul", left, right):
            return left == right
        case e.Binary("Exp" | "ExpElem", _, e.Const(2)):
            return True
        case e.Builtin("Sum", (inner,)):
            return _is_sum_of_squares(inner)
    return False


def _held_floor(args: Args, at: Scope, evaluate: Evaluate) -> Value:
    """floor(x), held between events at its value before. At an event it changes by 1 at least, whatever x rounds to."""
    x, before = (jnp.asarray(evaluate(arg, at), float) for arg in args)
    above, below = x >= before + 1.0, x < before
    if at.holds:
        above, below = held_relation(above), held_relation(below)
    whole = jnp.floor(x)
    fallen = jnp.where(below, jnp.minimum(whole, before - 1.0), before)
    return jnp.where(above, jnp.maximum(whole, before + 1.0), fallen)


def _recall(args: Args, at: Scope, evaluate: Evaluate) -> Value:
    past, since, before = (jnp.asarray(evaluate(arg, at), float) for arg in args)
    return recall(past, since, before)


def _missing(name: str) -> Callable[[Args, Scope, Evaluate], Value]:
    def missing(args: Args, at: Scope, evaluate: Evaluate) -> Value:
        raise NotKnown(name)

    return missing


SPECIAL: dict[str, Callable[[Args, Scope, Evaluate], Value]] = {
    "Smooth": _smooth,
    "SemiLinear": _semilinear,
    "Sqrt": _root,
    "HeldFloor": _held_floor,
    "Recall": _recall,
    "Der": _derivative,
    "Terminal": lambda args, at, evaluate: False,
    "Initial": _missing("initial()"),
    "Pre": _missing("pre"),
}
