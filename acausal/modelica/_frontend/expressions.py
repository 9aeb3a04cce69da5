"""Expressions (Modelica 3.6, chapters 3 and 10): from the tree to the flat model, with types and sizes."""

import contextlib
import dataclasses
import itertools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from .._syntax import expressions as e
from .._syntax.visits import nodes
from .._translate.scope import NotKnown
from . import builtins, calls, operator_records, references, restrictions
from . import tree as t
from .classes import ClassElement, ComponentElement, Instance
from .operators import binary, unary
from .source import TextError
from .typed import (
    ANY,
    BOOLEAN,
    CONSTANT,
    INTEGER,
    NONE,
    PARAMETER,
    REAL,
    Dims,
    Type,
    Typed,
    accepts,
    common,
    constant,
    element,
    joined_dims,
    same_dims,
    written_dims,
)  # fmt: skip

if TYPE_CHECKING:
    from .structure import Context

_LONGEST = 1e7  # ranges
_TIME = Typed(e.Ref("time"), REAL)


@dataclasses.dataclass(eq=False)
class Expressions:
    """Makes expressions in a class instance. `names` are the values of iterators, and of the inputs of a function
    where its expressions are evaluated outside of it.
    """

    context: "Context"
    scope: Instance
    names: Mapping[str, Typed] = dataclasses.field(default_factory=dict)
    at: int = 0
    in_condition: bool = False  # of `if` or an assertion
    in_when: bool = False  # the body of a when-clause
    in_branch: bool = False  # which may never be evaluated
    at_start: bool = False  # an initial section, or the value of a parameter
    ends: list[Typed] = dataclasses.field(default_factory=list)  # values of `end` in the subscripts around

    def error(self, at: int, message: str) -> TextError:
        return self.scope.source.error(at, message)

    def knowing(self, names: Mapping[str, Typed]) -> "Expressions":
        """With further iterators."""
        return dataclasses.replace(self, names={**self.names, **names})

    def within_when(self) -> "Expressions":
        return dataclasses.replace(self, in_when=True)

    def expression(self, x: t.Expression) -> e.Expression:
        return self.typed(x).x

    def typed(self, x: t.Expression) -> Typed:
        """The expression in the flat model. Raises `TextError`."""
        return _BY_CLASS[type(x)](self, x)

    def single(self, x: t.Expression) -> Typed:
        """An expression of which the first result is used, if it is a call of a function with several."""
        found = self.typed(x)
        if found.type == NONE:
            raise self.error(x.at, "this call has no value.")
        if found.type.name == "function":
            raise self.error(x.at, "a function is no value.")
        return found

    def boolean(self, x: t.Expression, what: str) -> Typed:
        """A Boolean scalar."""
        outer, self.in_condition = self.in_condition, True
        try:
            found = self.single(x)
        finally:
            self.in_condition = outer
        if found.type != BOOLEAN or found.dims:
            raise self.error(x.at, f"{what} must be a Boolean scalar, not of type {found.type}.")
        return found

    def choice(self, x: t.IfClause) -> tuple[list[Typed], t.Clauses | None]:
        """The conditions of an if-clause, and the branch that parameters choose; None if conditions vary, or are not
        known.
        """
        conditions = [self.boolean(condition, "the condition of `if`") for condition, _ in x.branches]
        for condition, (_, body) in zip(conditions, x.branches, strict=True):
            truth = self.context.known(condition.x) if condition.variability <= PARAMETER else None
            if truth is None:
                return conditions, None
            self.context.select(condition.x)
            if truth:
                return conditions, body
        return conditions, x.otherwise

    def known(self, x: t.Expression, what: str) -> Any:
        """The value of an expression that must be known when the model is flattened."""
        return self.needed(self.single(x), x.at, what)

    def needed(self, value: Typed, at: int, what: str) -> Any:
        try:
            return self.context.value(value.x)
        except NotKnown as missing:
            raise self.error(at, f"{what} needs a value that is not known: {missing}.") from None

    def _literal(self, x: t.Literal) -> Typed:
        value = x.value
        if isinstance(value, str) and value.startswith("modelica://"):
            return constant(self.context.top.libraries.resource(value))
        return constant(value)

    # References and subscripts

    def reference(self, ref: t.Reference) -> Typed:
        self.at = ref.at
        first = ref.parts[0]
        if not ref.is_global and first.name in self.names:
            return self._iterator(ref)
        if first.name == "time" and not ref.is_global and self.scope.find("time") is None:
            if len(ref.parts) > 1 or first.subs:
                raise self.error(ref.at, "`time` is a scalar.")
            if not restrictions.has_time(self.scope):
                raise self.error(
                    ref.at, f"`time` is allowed in models and blocks, not in the {self.scope.kind} {self.scope.name}."
                )
            return _TIME
        found = references.find(self, ref)
        if isinstance(found, Typed):
            return found
        if isinstance(found, ClassElement):
            raise self.error(ref.at, f"{ref} is a {found.instance.kind}, and no value.")
        return references.typed(self, found, ref.at)

    def _iterator(self, ref: t.Reference) -> Typed:
        found = self.names[ref.parts[0].name]
        for i, part in enumerate(ref.parts):
            if i:
                record, found = found, self.context.field(found, part.name) if found.type.name == "record" else None
                if found is None:
                    raise self.error(part.at, f"a value of type {record.type} has no field {part.name}.")
            if part.subs:
                subs, rest = self.subscripts(part, found.dims, found.x)
                found = found._replace(x=element(found.x, subs), dims=tuple(rest))
        return found

    def subscripts(
        self, part: t.Part, dims: Dims, base: e.Expression, component: ComponentElement | None = None
    ) -> tuple[tuple[e.Expression, ...], list[int | None]]:
        """The subscripts of an array of some size, and the size of the result. Known ones are numbers. `component`
        is the array, if it has a name.
        """
        if len(part.subs) > len(dims):
            raise self.error(part.at, f"{part.name} has {len(dims)} dimensions, but {len(part.subs)} subscripts.")
        found: list[e.Expression] = []
        rest: list[int | None] = []
        for i, (sub, size) in enumerate(zip(part.subs, dims, strict=False)):
            if isinstance(sub, t.Whole):
                found.append(e.Colon())
                rest.append(size)
                continue
            every = None if component is None else self.context.index_range(component, i)
            end = None if size is None else constant(size) if every is None else every[1][-1]
            value = self._subscript(sub, end or Typed(e.Builtin("Size", (base, e.Const(i + 1))), INTEGER))
            wanted = INTEGER if every is None else every[0].type
            if component is not None and not accepts(wanted, value.type):
                raise self.error(sub.at, f"{part.name} has subscripts of type {wanted}, not {value.type}.")
            self._check_bounds(value.x, size, sub.at)
            found.append(value.x)
            rest += value.dims
        return tuple(found), [*rest, *dims[len(part.subs) :]]

    def members(self, subs: Sequence[e.Expression], sizes: Sequence[int]) -> list[Sequence[int] | None]:
        """The indices that subscripts choose in each dimension of an array; None for a single index that varies."""
        found: list[Sequence[int] | None] = []
        for sub, size in itertools.zip_longest(subs, sizes):
            if sub is None or isinstance(sub, e.Colon):
                found.append(range(1, size + 1))
            elif isinstance(sub, e.Const):
                found.append([int(sub.value)])
            else:
                value = self.context.known(sub)
                found.append(None if value is None or np.ndim(value) == 0 else [int(i) for i in value])
        return found

    def _subscript(self, sub: t.Expression, end: Typed) -> Typed:
        self.ends.append(end)
        try:
            value = self.single(sub)
        finally:
            self.ends.pop()
        if len(value.dims) > 1 or value.type.name not in ("Integer", "Boolean", "enumeration", "any"):
            raise self.error(sub.at, f"a subscript must be an Integer or a vector of them, not of type {value.type}.")
        if value.variability <= PARAMETER and not isinstance(value.x, e.Const):
            value = self._evaluated(value)
        if value.type == BOOLEAN and not isinstance(value.x, e.Const):
            value = value._replace(x=e.If(((value.x, e.Const(2)),), e.Const(1)))
        elif value.type == BOOLEAN and isinstance(value.x, e.Const):
            value = value._replace(x=e.Const(1 + int(bool(value.x.value))))
        return value

    def _evaluated(self, value: Typed) -> Typed:
        """A subscript as a number, if it is known."""
        number = self.context.known(value.x)
        if number is None:
            return value
        if value.dims:
            items = tuple(e.Const(int(i)) for i in number)
            return value._replace(x=e.ArrayOf(items), dims=(len(items),))
        self.context.select(value.x)
        return value._replace(x=e.Const(bool(number) if value.type == BOOLEAN else int(number)))

    def _check_bounds(self, x: e.Expression, size: int | None, at: int) -> None:
        for item in x.elements if isinstance(x, e.ArrayOf) else (x,):
            if isinstance(item, e.Const) and size is not None and not 1 <= int(item.value) <= size:
                raise self.error(at, f"the subscript {item.value} is out of bounds: the size is {size}.")

    def end(self, x: t.End) -> Typed:
        if not self.ends:
            raise self.error(x.at, "`end` is allowed in subscripts only.")
        return self.ends[-1]

    # Operators

    def _unary(self, x: t.Unary) -> Typed:
        arg = self.single(x.arg)
        if arg.type.name == "record":
            return operator_records.unary(self, x, arg)
        return unary(x.op, arg, lambda message: self.error(x.at, message))

    def _binary(self, x: t.Binary) -> Typed:
        left, right = self.single(x.left), self.single(x.right)
        if "record" in (left.type.name, right.type.name):
            return operator_records.binary(self, x, left, right)
        if x.op in ("/", "./") and isinstance(x.right, t.Literal) and not x.right.value and not self.in_branch:
            raise self.error(x.at, "a division by zero.")
        found = binary(x.op, left, right, lambda message: self.error(x.at, message))
        if x.op == "*" and (_is_actual_stream(x.left) or _is_actual_stream(x.right)):
            # The product with the flow has no discontinuity where the flow reverses (section 15.3).
            return found._replace(x=e.Builtin("Smooth", (e.Const(0), found.x)))
        return found

    def _if(self, x: t.IfExpression) -> Typed:
        conditions = [self.boolean(condition, "the condition of an if-expression") for condition, _ in x.branches]
        if all(condition.variability == CONSTANT for condition in conditions):
            chosen = self._chosen(x, conditions)
            if chosen is not None:
                return self.single(chosen)
        try:
            return self._alternatives(x, conditions)
        except TextError:
            # A branch that parameters exclude may name components that are absent, or have another size.
            chosen = self._chosen(x, conditions)
            if chosen is None:
                raise
            for condition in conditions:
                self.context.select(condition.x)
            return self.single(chosen)

    def _chosen(self, x: t.IfExpression, conditions: Sequence[Typed]) -> t.Expression | None:
        """The branch that the conditions choose, if they are known."""
        for condition, (_, value) in zip(conditions, x.branches, strict=True):
            truth = self.context.known(condition.x) if condition.variability <= PARAMETER else None
            if truth is None:
                return None
            if truth:
                return value
        return x.otherwise

    def _alternatives(self, x: t.IfExpression, conditions: Sequence[Typed]) -> Typed:
        inside = dataclasses.replace(self, in_branch=True)
        values = [inside.single(value) for _, value in x.branches]
        otherwise = inside.single(x.otherwise)
        branches = [(otherwise, x.otherwise.at), *zip(values, (text.at for _, text in x.branches), strict=True)]
        kind, dims = self.unified("branches", branches)
        variability = max(one.variability for one in (*conditions, *values, otherwise))
        branches = tuple((c.x, v.x) for c, v in zip(conditions, values, strict=True))
        return Typed(e.If(branches, otherwise.x), kind, dims, variability)

    def _array(self, x: t.Array) -> Typed:
        if not x.elements:
            return Typed(e.ArrayOf(()), ANY, (0,), CONSTANT)
        return self.array([(self.single(item), item.at) for item in x.elements])

    def array(self, items: Sequence[tuple[Typed, int]]) -> Typed:
        """An array constructor of elements of one type and size."""
        kind, dims = self.unified("elements", items)
        variability = max(item.variability for item, _ in items)
        return Typed(e.ArrayOf(tuple(item.x for item, _ in items)), kind, (len(items), *dims), variability)

    def unified(self, what: str, items: Sequence[tuple[Typed, int]]) -> tuple[Type, Dims]:
        """The type and size of values that must have the same. Branches of a function may differ in size."""
        (first, _), *others = items
        kind, dims = first.type, first.dims
        for item, at in others:
            both = common(kind, item.type)
            if both is None:
                raise self.error(at, f"the {what} have different types: {kind} and {item.type}.")
            kind = both
            if same_dims(dims, item.dims):
                dims = joined_dims(dims, item.dims)
            elif what == "branches" and self.scope.whole.is_function and len(dims) == len(item.dims):
                dims = tuple(a if a == b else None for a, b in zip(dims, item.dims, strict=True))
            else:
                raise self.error(
                    at, f"the {what} have different sizes: {written_dims(dims)} and {written_dims(item.dims)}."
                )
        return kind, dims

    def _matrix(self, x: t.Matrix) -> Typed:
        if len(x.rows) == 1 and len(x.rows[0]) == 1:
            only = self.single(x.rows[0][0])
            if len(only.dims) >= 2:
                return only
        rows = [self._row(row) for row in x.rows]
        width = rows[0][0].dims[1]
        for row, at in rows[1:]:
            if not same_dims((width,), row.dims[1:2]):
                raise self.error(at, f"the rows of the matrix have different sizes: {width} and {row.dims[1]}.")
        return builtins.concatenated(self, "elements of the matrix", [row for row, _ in rows], 0, x.at)

    def _row(self, row: Sequence[t.Expression]) -> tuple[Typed, int]:
        parts = []
        for item in row:
            value = self.single(item)
            if len(value.dims) > 2:
                raise self.error(item.at, "a matrix has elements of two dimensions at most.")
            x = value.x
            if not value.dims:
                x = e.ArrayOf((e.ArrayOf((x,)),))
            elif len(value.dims) == 1 and isinstance(x, e.ArrayOf):
                x = e.ArrayOf(tuple(e.ArrayOf((one,)) for one in x.elements))
            elif len(value.dims) == 1:
                x = e.Builtin("Matrix", (x,))
            parts.append(value._replace(x=x, dims=(*value.dims, *[1] * (2 - len(value.dims)))))
        heights = {part.dims[0] for part in parts} - {None}
        if len(heights) > 1:
            raise self.error(row[0].at, f"the elements of a row have different heights: {sorted(map(str, heights))}.")
        return builtins.concatenated(self, "elements of the matrix", parts, 1, row[0].at), row[0].at

    def _range(self, x: t.Range) -> Typed:
        start, stop = self.single(x.start), self.single(x.stop)
        step = None if x.step is None else self.single(x.step)
        for part in (start, stop, *([step] if step else [])):
            if part.dims or part.type.name not in ("Integer", "Real", "Boolean", "enumeration"):
                raise self.error(x.at, f"the ends of a range must be scalars, not of type {part.type}.")
        kind = common(start.type, stop.type)
        if step is not None and not (kind is not None and kind.is_numeric and step.type.is_numeric):
            raise self.error(x.at, f"a range of {start.type} with a step of {step.type}; only numbers have steps.")
        if kind is None:
            raise self.error(x.at, f"the ends of the range have different types: {start.type} and {stop.type}.")
        if step is not None and step.type == REAL:
            kind = REAL
        if step is not None and isinstance(step.x, e.Const) and not step.x.value:
            raise self.error(x.at, "the step of the range is 0.")
        variability = max(start.variability, stop.variability, step.variability if step else 0)
        if kind == BOOLEAN:
            return self._truths(start, stop, variability)
        found = e.RangeOf(start.x, None if step is None else step.x, stop.x)
        count: int | None = None
        if variability <= PARAMETER:
            with contextlib.suppress(NotKnown):
                count = self._count(x, start, step, stop)
                if variability == PARAMETER:
                    self.context.select(found)
        return Typed(found, kind, (count,), variability)

    def _count(self, x: t.Range, start: Typed, step: Typed | None, stop: Typed) -> int:
        """The number of values of a range. Raises `NotKnown`."""
        first, last = self.context.value(start.x), self.context.value(stop.x)
        width = 1 if step is None else self.context.value(step.x)
        if not width or abs((last - first) / width) > _LONGEST:
            raise self.error(x.at, f"the step {width} of the range from {first} to {last} is too small.")
        return max(math.floor((last - first) / width + 1e-9) + 1, 0)

    def _truths(self, start: Typed, stop: Typed, variability: int) -> Typed:
        first, last = bool(self.context.value(start.x)), bool(self.context.value(stop.x))
        items = tuple(e.Const(value) for value in (False, True) if first <= value <= last)
        return Typed(e.ArrayOf(items), BOOLEAN, (len(items),), variability)

    def _tuple(self, x: t.Tuple) -> Typed:
        parts = [None if item is None else self.single(item) for item in x.elements]
        found = e.TupleOf(tuple(None if part is None else part.x for part in parts))
        blank = Typed(e.Colon(), ANY)
        return Typed(found, NONE, (), 3, tuple(part or blank for part in parts))

    def _subscripted(self, x: t.Subscripted) -> Typed:
        base = self.single(x.base)
        part = t.Part("the expression", x.subs, at=x.at)
        subs, rest = self.subscripts(part, base.dims, base.x)
        return base._replace(x=element(base.x, subs), dims=tuple(rest))

    def _call(self, x: t.Call) -> Typed:
        self.at = x.at
        ref = x.function
        names = ref.names
        if names[0] == "Connections" and names[-1] in ("isRoot", "rooted"):
            return builtins.call(self, names[-1], x)
        if len(names) == 1 and names[0] in builtins.FUNCTIONS and not self._is_declared(ref):
            return builtins.call(self, names[0], x)
        return calls.call(self, x)

    def _is_declared(self, ref: t.Reference) -> bool:
        """Whether the model declares a function with the name of a predefined one."""
        name = ref.parts[0].name
        found = self.scope.top.find(name) if ref.is_global else self.scope.find(name)
        return found is not None and found is not self.scope.top.predefined(name)

    def _refused(self, x: t.Expression) -> Typed:
        if isinstance(x, t.Whole):
            raise self.error(x.at, "`:` is allowed in subscripts only.")
        raise self.error(x.at, "a function is allowed as an argument of a function only.")

    # Iterators

    def unrolled(self, iterators: Sequence[t.Iterator], body: Sequence[t.Clause]) -> "Iterator[Expressions]":
        """The same with each combination of values of the iterators of a loop. Raises `TextError`."""
        if not iterators:
            yield self
            return
        first, *rest = iterators
        _, values = self.iterations(first, (tuple(body),))
        if values is None:
            raise self.error(first.at, f"the range of {first.name} is not known.")
        for value in values:
            yield from self.knowing({first.name: value}).unrolled(rest, body)

    def iterations(self, x: t.Iterator, uses: Sequence[Any] = ()) -> tuple[Typed, list[Typed] | None]:
        """The range of an iterator, and its values if they are known. `uses` are where its name occurs."""
        if x.range is None:
            return self._implied(x, uses)
        if isinstance(x.range, t.Reference):
            found = self.range_of_type(x.range)
            if found is not None:
                return found
        found = self.single(x.range)
        if len(found.dims) != 1:
            raise self.error(x.range.at, f"the range of {x.name} must be a vector, not {written_dims(found.dims)}.")
        kind = found.type
        if isinstance(found.x, e.ArrayOf):
            items = [Typed(item, kind, (), found.variability) for item in found.x.elements]
            return found, items
        values = self.context.known(found.x) if found.variability <= PARAMETER else None
        if values is None:
            return found, None
        self.context.select(found.x)
        return found._replace(dims=(len(values),)), [self.value_as(kind, value) for value in values]

    def value_as(self, kind: Type, value: Any) -> Typed:
        """A value of a plain type as a literal."""
        if kind.name == "enumeration" and kind.instance is not None:
            return references.literal(self, kind.instance, int(value))
        return constant({"Boolean": bool, "Real": float, "String": str}.get(kind.name, int)(value))

    def range_of_type(self, ref: t.Reference) -> tuple[Typed, list[Typed]] | None:
        """The values of an enumeration, or of Boolean, as a range."""
        found = None if ref.parts[0].name in self.names else references.find(self, ref)
        if not isinstance(found, ClassElement):
            return None
        if found.instance.builtin == "Boolean":
            items = [constant(False), constant(True)]
            return Typed(e.ArrayOf((e.Const(False), e.Const(True))), BOOLEAN, (2,), CONSTANT), items
        literals = found.instance.literals
        if literals is None:
            raise self.error(ref.at, f"{ref} is no enumeration, and no range.")
        items = [references.literal(self, found.instance, i + 1) for i in range(len(literals))]
        whole = e.RangeOf(e.Const(1), None, e.Const(len(literals)))
        return Typed(whole, items[0].type, (len(items),), CONSTANT), items

    def _implied(self, x: t.Iterator, uses: Sequence[Any]) -> tuple[Typed, list[Typed] | None]:
        """The range of an iterator from the size of the arrays that it indexes (section 11.2.2.2)."""
        sizes: dict[int, str] = {}
        for ref, part, position in _indexed_by(uses, x.name):
            chain = references.find(self, t.Reference(ref.parts[: part + 1], ref.is_global, at=ref.at))
            if isinstance(chain, references.Chain) and (size := self.context.sizes(chain.last)[position]) is not None:
                sizes[size] = str(ref)
        if len(sizes) > 1:
            raise self.error(
                x.at, f"the range of {x.name} differs: {' and '.join(sizes.values())} have different sizes."
            )
        for ref, part, position in _indexed_by(uses, x.name):
            found = references.find(self, t.Reference(ref.parts[: part + 1], ref.is_global, at=ref.at))
            if isinstance(found, references.Chain):
                size = self.context.sizes(found.last)[position]
                every = self.context.index_range(found.last, position)
                if every is not None:
                    return every
                if size is not None:
                    whole = e.RangeOf(e.Const(1), None, e.Const(size))
                    values = [constant(i + 1) for i in range(size)]
                    return Typed(whole, INTEGER, (size,), CONSTANT), values
                name = e.Ref(".".join(one.name for one in found.components))
                stop = e.Builtin("Size", (name, e.Const(position + 1)))
                return Typed(e.RangeOf(e.Const(1), None, stop), INTEGER, (None,)), None
        raise self.error(x.at, f"the range of {x.name} is not given, and no array has it as a subscript.")


def _indexed_by(uses: Any, name: str) -> Iterator[tuple[t.Reference, int, int]]:
    """The references with a subscript that is a name, the number of the part, and of the subscript."""
    for ref in nodes(uses):
        for i, part in enumerate(ref.parts if isinstance(ref, t.Reference) else ()):
            for j, sub in enumerate(part.subs):
                if isinstance(sub, t.Reference) and sub.names == (name,):
                    yield ref, i, j


def _is_actual_stream(x: t.Expression) -> bool:
    return isinstance(x, t.Call) and x.function.names == ("actualStream",)


_BY_CLASS: dict[type, Callable[[Expressions, Any], Typed]] = {
    t.Literal: Expressions._literal,
    t.Reference: Expressions.reference,
    t.Call: Expressions._call,
    t.Reduction: builtins.reduction,
    t.Unary: Expressions._unary,
    t.Binary: Expressions._binary,
    t.IfExpression: Expressions._if,
    t.Array: Expressions._array,
    t.Matrix: Expressions._matrix,
    t.Range: Expressions._range,
    t.Tuple: Expressions._tuple,
    t.Subscripted: Expressions._subscripted,
    t.End: Expressions.end,
    t.Whole: Expressions._refused,
    t.PartialCall: Expressions._refused,
    t.NoValue: Expressions._refused,
}
