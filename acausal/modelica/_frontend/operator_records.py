"""Overloaded operators (Modelica 3.6, chapter 14)."""

import math
from typing import TYPE_CHECKING

from .._syntax import expressions as e
from . import calls
from . import tree as t
from .classes import Instance
from .typed import Typed, element, indices, nested, same_dims

if TYPE_CHECKING:
    from .expressions import Expressions


def unary(here: "Expressions", x: t.Unary, arg: Typed) -> Typed:
    """`-a` or `not a` of an operator record."""
    if x.op == "+":
        return arg
    name = f"'{x.op.removeprefix('.')}'"
    found = _elementwise(here, name, [arg])
    if found is None:
        raise here.error(x.at, f"{arg.type} has no operator {name} for this value.")
    return found


def binary(here: "Expressions", x: t.Binary, left: Typed, right: Typed) -> Typed:
    """`a op b`, where one is an operator record (section 14.4)."""
    name = f"'{x.op.removeprefix('.')}'"
    found = _elementwise(here, name, [left, right])
    if found is None and x.op == "*" and left.dims and right.dims:
        found = _matrix_product(here, x, left, right)
    if found is None:
        raise here.error(x.at, f"there is no operator {name} for values of type {left.type} and {right.type}.")
    return found


def _elementwise(here: "Expressions", name: str, args: list[Typed]) -> Typed | None:
    found = _scalar(here, name, args)
    if found is not None:
        return found
    dims = max((arg.dims for arg in args), key=len)
    if not dims or None in dims or any(arg.dims and not same_dims(arg.dims, dims) for arg in args):
        return None
    if name in ("'*'", "'/'", "'^'") and all(arg.dims for arg in args):
        return None
    sizes = [n or 0 for n in dims]
    items: list[Typed] = []
    # Of empty arrays, one element is made for its type.
    for index in list(indices(sizes)) or [(1,) * len(sizes)]:
        subs = [e.Const(i) for i in index]
        scalars = [arg._replace(x=element(arg.x, subs), dims=()) if arg.dims else arg for arg in args]
        item = _scalar(here, name, scalars)
        if item is None:
            return None
        items.append(item)
    count = math.prod(sizes)
    return items[0]._replace(x=nested([item.x for item in items[:count]], sizes), dims=dims)


def _scalar(here: "Expressions", name: str, args: list[Typed]) -> Typed | None:
    """The operator of these values, directly or after a conversion of one of them."""
    records = _records(args)
    functions = {function.tree: function for record in records for function in calls.operators(record, name)}
    calls_found = [
        call for function in functions.values() if (call := calls.call_values(here, function, args)) is not None
    ]
    if len(calls_found) > 1:
        raise here.error(here.at, f"several functions of the operator {name} fit these values.")
    if calls_found:
        return calls_found[0]
    for record in records:
        kind = next(arg.type for arg in args if arg.type.instance is record)
        for i, arg in enumerate(args):
            converted = None if arg.type.name == "record" else calls.as_type(here, kind, arg)
            if converted is not None:
                changed = [converted if j == i else one for j, one in enumerate(args)]
                for function in calls.operators(record, name):
                    found = calls.call_values(here, function, changed)
                    if found is not None:
                        return found
    return None


def _records(args: list[Typed]) -> list[Instance]:
    found = [arg.type.instance for arg in args if arg.type.name == "record" and arg.type.instance is not None]
    return list({id(one.tree): one for one in found}.values())


def _matrix_product(here: "Expressions", x: t.Binary, left: Typed, right: Typed) -> Typed | None:
    """The product of vectors or matrices of operator records, by sums of products."""
    if not left.dims or not right.dims or None in left.dims + right.dims or left.dims[-1] != right.dims[0]:
        return None
    rows, columns = left.dims[:-1], right.dims[1:]
    count = left.dims[-1] or 0
    if not count:
        return None
    items: list[Typed] = []
    for row in indices(rows):
        for column in indices(columns):
            total: Typed | None = None
            for k in range(1, count + 1):
                a = element(left.x, [e.Const(i) for i in (*row, k)])
                b = element(right.x, [e.Const(i) for i in (k, *column)])
                product = _scalar(here, "'*'", [left._replace(x=a, dims=()), right._replace(x=b, dims=())])
                if product is None:
                    return None
                total = product if total is None else _scalar(here, "'+'", [total, product])
                if total is None:
                    return None
            assert total is not None
            items.append(total)
    dims = (*rows, *columns)
    return items[0]._replace(x=nested([item.x for item in items], dims), dims=dims)
