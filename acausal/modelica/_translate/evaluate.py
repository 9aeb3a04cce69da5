"""Evaluation of expressions."""

import dataclasses
from collections import ChainMap
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, Protocol

import jax
import jax.numpy as jnp
import numpy as np

from ..._declare.ifelse import held_relation
from ..._errors import ModelError
from .._syntax import expressions as e
from .branches import choose
from .builtins import FUNCTIONS
from .complex_numbers import is_complex, operation
from .terms import Opaque, RecordOf, SlotValue
from .values import Value, is_known, number, plain, power, product, select, stacked


class NotKnown(Exception):
    """An expression that is not known while equations are translated; it names what is missing."""


class FunctionLibrary(Protocol):
    """Calls of functions of the model by name, with all their results."""

    def call(self, name: str, args: Sequence[Value]) -> tuple[Value, ...]: ...


@dataclasses.dataclass(frozen=True)
class Scope:
    """Values of the slots and of local names. `holds`: relations are held between events, as in `ifelse`.
    `in_condition`: relations are conditions of events.
    """

    functions: FunctionLibrary
    values: Sequence[Value] = ()
    rates: Sequence[Value] = ()
    locals: Mapping[str, Value] = dataclasses.field(default_factory=dict)
    holds: bool = False
    in_condition: bool = False

    def without_events(self) -> "Scope":
        return dataclasses.replace(self, holds=False)

    def knowing(self, **names: Value) -> "Scope":
        return dataclasses.replace(self, locals=ChainMap(names, self.locals))  # pyright: ignore[reportArgumentType]


def evaluate(x: Any, at: Scope) -> Value:
    """The value of an expression. Raises `NotKnown` for a name that has none."""
    return _BY_CLASS[type(x)](x, at)


def _first(x: Any, at: Scope) -> Value:
    """The value of an expression inside another one: of several results of a function the first one."""
    value = evaluate(x, at)
    return value[0] if isinstance(value, tuple) else value


def _slot(x: SlotValue, at: Scope) -> Value:
    value = at.values[x.number]
    if x.kind != "boolean":
        return value
    # In conditions of events, relations of real numbers must be inequalities.
    return value > 0.5 if at.in_condition else value != 0.0


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
    """Elements of an array; Modelica counts from 1."""
    if isinstance(value, dict):
        return {name: subscripted(item, subs, at) for name, item in value.items()}
    index = tuple(_index(sub, value, axis, at) for axis, sub in enumerate(subs))
    if any(isinstance(item, jax.Array) for item in index):
        value = jnp.asarray(value)
    if any(isinstance(item, np.ndarray) for item in index) and len(index) > 1:
        for axis, item in reversed(list(enumerate(index))):
            value = value[(slice(None),) * axis + (item,)]
        return plain(value)
    return plain(value[index])


def _index(sub: Any, value: Value, axis: int, at: Scope) -> Any:
    if isinstance(sub, e.Colon):
        return slice(None)
    found = evaluate(sub, at.knowing(end=np.shape(value)[axis]))
    if isinstance(found, bool):
        return int(found)  # Boolean subscripts count false, true
    if isinstance(found, np.ndarray):
        return found.astype(int) - 1
    if is_known(found):
        return int(found) - 1
    return jnp.round(found).astype(int) - 1


_NUMERIC: dict[str, Callable[[Value, Value], Value]] = {
    "Add": lambda a, b: a + b,
    "Sub": lambda a, b: a - b,
    "Mul": product,
    "Div": lambda a, b: _quotient(a, b),
    "Exp": power,
    "AddElem": lambda a, b: a + b,
    "SubElem": lambda a, b: a - b,
    "MulElem": lambda a, b: a * b,
    "DivElem": lambda a, b: _quotient(a, b),
    "ExpElem": power,
}
_RELATIONS: dict[str, Callable[[Value, Value], Value]] = {
    "Lt": lambda a, b: a < b,
    "Le": lambda a, b: a <= b,
    "Gt": lambda a, b: a > b,
    "Ge": lambda a, b: a >= b,
    "Eq": lambda a, b: a == b,
    "Neq": lambda a, b: a != b,
}


def _quotient(a: Value, b: Value) -> Value:
    if is_known(b) and not np.all(b):
        b = np.asarray(b, float)
        with np.errstate(all="ignore"):
            return plain(a / b)
    return a / b


def _binary(x: e.Binary, at: Scope) -> Value:
    if x.op in ("And", "Or"):
        return _logic(x, at)
    if x.op in _RELATIONS:
        return _relation(x, at)
    if x.op not in _NUMERIC:
        raise ModelError(f"the operator {x.op} is not supported.")
    a, b = _first(x.left, at), _first(x.right, at)
    if is_complex(a) or is_complex(b):
        return operation(x.op, a, b)
    if isinstance(a, dict):
        return _record_operation(x.op, a, b)
    return _NUMERIC[x.op](a, b)


def _record_operation(op: str, a: dict[str, Value], b: Value) -> Value:
    if op in ("Add", "Sub") and isinstance(b, dict):
        return {name: _NUMERIC[op](a[name], b[name]) for name in a}
    raise ModelError(f"the operator {op} of records is not supported.")


def _logic(x: e.Binary, at: Scope) -> Value:
    a = evaluate(x.left, at)
    is_and = x.op == "And"
    if is_known(a) and np.ndim(a) == 0 and bool(a) != is_and:
        return bool(a)
    b = evaluate(x.right, at)
    if is_known(a) and is_known(b):
        return plain(np.logical_and(a, b) if is_and else np.logical_or(a, b))
    if is_known(a) and np.ndim(a) == 0:
        return b
    if is_known(b) and np.ndim(b) == 0:
        return a if bool(b) == is_and else bool(b)
    return jnp.logical_and(a, b) if is_and else jnp.logical_or(a, b)


def _relation(x: e.Binary, at: Scope) -> Value:
    a, b = _first(x.left, at), _first(x.right, at)
    if x.op in ("Lt", "Le", "Gt", "Ge"):
        a, b = number(a), number(b)
    truth = _RELATIONS[x.op](a, b)
    if is_known(truth):
        return plain(truth)
    holds = at.holds and x.op not in ("Eq", "Neq") and not (only_discrete(x.left) and only_discrete(x.right))
    # The engine cannot search for a relation between rates; such a relation counts as in noEvent.
    return held_relation(jnp.asarray(truth)) if holds and not reads_rates(x) else truth


def reads_rates(x: Any) -> bool:
    """Whether an expression reads a derivative."""
    if isinstance(x, e.Builtin) and x.name == "Der":
        return True
    return any(reads_rates(part) for part in parts_of(x))


def only_discrete(x: Any) -> bool:
    """Whether an expression changes at events only."""
    if isinstance(x, SlotValue):
        return x.is_discrete
    if isinstance(x, e.Binary) and x.op in _RELATIONS:
        return True
    return all(only_discrete(part) for part in parts_of(x))


def parts_of(x: Any) -> list[Any]:
    """The expressions directly inside an expression."""
    found: list[Any] = []

    def visit(item: Any) -> None:
        if isinstance(item, tuple):
            for inner in item:
                visit(inner)
        elif dataclasses.is_dataclass(item):
            found.append(item)

    for field in dataclasses.fields(x):
        if not (isinstance(x, Opaque) and field.name == "value"):
            visit(getattr(x, field.name))
    return found


def _unary(x: e.Unary, at: Scope) -> Value:
    value = _first(x.arg, at)
    if x.op == "Not":
        return plain(np.logical_not(value)) if is_known(value) else jnp.logical_not(value)
    if isinstance(value, dict):
        return {name: -item if x.op == "Minus" else item for name, item in value.items()}
    return -number(value) if x.op in ("Minus", "MinusElem") else number(value)


def _if(x: e.If, at: Scope) -> Value:
    for position, (condition, value) in enumerate(x.branches, 1):
        truth = evaluate(condition, at)
        if is_known(truth):
            if truth:
                return evaluate(value, at)
            continue
        rest = e.If(x.branches[position:], x.otherwise) if x.branches[position:] else x.otherwise
        if at.holds or (_is_harmless(value) and _is_harmless(rest)):
            return select(truth, evaluate(value, at), evaluate(rest, at))
        return choose(truth, partial(evaluate, value, at), partial(evaluate, rest, at))
    return evaluate(x.otherwise, at)


def _is_harmless(x: Any) -> bool:
    """Whether an expression and its derivatives are finite wherever its parts are."""
    if isinstance(x, e.Binary) and x.op not in ("Add", "Sub", "Mul", "AddElem", "SubElem", "MulElem"):
        return False
    if isinstance(x, e.FunctionCall | e.Builtin | e.If | e.Comprehension):
        return False
    return all(_is_harmless(part) for part in parts_of(x))


def _builtin(x: e.Builtin, at: Scope) -> Value:
    special = _SPECIAL.get(x.name)
    if special is not None:
        return special(x.args, at)
    if x.name not in FUNCTIONS:
        raise ModelError(f"the function {x.name.lower()} is not supported.")
    args = [_first(arg, at) for arg in x.args]
    return FUNCTIONS[x.name](*args)


def is_supported(name: str) -> bool:
    """Whether a function of the language has a value."""
    return name in FUNCTIONS or name in _SPECIAL


def _smooth(args: Sequence[Any], at: Scope) -> Value:
    order = evaluate(args[0], at)
    return evaluate(args[1], at.without_events() if order >= 1 else at)


def _semilinear(args: Sequence[Any], at: Scope) -> Value:
    zero, (x, up, down) = e.Const(0.0), args
    return evaluate(e.If(((e.Binary("Ge", x, zero), e.Binary("Mul", up, x)),), e.Binary("Mul", down, x)), at)


def _derivative(args: Sequence[Any], at: Scope) -> Value:
    (x,) = args
    if not at.rates:
        raise NotKnown("a derivative")
    if isinstance(x, SlotValue):
        return at.rates[x.number]
    if isinstance(x, e.Subscript) and isinstance(x.base, SlotValue):
        return subscripted(at.rates[x.base.number], x.subs, at)
    moving = [i for i, rate in enumerate(at.rates) if rate is not None]

    def along(*values: Value) -> Value:
        whole = list(at.values)
        for i, value in zip(moving, values, strict=True):
            whole[i] = value
        return jnp.asarray(evaluate(x, dataclasses.replace(at, values=whole, holds=False)), float)

    start = [jnp.asarray(at.values[i], float) for i in moving]
    return jax.jvp(along, start, [jnp.asarray(at.rates[i], float) for i in moving])[1]


def _root(args: Sequence[Any], at: Scope) -> Value:
    """A square root. That of max(low, x) is constant where x is less; the slope of the root at 0 is infinite."""
    match args[0]:
        case e.Builtin("Max", (e.Const() as low, x)) | e.Builtin("Max", (x, e.Const() as low)):
            value = number(_first(x, at))
            if not is_known(value):
                root = FUNCTIONS["Sqrt"]
                return choose(value > low.value, lambda: root(value), lambda: root(low.value))
    return FUNCTIONS["Sqrt"](_first(args[0], at))


def _unknown(name: str) -> Value:
    raise NotKnown(name)


_SPECIAL: dict[str, Callable[[Sequence[Any], Scope], Value]] = {
    "NoEvent": lambda args, at: evaluate(args[0], at.without_events()),
    "Smooth": _smooth,
    "SemiLinear": _semilinear,
    "Sqrt": _root,
    "Der": _derivative,
    "Terminal": lambda args, at: False,
    "Initial": lambda args, at: _unknown("initial()"),
    "Pre": lambda args, at: _unknown("pre"),
}


def _array(x: e.ArrayOf, at: Scope) -> Value:
    values = [_first(item, at) for item in x.elements]
    if x.kind == "array":
        return stacked([number(v) if any(not is_known(w) for w in values) else v for v in values])
    xp = np if all(is_known(value) for value in values) else jnp
    matrices = [xp.reshape(value, np.shape(value) + (1,) * (2 - np.ndim(value))) for value in values]
    return xp.concatenate(matrices, axis=1 if x.kind == "row" else 0)


def _comprehension(x: e.Comprehension, at: Scope) -> Value:
    (name, over), *rest = x.indices
    body = e.Comprehension(x.body, tuple(rest)) if rest else x.body
    return stacked([evaluate(body, at.knowing(**{name: plain(item)})) for item in evaluate(over, at)])


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
