"""Expressions of the flat model with their types, sizes and variability (Modelica 3.6, sections 3.8 and 6.7)."""

import dataclasses
import itertools
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple

from .._syntax import expressions as e

if TYPE_CHECKING:
    from .classes import Instance

Dims = tuple[int | None, ...]  # None for a size that is not known, as in a function
CONSTANT, PARAMETER, DISCRETE, CONTINUOUS = range(4)
VARIABILITY = {"constant": CONSTANT, "parameter": PARAMETER, "discrete": DISCRETE, "": CONTINUOUS}


@dataclasses.dataclass(frozen=True)
class Type:
    """A type: the name of a predefined one, or "enumeration", "record", "object" (external), "component", "function",
    "none" (no value) with the class.
    """

    name: str
    instance: "Instance | None" = dataclasses.field(default=None, compare=False)

    def __str__(self) -> str:
        return self.name if self.instance is None else f"{self.name} {self.instance.name}"

    @property
    def is_numeric(self) -> bool:
        return self.name in ("Real", "Integer")

    @property
    def is_plain(self) -> bool:
        """Whether values are numbers, truths, texts or literals."""
        return self.name in ("Real", "Integer", "Boolean", "String", "enumeration")


REAL, INTEGER, BOOLEAN, STRING, CLOCK = map(Type, ("Real", "Integer", "Boolean", "String", "Clock"))
NONE = Type("none")
ANY = Type("any")  # of an empty array


class Typed(NamedTuple):
    """An expression of the flat model, or several results of a function (`results`)."""

    x: e.Expression
    type: Type
    dims: Dims = ()
    variability: int = CONTINUOUS
    results: "tuple[Typed, ...]" = ()


def constant(value: e.Value) -> Typed:
    kind = {bool: BOOLEAN, int: INTEGER, float: REAL, str: STRING}[type(value)]
    return Typed(e.Const(value), kind, (), CONSTANT)


def same_dims(a: Dims, b: Dims) -> bool:
    """Whether sizes agree, as far as they are known."""
    return len(a) == len(b) and all(x is None or y is None or x == y for x, y in zip(a, b, strict=True))


def joined_dims(a: Dims, b: Dims) -> Dims:
    """Sizes of arrays that agree, from the one where they are known."""
    return tuple(y if x is None else x for x, y in zip(a, b, strict=True))


def accepts(wanted: Type, given: Type) -> bool:
    """Whether a value of a type can be assigned to a variable of another (Modelica 3.6, section 6.7)."""
    if "any" in (wanted.name, given.name) or (wanted.name == "Real" and given.name == "Integer"):
        return True
    if wanted.name != given.name:
        return False
    a, b = wanted.instance, given.instance
    if a is None or b is None or a.tree is b.tree:
        return True
    if wanted.name == "enumeration":
        return a.literals == b.literals
    if wanted.name == "record":
        own = {one.name: one for one in a.components()}
        other = {one.name: one for one in b.components()}
        return own.keys() == other.keys() and all(accepts(own[name].value_type, other[name].value_type) for name in own)
    return True


def limited(variability: int, kind: Type) -> int:
    """A variability as far as a type has it: values of discrete types change at events only."""
    return variability if kind.name in ("Real", "record", "any") else min(variability, DISCRETE)


def common(a: Type, b: Type) -> Type | None:
    """The type of an array, or of an if-expression, with elements of two types."""
    if accepts(a, b):
        return b if a.name == "any" else a
    return b if accepts(b, a) else None


def written_dims(dims: Dims) -> str:
    return "[" + ", ".join(":" if n is None else str(n) for n in dims) + "]" if dims else "a scalar"


def indices(dims: Sequence[int | None]) -> Iterator[tuple[int, ...]]:
    """All indices of an array, the last one fastest; none of one whose size is not known."""
    return itertools.product(*(range(1, (n or 0) + 1) for n in dims))


def nested(elements: Sequence[e.Expression], dims: Dims | list[int]) -> e.Expression:
    """An array constructor of elements in the order of `indices`."""
    if not dims:
        return elements[0]
    if len(dims) == 1:
        return e.ArrayOf(tuple(elements))
    rows = dims[0] or 0
    count = len(elements) // rows if rows else 0
    return e.ArrayOf(tuple(nested(elements[i * count : (i + 1) * count], dims[1:]) for i in range(rows)))


def written_out(dims: Dims, make: Callable[[list[e.Const]], e.Expression]) -> e.Expression:
    """An array constructor of some size, from its elements by their subscripts; of no size, the only element."""
    return nested([make([e.Const(i) for i in index]) for index in indices(dims)], dims)


def element(x: e.Expression, index: Sequence[e.Expression]) -> e.Expression:
    """An element of an array, simplified where the array is written out."""
    if not index:
        return x
    first = index[0]
    match x:
        case e.ArrayOf(elements) if isinstance(first, e.Const) and 1 <= int(first.value) <= len(elements):
            return element(elements[int(first.value) - 1], index[1:])
        case e.Ref(name, subs):
            changed = _indexed(subs, index)
            if changed is not None:
                return e.Ref(name, changed)
        case e.Unary(("Minus" | "Plus") as op, arg):
            return e.Unary(op, element(arg, index))
        case e.If(branches, otherwise):
            return e.If(tuple((c, element(v, index)) for c, v in branches), element(otherwise, index))
        case e.Builtin("Fill", (value, *sizes)) if len(index) <= len(sizes):
            rest = sizes[len(index) :]
            return e.Builtin("Fill", (value, *rest)) if rest else value
        case e.Builtin("Zeros", sizes) if len(index) == len(sizes):
            return e.Const(0.0)
    return e.Subscript(x, tuple(index))


def _indexed(subs: Sequence[e.Expression], index: Sequence[e.Expression]) -> tuple[e.Expression, ...] | None:
    """Subscripts with slices replaced by their elements at an index."""
    found: list[e.Expression] = []
    left = list(index)
    for sub in subs:
        if isinstance(sub, e.Const) or not left:
            found.append(sub)
        elif isinstance(sub, e.Colon):
            found.append(left.pop(0))
        elif isinstance(sub, e.ArrayOf) and isinstance(left[0], e.Const):
            found.append(sub.elements[int(left.pop(0).value) - 1])  # pyright: ignore[reportAttributeAccessIssue]
        elif isinstance(sub, e.RangeOf) and sub.step is None and isinstance(sub.start, e.Const):
            i = left.pop(0)
            if not isinstance(i, e.Const):
                return None
            found.append(e.Const(int(sub.start.value) + int(i.value) - 1))
        else:
            return None
    return (*found, *left)


def field(x: e.Expression, name: str, names: Sequence[str]) -> e.Expression:
    """A field of a record, simplified where the record is a variable or is written out. `names` are all its fields."""
    match x:
        case e.Ref(path, ()):
            return e.Ref(f"{path}.{name}")
        case e.FunctionCall(_, args, True) if name in names and len(args) == len(names):
            return args[list(names).index(name)]
        case e.ArrayOf(elements):
            return e.ArrayOf(tuple(field(item, name, names) for item in elements))
        case e.If(branches, otherwise):
            return e.If(tuple((c, field(v, name, names)) for c, v in branches), field(otherwise, name, names))
        case e.Subscript(e.ArrayOf() as base, subs):
            return e.Subscript(field(base, name, names), subs)
    return e.FieldOf(x, name)
