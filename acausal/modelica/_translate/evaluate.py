"""Evaluation of expressions."""

import dataclasses
from collections.abc import Callable, Hashable, Sequence
from functools import partial
from typing import Any, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np

from ..._declare.history import recall
from ..._declare.ifelse import held_relation
from ..._errors import ModelError
from .._syntax import expressions as e
from .branches import Failed, choose
from .builtins import FUNCTIONS
from .operators import RELATIONS, arithmetic, both_or_either, relation, unary
from .scope import NotKnown, Scope
from .terms import Opaque, RecordOf, SlotValue, is_harmless, only_discrete, reads_rates
from .values import UnknownText, Value, by_field, elements, first, is_known, items_of, number, position, select, stacked


def evaluate(x: Any, at: Scope) -> Value:
    """The value of an expression. Raises `NotKnown` for a name that has none."""
    return _BY_CLASS[type(x)](x, at)


def _first(x: Any, at: Scope) -> Value:
    """The value of an expression inside another one: of several results of a function the first one."""
    return first(evaluate(x, at))


def _slot(x: SlotValue, at: Scope) -> Value:
    value = at.values[x.number]
    if x.kind != "boolean":
        return value
    if at.in_condition:  # relations of real numbers must be inequalities there
        return value > 0.5
    # Rounded, because a search for a solution of `a = not a` would end at a tiny a, which is not 0.
    return value != 0.0 if is_known(value) else jnp.round(value) != 0.0


def _ref(x: e.Ref, at: Scope) -> Value:
    found = _local(x.name, at)
    return subscripted(found, x.subs, at) if x.subs else found


def _local(name: str, at: Scope) -> Value:
    if name in at.locals:
        return at.locals[name]
    head, _, rest = name.rpartition(".")
    if not head:
        raise NotKnown(name)
    found = _local(head, at)
    if not isinstance(found, dict) or rest not in found:
        raise NotKnown(name)
    return found[rest]


def subscripted(value: Value, subs: Sequence[Any], at: Scope) -> Value:
    """Elements of an array."""
    return by_field(value, lambda x: elements(x, index_of(x, subs, at)))


def index_of(value: Value, subs: Sequence[Any], at: Scope) -> tuple[Any, ...]:
    """The index that the subscripts of an array mean."""
    sizes = np.shape(value)[: len(subs)]
    return tuple(_position(sub, size, at) for sub, size in zip(subs, sizes, strict=True))


def _position(sub: Any, size: int, at: Scope) -> Any:
    if isinstance(sub, e.Colon):
        return slice(None)
    found = position(evaluate(sub, at.knowing(end=size)))
    if is_known(found) and not np.all((np.asarray(found) >= 0) & (np.asarray(found) < size)):
        raise Failed(f"the subscript {np.asarray(found) + 1} of an array of {size} is out of bounds.")
    return found


def _binary(x: e.Binary, at: Scope) -> Value:
    if x.op in ("And", "Or"):
        return _logic(x, at)
    if x.op in RELATIONS:
        return _relation(x, at)
    return arithmetic(x.op, _first(x.left, at), _first(x.right, at))


def _logic(x: e.Binary, at: Scope) -> Value:
    a = evaluate(x.left, at)
    if is_known(a) and np.ndim(a) == 0 and bool(a) != (x.op == "And"):
        return bool(a)  # the other side may have no value
    return both_or_either(x.op, a, evaluate(x.right, at))


def _relation(x: e.Binary, at: Scope) -> Value:
    truth = relation(x.op, _first(x.left, at), _first(x.right, at))
    if is_known(truth):
        return truth
    changes_at_events = only_discrete(x.left) and only_discrete(x.right)
    if at.in_condition and changes_at_events:
        return jnp.asarray(truth, float) > 0.5  # never on its limit, which the engine would count as reached
    holds = at.holds and x.op not in ("Eq", "Neq") and not changes_at_events
    # The engine cannot search for a relation between rates; such a relation counts as in noEvent.
    return held_relation(jnp.asarray(truth)) if holds and not reads_rates(x) else truth


def _unary(x: e.Unary, at: Scope) -> Value:
    return unary(x.op, _first(x.arg, at))


def _if(x: e.If, at: Scope) -> Value:
    for number_of, (condition, value) in enumerate(x.branches, 1):
        truth = evaluate(condition, at)
        if is_known(truth):
            if truth:
                return evaluate(value, at)
            continue
        rest = e.If(x.branches[number_of:], x.otherwise) if x.branches[number_of:] else x.otherwise
        if at.holds or (is_harmless(value) and is_harmless(rest)):
            return select(truth, evaluate(value, at), evaluate(rest, at))
        return choose(truth, partial(evaluate, value, at), partial(evaluate, rest, at))
    return evaluate(x.otherwise, at)


def _builtin(x: e.Builtin, at: Scope) -> Value:
    if x.name == "NoEvent":
        return evaluate(x.args[0], at.without_events())  # all results of a function
    if x.name in SPECIAL:
        return SPECIAL[x.name](x.args, at)
    if x.name not in FUNCTIONS:
        raise ModelError(f"the function {x.name.lower()} is not supported.")
    args = [_first(arg, at) for arg in x.args]
    return FUNCTIONS[x.name](*args)


def is_supported(name: str) -> bool:
    """Whether a function of the language has a value."""
    return name == "NoEvent" or name in FUNCTIONS or name in SPECIAL


def _array(x: e.ArrayOf, at: Scope) -> Value:
    values = [_first(item, at) for item in x.elements]
    return stacked([number(v) if any(not is_known(w) for w in values) else v for v in values])


def _comprehension(x: e.Comprehension, at: Scope) -> Value:
    (name, over), *rest = x.indices
    body = e.Comprehension(x.body, tuple(rest)) if rest else x.body
    return stacked([evaluate(body, at.knowing(**{name: item})) for item in items_of(evaluate(over, at))])


def _range(x: e.RangeOf, at: Scope) -> Value:
    start, stop = evaluate(x.start, at), evaluate(x.stop, at)
    step = 1 if x.step is None else evaluate(x.step, at)
    if not all(is_known(value) for value in (start, stop, step)):
        raise NotKnown("the range of a loop")
    count = int(np.floor((stop - start) / step + 1e-9)) + 1
    values = [start + step * i for i in range(max(count, 0))]
    return np.array(values) if values else np.zeros(0, int)


def _field(x: e.FieldOf, at: Scope) -> Value:
    base = _first(x.base, at)
    if not isinstance(base, dict) or x.name not in base:
        raise NotKnown(x.name)
    return base[x.name]


def _call(x: e.FunctionCall, at: Scope) -> Value:
    results = at.functions.call(x.name, [_first(arg, at) for arg in x.args])
    return results[0] if len(results) == 1 else results


def _tuple(x: e.TupleOf, at: Scope) -> Value:
    return tuple(None if item is None else evaluate(item, at) for item in x.elements)


def _text(x: e.Text, at: Scope) -> Value:
    value = evaluate(x.arg, at)
    if not is_known(value):
        return UnknownText("...")
    if isinstance(value, bool):
        return "true" if value else "false"
    return f"{value:.6g}" if isinstance(value, float) else str(value)


_BY_CLASS: dict[type, Callable[[Any, Scope], Value]] = {
    e.Const: lambda x, at: x.value,
    e.Ref: _ref,
    e.Unary: _unary,
    e.Binary: _binary,
    e.Builtin: _builtin,
    e.FunctionCall: _call,
    e.If: _if,
    e.ArrayOf: _array,
    e.Comprehension: _comprehension,
    e.RangeOf: _range,
    e.TupleOf: _tuple,
    e.FieldOf: _field,
    e.Subscript: lambda x, at: subscripted(_first(x.base, at), x.subs, at),
    e.Text: _text,
    SlotValue: _slot,
    RecordOf: lambda x, at: {name: evaluate(item, at) for name, item in x.fields},
    Opaque: lambda x, at: x.value,
}


class SharedCalls:
    """The results of calls whose fields are values of other expressions."""

    def __init__(self) -> None:
        self._results: dict[Hashable, Value] = {}

    def value(self, x: Any, at: Scope, key: Hashable = ()) -> Value:
        """The value of an expression. `key` identifies the values in the scope."""
        if not isinstance(x, e.FieldOf) or not isinstance(x.base, e.FunctionCall):
            return evaluate(x, at)
        call = (x.base, key)
        if call not in self._results:
            self._results[call] = evaluate(x.base, at)
        found: Any = Opaque("result", self._results[call])
        return evaluate(e.FieldOf(found, x.name), at)


# Functions of the language that depend on more than the values of their arguments (Modelica 3.6, section 3.7). Each
# takes its arguments as terms, and the scope.

Args: TypeAlias = Sequence[Any]


def _smooth(args: Args, at: Scope) -> Value:
    order = _first(args[0], at)
    return _first(args[1], at.without_events() if order >= 1 else at)


def _semilinear(args: Args, at: Scope) -> Value:
    zero, (x, up, down) = e.Const(0.0), args
    return _first(e.If(((e.Binary("Ge", x, zero), e.Binary("Mul", up, x)),), e.Binary("Mul", down, x)), at)


def _derivative(args: Args, at: Scope) -> Value:
    (x,) = args
    if not at.rates:
        raise NotKnown("a derivative")
    if _is_part(x):
        return _first(x, dataclasses.replace(at, values=at.rates))
    moving = [i for i, rate in enumerate(at.rates) if rate is not None]

    def along(*values: Value) -> Value:
        whole = list(at.values)
        for i, value in zip(moving, values, strict=True):
            whole[i] = value
        return jnp.asarray(_first(x, dataclasses.replace(at, values=whole, holds=False)), float)

    start = [jnp.asarray(at.values[i], float) for i in moving]
    return jax.jvp(along, start, [jnp.asarray(at.rates[i], float) for i in moving])[1]


def _is_part(x: Any) -> bool:
    """Whether a term is a variable, or an element of one at a fixed place."""
    if isinstance(x, e.Subscript) and all(isinstance(sub, e.Const | e.Colon) for sub in x.subs):
        x = x.base
    return isinstance(x, SlotValue)


def _root(args: Args, at: Scope) -> Value:
    """A square root, whose slope at 0 is infinite. That of max(low, x) is constant where x is less. That of a sum of
    squares is a length, whose slope at 0 is 0, the mean of those on both sides.
    """
    root = FUNCTIONS["Sqrt"]
    if _is_sum_of_squares(args[0]):
        value = number(_first(args[0], at))
        return root(value) if is_known(value) else choose(value > 0.0, lambda: root(value), lambda: 0.0 * value)
    match args[0]:
        case e.Builtin("Max", (e.Const() as low, x)) | e.Builtin("Max", (x, e.Const() as low)):
            value = number(_first(x, at))
            if not is_known(value):
                return choose(value > low.value, lambda: root(value), lambda: root(low.value))
    return root(_first(args[0], at))


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


def _held_floor(args: Args, at: Scope) -> Value:
    """floor(x), held between events at its value before. At an event it changes by 1 at least, whatever x rounds to."""
    x, before = (jnp.asarray(_first(arg, at), float) for arg in args)
    above, below = x >= before + 1.0, x < before
    if at.holds:
        above, below = held_relation(above), held_relation(below)
    whole = jnp.floor(x)
    fallen = jnp.where(below, jnp.minimum(whole, before - 1.0), before)
    return jnp.where(above, jnp.maximum(whole, before + 1.0), fallen)


def _recall(args: Args, at: Scope) -> Value:
    past, since, before = (jnp.asarray(_first(arg, at), float) for arg in args)
    return recall(past, since, before)


def _missing(name: str) -> Callable[[Args, Scope], Value]:
    def missing(args: Args, at: Scope) -> Value:
        raise NotKnown(name)

    return missing


SPECIAL: dict[str, Callable[[Args, Scope], Value]] = {
    "Smooth": _smooth,
    "SemiLinear": _semilinear,
    "Sqrt": _root,
    "HeldFloor": _held_floor,
    "Recall": _recall,
    "Der": _derivative,
    "Terminal": lambda args, at: False,
    "Initial": _missing("initial()"),
    "Pre": _missing("pre"),
}
