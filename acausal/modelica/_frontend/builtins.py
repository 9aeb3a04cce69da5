"""Operators and functions of the language (Modelica 3.6, sections 3.7, 10.3 and chapter 16): types and sizes."""

import dataclasses
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from .._syntax import expressions as e
from . import references
from . import tree as t
from .classes import ComponentElement
from .typed import (
    ANY,
    BOOLEAN,
    CLOCK,
    CONSTANT,
    CONTINUOUS,
    DISCRETE,
    INTEGER,
    PARAMETER,
    REAL,
    STRING,
    Dims,
    Type,
    Typed,
    common,
    constant,
    element,
    indices,
    joined_dims,
    nested,
    same_dims,
    written_out,
)  # fmt: skip

if TYPE_CHECKING:
    from .expressions import Expressions

Args = Sequence[Typed]
_Handler = Callable[["Expressions", str, t.Call, Args], Typed]

# Names of the arguments of the functions that have more than one, or that are called by name.
_NAMES = {
    "homotopy": ("actual", "simplified"), "smooth": ("p", "expr"), "delay": ("expr", "delayTime", "delayMax"),
    "sample": ("start", "interval"), "semiLinear": ("x", "positiveSlope", "negativeSlope"),
    "hold": ("u",), "subSample": ("u", "factor"), "superSample": ("u", "factor"), "previous": ("u",),
    "shiftSample": ("u", "shiftCounter", "resolution"), "backSample": ("u", "backCounter", "resolution"),
    "noClock": ("u",), "interval": ("u",), "firstTick": ("u",), "div": ("x", "y"), "mod": ("x", "y"),
    "rem": ("x", "y"), "atan2": ("u1", "u2"), "linspace": ("x1", "x2", "n"), "cross": ("x", "y"),
    "assert": ("condition", "message", "level"), "terminate": ("message",), "reinit": ("x", "expr"),
    "spatialDistribution": ("in0", "in1", "x", "positiveVelocity", "initialPoints", "initialValues"),
}  # fmt: skip
_TEXT = {"significantDigits": "Integer", "minimumLength": "Integer", "leftJustified": "Boolean", "format": "String"}
_OUTSIDE_FUNCTIONS = (
    "der", "pre", "edge", "change", "previous", "initial", "terminal", "sample", "delay", "hold", "noClock",
    "subSample", "superSample", "shiftSample", "backSample", "interval", "firstTick", "inStream", "actualStream",
    "cardinality", "isRoot", "rooted",
)  # fmt: skip
_REAL = "sin cos tan asin acos atan sinh cosh tanh exp log log10 sqrt".split()


def call(here: "Expressions", name: str, x: t.Call) -> Typed:
    """A call of a function of the language."""
    low, high, handler = FUNCTIONS[name]
    if x.named and name not in ("String", "Clock"):
        x = t.Call(x.function, arguments(here, name, x, low, high), (), at=x.at)
    _check_count(here, name, x, low, high)
    given = [*x.args, *(value for _, value in x.named)]
    if name == "size" and len(given) in (1, 2):
        return _size(here, x, given)
    within = dataclasses.replace(here, at_start=True) if name == "pure" else here
    args = [within.single(arg) for arg in given]
    if name in _OUTSIDE_FUNCTIONS and here.scope.whole.is_function:
        raise here.error(x.at, f"`{name}` is not allowed in functions.")
    return handler(here, name, x, args)


def arguments(here: "Expressions", name: str, x: t.Call, low: int, high: int) -> tuple[t.Expression, ...]:
    """The arguments of an operator or function in their order. Raises `TextError` for another number of them."""
    names = _NAMES.get(name, ("x",))
    given = dict(enumerate(x.args))
    for key, value in x.named:
        i = names.index(key) if key in names else -1
        if i < 0 or i in given:
            raise here.error(value.at, f"`{name}` has no argument {key}, or has it twice.")
        given[i] = value
    for i in range(len(given)):
        if i not in given:
            raise here.error(x.at, f"`{name}` needs a value of its argument {names[i]}.")
    _check_count(here, name, x, low, high)
    return tuple(given[i] for i in range(len(given)))


def _check_count(here: "Expressions", name: str, x: t.Call, low: int, high: int) -> None:
    count = len(x.args) + len(x.named)
    if not low <= count <= high:
        raise here.error(
            x.at, f"`{name}` has {count} arguments, but needs {low if low == high else f'{low} to {high}'}."
        )


def _title(name: str) -> str:
    return name[0].upper() + name[1:]


def _made(name: str, args: Args, kind: Type, dims: Dims = (), variability: int | None = None) -> Typed:
    found = max((arg.variability for arg in args), default=CONSTANT) if variability is None else variability
    return Typed(e.Builtin(_title(name), tuple(arg.x for arg in args)), kind, dims, found)


def _need(
    here: "Expressions", name: str, x: t.Call, arg: Typed, *, ranks: Sequence[int] = (), numeric: bool = True
) -> None:
    """Raises `TextError` for an argument that is no number, or has not one of these numbers of dimensions."""
    if numeric and not arg.type.is_numeric and arg.type != ANY:
        raise here.error(x.at, f"`{name}` needs numbers, not a value of type {arg.type}.")
    if ranks and len(arg.dims) not in ranks:
        raise here.error(
            x.at, f"`{name}` needs an array of {' or '.join(map(str, ranks))} dimensions, not {len(arg.dims)}."
        )


def _elementwise(here: "Expressions", name: str, x: t.Call, args: Args) -> Dims:
    """The size of the value of a function of numbers that is evaluated for each element."""
    for arg in args:
        _need(here, name, x, arg)
    dims = max((arg.dims for arg in args), key=len)
    if any(arg.dims and not same_dims(arg.dims, dims) for arg in args):
        raise here.error(x.at, f"the arguments of `{name}` have different sizes.")
    return dims


def _real(here: "Expressions", name: str, x: t.Call, args: Args) -> Typed:
    _need(here, name, x, args[0])
    found = _made(name, args, REAL, args[0].dims)
    is_literal = isinstance(x.args[0], t.Literal | t.Unary) and isinstance(args[0].x, e.Const)
    if is_literal and not here.in_branch and not np.isfinite(here.context.value(found.x)):
        raise here.error(x.at, f"`{name}` is not defined for {here.context.value(args[0].x)}.")
    return found


def _of_two(here: "Expressions", name: str, x: t.Call, args: Args) -> Typed:
    dims = _elementwise(here, name, x, args)
    is_whole = all(arg.type == INTEGER for arg in args) and name != "atan2"
    return _discrete(_made(name, args, INTEGER if is_whole else REAL, dims), name in ("div",))


def _discrete(found: Typed, is_discrete: bool) -> Typed:
    return found._replace(variability=min(found.variability, 2)) if is_discrete else found


def _same(here: "Expressions", name: str, x: t.Call, args: Args) -> Typed:
    """A function whose value has the type of its first argument."""
    if name == "pure":
        if not isinstance(x.args[0], t.Call):
            raise here.error(x.at, "`pure` needs the call of a function.")
        return args[0]
    if name == "abs":
        _need(here, name, x, args[0])
    # What is inside `noEvent` is continuous, also if it is a relation (section 3.8.5).
    varies = args[0].variability > PARAMETER and name == "noEvent"
    return _made(name, args, args[0].type, args[0].dims, CONTINUOUS if varies else None)


def _rounded(here: "Expressions", name: str, x: t.Call, args: Args) -> Typed:
    _need(here, name, x, args[0])
    kind = INTEGER if name in ("integer", "sign") else REAL
    return _discrete(_made(name, args, kind, args[0].dims), True)


def _integer_of(here: "Expressions", name: str, x: t.Call, args: Args) -> Typed:
    """`Integer(e)`: the number of an enumeration literal. Literals are their numbers in the flat model."""
    if args[0].type.name != "enumeration":
        raise here.error(x.at, f"`Integer` needs an enumeration, not a value of type {args[0].type}.")
    return args[0]._replace(type=INTEGER)


def _extreme(here: "Expressions", name: str, x: t.Call, args: Args) -> Typed:
    kind = args[0].type
    if len(args) == 1:
        if not args[0].dims or kind == STRING:
            raise here.error(x.at, f"`{name}` of one argument needs an array of numbers.")
        if 0 in args[0].dims:
            return _extreme_of_none(here, name, kind)
        return _made(name, args, kind)
    both = common(kind, args[1].type)
    if both is None or args[0].dims or args[1].dims or both == STRING:
        raise here.error(x.at, f"`{name}` needs two scalars of one type.")
    return _made(name, args, both)


def _extreme_of_none(here: "Expressions", name: str, kind: Type) -> Typed:
    """The least or greatest element of an empty array: the greatest or least value of its type."""
    if kind.name == "enumeration" and kind.instance is not None:
        return references.literal(here, kind.instance, len(kind.instance.literals or ()) if name == "min" else 1)
    if kind == BOOLEAN:
        return constant(name == "min")
    limits = np.iinfo(np.int32) if kind == INTEGER else np.finfo(float)
    return constant((int if kind == INTEGER else float)(limits.max if name == "min" else limits.min))


def _total(here: "Expressions", name: str, x: t.Call, args: Args) -> Typed:
    if args[0].type.name == "record":
        return _record_total(here, name, x, args[0])
    _need(here, name, x, args[0])
    if not args[0].dims:
        raise here.error(x.at, f"`{name}` needs an array, not a scalar.")
    return _made(name, args, args[0].type if args[0].type != ANY else REAL)


def _record_total(here: "Expressions", name: str, x: t.Call, arg: Typed) -> Typed:
    """The sum of an array of operator records, from left to right."""
    from . import operator_records

    if not isinstance(arg.x, e.ArrayOf) or not arg.x.elements or name != "sum" or len(arg.dims) != 1:
        raise here.error(x.at, f"`{name}` of this array of records is not supported.")
    found = arg._replace(x=arg.x.elements[0], dims=())
    plus = t.Binary("+", x.args[0], x.args[0], at=x.at)
    for item in arg.x.elements[1:]:
        found = operator_records.binary(here, plus, found, arg._replace(x=item, dims=()))
    return found


def _size(here: "Expressions", x: t.Call, given: Sequence[t.Expression]) -> Typed:
    own = _size_of_component(here, given)
    if own is not None:
        return own
    base = here.typed(given[0])
    rank = len(base.dims)
    if len(given) == 1:
        if None not in base.dims:
            items = tuple(e.Const(size) for size in base.dims if size is not None)
            return Typed(e.ArrayOf(items), INTEGER, (rank,), CONSTANT)
        return Typed(e.Builtin("Size", (base.x,)), INTEGER, (rank,))
    axis = here.single(given[1])
    if axis.type != INTEGER or axis.dims:
        raise here.error(x.at, "the second argument of `size` must be an Integer.")
    number = here.context.known(axis.x) if axis.variability <= PARAMETER else None
    if number is None:
        return Typed(e.Builtin("Size", (base.x, axis.x)), INTEGER)
    if not 1 <= number <= rank:
        raise here.error(x.at, f"`size` asks for dimension {number} of an array of {rank} dimensions.")
    size = base.dims[number - 1]
    if size is not None:
        return constant(size)
    return Typed(e.Builtin("Size", (base.x, e.Const(number))), INTEGER)


def _size_of_component(here: "Expressions", given: Sequence[t.Expression]) -> Typed | None:
    """One size of a component, which must not need its other ones: `Real x[size(x, 2), 3]`."""
    ref = given[0]
    if len(given) < 2 or not isinstance(ref, t.Reference) or not isinstance(given[1], t.Literal):
        return None
    first, *rest = ref.parts
    if rest or first.subs or first.name in here.names or ref.is_global:
        return None
    found = here.scope.find(first.name)
    if not isinstance(found, ComponentElement) or found.dims is not None or found.is_outer:
        return None
    number = int(given[1].value)
    if not 1 <= number <= len(found.tree.dims):
        return None
    size = here.context.size(found, number - 1)
    if size is not None:
        return constant(size)
    return Typed(e.Builtin("Size", (e.Ref(found.name), e.Const(number))), INTEGER) if found.is_local else None


def _ndims(here: "Expressions", name: str, x: t.Call, args: Args) -> Typed:
    return constant(len(args[0].dims))


def _count(here: "Expressions", arg: Typed, x: t.Call) -> int | None:
    if arg.type != INTEGER or arg.dims:
        raise here.error(x.at, f"a size must be an Integer, not of type {arg.type}.")
    if arg.variability > PARAMETER:
        if not here.scope.whole.is_local and not here.names:
            raise here.error(x.at, f"a size of `{x.function}` must be a constant or parameter, and not vary.")
        return None
    size = here.context.known(arg.x)
    if size is not None and arg.variability == PARAMETER:
        here.context.select(arg.x)
    return size


def _filled(here: "Expressions", name: str, x: t.Call, args: Args) -> Typed:
    values: Args = args[:1] if name == "fill" else []
    sizes = args[len(values) :]
    dims = tuple(_count(here, size, x) for size in sizes)
    fixed = [size if n is None else constant(n) for size, n in zip(sizes, dims, strict=True)]
    kind = values[0].type if values else INTEGER
    inner = values[0].dims if values else ()
    variability = values[0].variability if values else CONSTANT
    found = _made(name, [*values, *fixed], kind, (*dims, *inner), variability)
    if values and (kind.name in ("record", "String", "object") or inner) and None not in dims:
        count = 1
        for n in dims:
            count *= n or 0
        return found._replace(x=nested([values[0].x] * count, dims))
    return found


def _square(here: "Expressions", name: str, x: t.Call, args: Args) -> Typed:
    """`identity(n)` and `diagonal(v)`."""
    if name == "identity":
        size = _count(here, args[0], x)
        return _made(name, [args[0] if size is None else constant(size)], INTEGER, (size, size), CONSTANT)
    _need(here, name, x, args[0], ranks=(1,))
    return _made(name, args, args[0].type, args[0].dims * 2)


def _linspace(here: "Expressions", name: str, x: t.Call, args: Args) -> Typed:
    size = _count(here, args[2], x)
    return _made(name, [*args[:2], args[2] if size is None else constant(size)], REAL, (size,))


def _transposed(here: "Expressions", name: str, x: t.Call, args: Args) -> Typed:
    if len(args[0].dims) < 2:
        raise here.error(x.at, f"`transpose` needs a matrix, not an array of {len(args[0].dims)} dimensions.")
    first, second, *rest = args[0].dims
    return _made(name, args, args[0].type, (second, first, *rest))


def _outer(here: "Expressions", name: str, x: t.Call, args: Args) -> Typed:
    for arg in args:
        _need(here, name, x, arg, ranks=(1,))
    return _made(name, args, REAL, (*args[0].dims, *args[1].dims))


def _symmetric(here: "Expressions", name: str, x: t.Call, args: Args) -> Typed:
    _need(here, name, x, args[0], ranks=(2,))
    if not same_dims(args[0].dims[:1], args[0].dims[1:]):
        raise here.error(x.at, "`symmetric` needs a square matrix.")
    return _made(name, args, args[0].type, args[0].dims)


def _three(here: "Expressions", name: str, x: t.Call, args: Args) -> Typed:
    """`cross(x, y)` and `skew(x)`."""
    for arg in args:
        _need(here, name, x, arg, ranks=(1,))
        if not same_dims(arg.dims, (3,)):
            raise here.error(x.at, f"`{name}` needs vectors of size 3.")
    return _made(name, args, REAL, (3,) if name == "cross" else (3, 3))


def _reshaped(here: "Expressions", name: str, x: t.Call, args: Args) -> Typed:
    """`scalar`, `vector` and `matrix`."""
    arg = args[0]
    if name == "scalar":
        if any(size not in (1, None) for size in arg.dims):
            raise here.error(x.at, "`scalar` needs an array of one element.")
        return _made(name, args, arg.type) if arg.dims else arg
    if name == "vector":
        if len(arg.dims) == 1:
            return arg
        long = [size for size in arg.dims if size != 1]
        if len(long) > 1:
            raise here.error(x.at, "`vector` needs an array with one dimension longer than 1 at most.")
        return _made(name, args, arg.type, (long[0] if long else 1,))
    if any(size not in (1, None) for size in arg.dims[2:]):
        raise here.error(x.at, "`matrix` needs an array whose dimensions after the second have size 1.")
    return _made(name, args, arg.type, (*arg.dims, 1, 1)[:2]) if len(arg.dims) != 2 else arg


def _promoted(here: "Expressions", name: str, x: t.Call, args: Args) -> Typed:
    """`promote(a, n)`: an array with further dimensions of size 1 at the end (section 10.4.2.1)."""
    rank = int(here.known(x.args[1], "the number of dimensions of `promote`"))
    sizes = [n for n in args[0].dims if n is not None]
    if rank < len(args[0].dims) or len(sizes) < len(args[0].dims):
        raise here.error(x.at, f"`promote` cannot give an array of {len(args[0].dims)} dimensions {rank} of them.")
    items = [element(args[0].x, [e.Const(i) for i in index]) for index in indices(sizes)]
    dims = (*sizes, *[1] * (rank - len(sizes)))
    return args[0]._replace(x=nested(items, dims), dims=dims)


def _cat(here: "Expressions", name: str, x: t.Call, args: Args) -> Typed:
    axis = int(here.known(x.args[0], "the dimension of `cat`")) - 1
    parts = args[1:]
    if not 0 <= axis < min(len(part.dims) for part in parts):
        raise here.error(
            x.at, f"`cat` cannot join arrays of {len(parts[0].dims)} dimensions along dimension {axis + 1}."
        )
    return concatenated(here, "arrays of `cat`", parts, axis, x.at)


def concatenated(here: "Expressions", what: str, parts: Args, axis: int, at: int) -> Typed:
    """Arrays joined along an axis, counted from 0. Those that are written out give one that is, too."""
    across = [part._replace(dims=(*part.dims[:axis], *part.dims[axis + 1 :])) for part in parts]
    kind, rest = here.unified(what, [(part, at) for part in across])
    along = [part.dims[axis] for part in parts]
    total = None if None in along else sum(n or 0 for n in along)
    whole = (*rest[:axis], total, *rest[axis:])
    x = parts[0].x if len(parts) == 1 else _joined([part.x for part in parts], axis)
    found = _made("cat", [constant(axis + 1), *parts], kind, whole)
    return found if x is None else found._replace(x=x)


def _joined(parts: Sequence[e.Expression], axis: int) -> e.Expression | None:
    """Arrays joined along an axis; None unless they are written out."""
    rows = [x.elements for x in parts if isinstance(x, e.ArrayOf)]
    if len(rows) < len(parts):
        return None
    if axis == 0:
        return e.ArrayOf(tuple(item for row in rows for item in row))
    items = [_joined(each, axis - 1) for each in zip(*rows, strict=True)]
    joined = tuple(item for item in items if item is not None)
    return e.ArrayOf(joined) if len(joined) == len(items) else None


def _derivative(here: "Expressions", name: str, x: t.Call, args: Args) -> Typed:
    arg = args[0]
    if not arg.type.is_numeric:
        raise here.error(x.at, f"`der` needs a Real, not a value of type {arg.type}.")
    if arg.variability == DISCRETE or (arg.type == INTEGER and arg.variability > PARAMETER):
        raise here.error(x.at, "`der` needs a continuous value: this one is discrete, and has no derivative.")
    if arg.variability <= PARAMETER:
        return (
            _made("zeros", [constant(n or 0) for n in arg.dims], REAL, arg.dims, CONSTANT)
            if arg.dims
            else constant(0.0)
        )
    return _each(arg, lambda item: e.Builtin("Der", (item,)), REAL, 3)


def _each(arg: Typed, change: Callable[[e.Expression], e.Expression], kind: Type, variability: int) -> Typed:
    """An operator of variables, for each element of an array that is written out."""

    def of(x: e.Expression) -> e.Expression:
        if isinstance(x, e.ArrayOf):
            return e.ArrayOf(tuple(of(item) for item in x.elements))
        return change(x)

    return Typed(of(arg.x), kind, arg.dims, variability)


def _previous(here: "Expressions", name: str, x: t.Call, args: Args) -> Typed:
    """`pre`, `edge`, `change` and `previous`."""
    if not isinstance(x.args[0] if x.args else x.named[0][1], t.Reference):
        raise here.error(x.at, f"`{name}` needs a variable.")
    if name == "edge" and args[0].type != BOOLEAN:
        raise here.error(x.at, f"`edge` needs a Boolean, not a value of type {args[0].type}.")
    if args[0].variability > DISCRETE and name != "previous" and not here.in_when:
        raise here.error(x.at, f"`{name}` of a continuous variable is allowed in the body of `when` only.")
    if args[0].variability <= PARAMETER and name == "pre":
        return args[0]
    kind = args[0].type if name in ("pre", "previous") else BOOLEAN
    return _each(args[0], lambda item: e.Builtin(_title(name), (item,)), kind, 2)


def _truth(here: "Expressions", name: str, x: t.Call, args: Args) -> Typed:
    """`initial` and `terminal`."""
    if name == "terminal":
        here.context.warnings.append(str(here.error(x.at, "`terminal()` is false here, also at the end of a run.")))
    return Typed(e.Builtin(_title(name), ()), BOOLEAN, (), 2)


def _sample(here: "Expressions", name: str, x: t.Call, args: Args) -> Typed:
    if len(args) == 1 or args[1].type == CLOCK:
        return _made(name, args, args[0].type, args[0].dims, 2)
    for arg in args:
        _need(here, name, x, arg, ranks=(0,))
        if arg.variability > PARAMETER:
            raise here.error(x.at, "the arguments of `sample` must be parameters.")
    return _made(name, args, BOOLEAN, (), 2)


def _smooth(here: "Expressions", name: str, x: t.Call, args: Args) -> Typed:
    if args[0].type != INTEGER or args[0].variability > PARAMETER:
        raise here.error(x.at, "the first argument of `smooth` must be an Integer that does not vary.")
    return _made(name, args, args[1].type, args[1].dims, args[1].variability)


def _homotopy(here: "Expressions", name: str, x: t.Call, args: Args) -> Typed:
    if not same_dims(args[0].dims, args[1].dims):
        raise here.error(x.at, "the arguments of `homotopy` have different sizes.")
    return _made(name, args, args[0].type, joined_dims(args[0].dims, args[1].dims))


def _semilinear(here: "Expressions", name: str, x: t.Call, args: Args) -> Typed:
    dims = _elementwise(here, name, x, args)
    if not dims or None in dims:
        return _made(name, args, REAL, dims)

    def of(subs: list[e.Const]) -> e.Expression:
        return e.Builtin("SemiLinear", tuple(element(arg.x, subs) if arg.dims else arg.x for arg in args))

    return Typed(written_out(dims, of), REAL, dims, max(arg.variability for arg in args))


def _delay(here: "Expressions", name: str, x: t.Call, args: Args) -> Typed:
    if len(args) == 3 and args[1].variability <= PARAMETER:
        time, limit = here.context.known(args[1].x), here.context.known(args[2].x)
        if time is not None and limit is not None and time > limit:
            raise here.error(x.at, f"the delay {time} is greater than its limit {limit}.")
    return _made(name, args, args[0].type, args[0].dims, args[0].variability)


def _text(here: "Expressions", name: str, x: t.Call, args: Args) -> Typed:
    if args[0].type.name == "record" and not args[0].dims:
        return _text_of_record(here, x, args[0])
    if args[0].dims or not args[0].type.is_plain:
        raise here.error(x.at, f"`String` needs a scalar, not a value of type {args[0].type}.")
    if len(x.args) > 1:
        raise here.error(x.args[1].at, "the further arguments of `String` need their names, as in `format = ...`.")
    for (key, value), arg in zip(x.named, args[len(x.args) :], strict=True):
        if key not in _TEXT:
            raise here.error(value.at, f"`String` has no argument {key}.")
        if arg.type.name != _TEXT[key] or arg.dims:
            raise here.error(value.at, f"the argument {key} of `String` must be of type {_TEXT[key]}, not {arg.type}.")
    variability = max(arg.variability for arg in args)
    is_literal = args[0].type.name == "enumeration"
    text = _literal_name(args[0]) if is_literal else e.Text(args[0].x)
    if x.named and variability <= PARAMETER:
        values = [here.context.known(x) for x in (text if is_literal else args[0].x, *(arg.x for arg in args[1:]))]
        if not any(value is None for value in values):
            for arg in args:
                here.context.select(arg.x)
            return constant(_formatted(values[0], dict(zip([key for key, _ in x.named], values[1:], strict=True))))
    return Typed(text, STRING, (), variability)


def _formatted(value: Any, options: dict[str, Any]) -> str:
    """A number as a text, with the options of `String` (section 3.7.1.2)."""
    if "format" in options:
        found = f"%{options['format']}" % value
    elif isinstance(value, bool):
        found = str(value).lower()
    elif isinstance(value, float):
        found = f"{value:.{options.get('significantDigits', 6)}g}"
    else:
        found = str(value)
    width = options.get("minimumLength", 0)
    return found.ljust(width) if options.get("leftJustified", True) else found.rjust(width)


def _text_of_record(here: "Expressions", x: t.Call, arg: Typed) -> Typed:
    """The operator 'String' of an operator record."""
    from . import calls

    assert arg.type.instance is not None
    return calls.fitting(here, calls.operators(arg.type.instance, "'String'"), f"operator 'String' of {arg.type}", x)


def _literal_name(arg: Typed) -> e.Expression:
    """The name of a literal as a text."""
    instance = arg.type.instance
    names = (instance.literals if instance else None) or ("",)
    branches = tuple((e.Binary("Eq", arg.x, e.Const(i + 1)), e.Const(name)) for i, name in enumerate(names[:-1]))
    return e.If(branches, e.Const(names[-1])) if branches else e.Const(names[-1])


def _clock(here: "Expressions", name: str, x: t.Call, args: Args) -> Typed:
    is_event = bool(args) and args[0].type == BOOLEAN
    return _made("eventClock" if is_event else name, args, CLOCK, (), 2)


def _clocked(here: "Expressions", name: str, x: t.Call, args: Args) -> Typed:
    """Operators of clocked partitions whose value has the type of their first argument."""
    return _made(name, args, args[0].type, args[0].dims, 2)


def _tick(here: "Expressions", name: str, x: t.Call, args: Args) -> Typed:
    return _made(name, args, BOOLEAN if name == "firstTick" else REAL, (), 2)


def _stream(here: "Expressions", name: str, x: t.Call, args: Args) -> Typed:
    """`inStream` and `actualStream`, which `streams.py` replaces."""
    ref = x.args[0]
    found = references.find(here, ref) if isinstance(ref, t.Reference) else None
    if not isinstance(found, references.Chain) or found.last.connection != "stream":
        raise here.error(x.at, f"`{name}` needs a stream variable.")
    streams = here.context.streams
    if streams is None:
        raise here.error(x.at, f"`{name}` is not allowed where the structure of the model depends on it.")
    value = streams.inside if name == "inStream" else streams.actual

    def of(item: e.Expression) -> e.Expression:
        if not isinstance(item, e.Ref):
            raise here.error(x.at, f"`{name}` needs a stream variable.")
        return value(item)

    return Typed(written_out(args[0].dims, lambda subs: of(element(args[0].x, subs))), REAL, args[0].dims)


def _cardinality(here: "Expressions", name: str, x: t.Call, args: Args) -> Typed:
    """The number of connections of a connector (section 3.7.4.3, deprecated)."""
    connections = here.context.connections
    if not here.in_condition:
        raise here.error(x.at, "`cardinality` is allowed in conditions of `if` and in assertions only.")
    if connections is None or not isinstance(args[0].x, e.Ref):
        raise here.error(x.at, "`cardinality` needs a connector.")
    return constant(connections.counts.get(args[0].x.name, 0))


def _instance_name(here: "Expressions", name: str, x: t.Call, args: Args) -> Typed:
    root = here.scope.top.root
    own = here.scope.whole.path
    return constant(f"{root.name if root else ''}{'.' if own else ''}{own}")


def _rooted(here: "Expressions", name: str, x: t.Call, args: Args) -> Typed:
    """`Connections.isRoot` and `Connections.rooted` (section 9.4)."""
    graph = here.context.graph
    if graph is None or not isinstance(args[0].x, e.Ref):
        raise here.error(x.at, f"`{name}` is not allowed here: connections depend on it, or its argument is no record.")
    return constant((graph.is_root if name == "isRoot" else graph.is_rooted)(args[0].x.name))


def _array(here: "Expressions", name: str, x: t.Call, args: Args) -> Typed:
    return here.array([(arg, x.at) for arg in args])


def _refused(here: "Expressions", name: str, x: t.Call, args: Args) -> Typed:
    raise here.error(x.at, f"`{name}` is not supported.")


FUNCTIONS: dict[str, tuple[int, int, _Handler]] = {
    **dict.fromkeys(_REAL, (1, 1, _real)),
    **dict.fromkeys(("atan2", "div", "mod", "rem"), (2, 2, _of_two)),
    **dict.fromkeys(("integer", "floor", "ceil", "sign"), (1, 1, _rounded)),
    "abs": (1, 1, _same), "noEvent": (1, 1, _same), "Integer": (1, 1, _integer_of),
    "max": (1, 2, _extreme), "min": (1, 2, _extreme), "sum": (1, 1, _total), "product": (1, 1, _total),
    "size": (1, 2, _refused), "ndims": (1, 1, _ndims), "fill": (2, 99, _filled), "zeros": (1, 99, _filled),
    "ones": (1, 99, _filled), "identity": (1, 1, _square), "diagonal": (1, 1, _square), "linspace": (3, 3, _linspace),
    "transpose": (1, 1, _transposed), "outerProduct": (2, 2, _outer), "symmetric": (1, 1, _symmetric),
    "cross": (2, 2, _three), "skew": (1, 1, _three), "scalar": (1, 1, _reshaped), "vector": (1, 1, _reshaped),
    "matrix": (1, 1, _reshaped), "array": (1, 9999, _array), "cat": (2, 999, _cat), "der": (1, 1, _derivative),
    "pre": (1, 1, _previous),
    "edge": (1, 1, _previous), "change": (1, 1, _previous), "previous": (1, 1, _previous), "initial": (0, 0, _truth),
    "terminal": (0, 0, _truth), "sample": (1, 2, _sample), "smooth": (2, 2, _smooth), "homotopy": (2, 2, _homotopy),
    "semiLinear": (3, 3, _semilinear), "delay": (2, 3, _delay), "String": (1, 9, _text), "Clock": (0, 3, _clock),
    **dict.fromkeys(("hold", "noClock", "subSample", "superSample", "shiftSample", "backSample"), (1, 3, _clocked)),
    "interval": (0, 1, _tick), "firstTick": (0, 1, _tick), "inStream": (1, 1, _stream), "actualStream": (1, 1, _stream),
    "cardinality": (1, 1, _cardinality), "getInstanceName": (0, 0, _instance_name), "pure": (1, 1, _same),
    "spatialDistribution": (4, 6, _refused), "rooted": (1, 1, _rooted), "transition": (2, 6, _refused),
    "isRoot": (1, 1, _rooted), "initialState": (1, 1, _refused), "activeState": (1, 1, _refused),
    "ticksInState": (0, 0, _refused),
    "timeInState": (0, 0, _refused), "promote": (2, 2, _promoted),
}  # fmt: skip


def reduction(here: "Expressions", x: t.Reduction) -> Typed:
    """An array with iterators, or its sum, product, least or greatest element (sections 10.3.4.1 and 10.4.1)."""
    name = str(x.function)
    if name not in ("array", "sum", "product", "min", "max"):
        raise here.error(x.at, f"{x.function} cannot reduce an array; only sum, product, min and max can.")
    if len(x.iterators) > 1 and name != "array":
        # The ranges of the iterators may depend on those behind them.
        inner = t.Reduction(x.function, x.body, x.iterators[:-1], at=x.at)
        return reduction(here, t.Reduction(x.function, inner, x.iterators[-1:], at=x.at))
    found = _comprehension(here, x)
    if name == "array":
        return found
    if name in ("sum", "product") and not found.type.is_numeric and found.type.name not in ("record", "any"):
        raise here.error(x.at, f"`{name}` needs numbers, not values of type {found.type}.")
    rank = len(found.dims) - 1
    if (name != "sum" and rank) or (name in ("min", "max") and found.type == STRING):
        raise here.error(x.at, f"`{name}` needs scalars, not values of type {found.type} with {rank} dimensions.")
    if found.type.name == "record":
        return _record_total(here, name, t.Call(x.function, (x.body,), (), at=x.at), found)
    if name in ("min", "max"):
        return _extreme(here, name, t.Call(x.function, (x.body,), (), at=x.at), [found])
    if not rank:
        return _made(name, [found], REAL if found.type == ANY else found.type)
    if 0 in found.dims and None not in found.dims:
        return _made("zeros", [constant(n or 0) for n in found.dims[1:]], found.type, found.dims[1:], CONSTANT)
    return _made(name, [found, constant(1)], found.type, found.dims[1:])


def _comprehension(here: "Expressions", x: t.Reduction) -> Typed:
    """`{body for i in ..., j in ...}`: the last iterator is the outermost dimension."""
    (*inner, last) = x.iterators
    body: t.Expression = t.Reduction(x.function, x.body, tuple(inner), at=x.at) if inner else x.body
    whole, values = here.iterations(last, (x.body,))
    is_function = here.scope.whole.is_function

    def of(names: dict[str, Typed]) -> tuple[Typed, int]:
        within = here.knowing(names)
        made = _comprehension(within, body) if inner and isinstance(body, t.Reduction) else within.single(body)
        return made, x.body.at

    if values is not None and not (is_function and len(values) > 20):
        if not values:
            kind, _ = of({last.name: Typed(e.Ref(last.name), whole.type, (), CONSTANT)})
            return Typed(e.ArrayOf(()), kind.type, (0, *kind.dims), CONSTANT)
        return here.array([of({last.name: value}) for value in values])
    made, _ = of({last.name: Typed(e.Ref(last.name), whole.type, (), whole.variability)})
    return Typed(
        e.Comprehension(made.x, ((last.name, whole.x),)), made.type, (*whole.dims, *made.dims),
        max(made.variability, whole.variability),
    )  # fmt: skip
