"""Terms of known values, and parts of terms."""

from typing import Any

import numpy as np

from ..._errors import ModelError
from .._syntax import expressions as e
from .subscripts import position
from .terms import Opaque, RecordOf
from .values import Value


def constant(value: Value, key: str) -> Any:
    """A known value as a term."""
    if isinstance(value, bool | int | float | str):
        return e.Const(value)
    if isinstance(value, np.ndarray):
        return Opaque(f"{value.dtype}{value.tolist()}", value)
    if isinstance(value, dict):
        return RecordOf(tuple((name, constant(item, f"{key}.{name}")) for name, item in value.items()))
    return Opaque(f"{key} {value!r}", value)


def field(term: Any, name: str) -> Any:
    """A field of a record, or of each record of an array."""
    if isinstance(term, RecordOf):
        for own, value in term.fields:
            if own == name:
                return value
        raise ModelError(f"the record has no field {name}.")
    if isinstance(term, e.ArrayOf) and term.kind == "array":
        return e.ArrayOf(tuple(field(item, name) for item in term.elements), "array")
    if isinstance(term, e.Subscript):
        return e.Subscript(field(term.base, name), term.subs)
    return e.FieldOf(term, name)


def element(term: Any, subs: tuple[Any, ...]) -> Any:
    """Elements of an array, chosen at once where array and index are written out."""
    if isinstance(term, e.ArrayOf) and term.kind == "array" and subs and isinstance(subs[0], e.Const):
        place = position(subs[0].value)
        if 0 <= place < len(term.elements):  # an error occurs where the value is needed
            found = term.elements[place]
            return element(found, subs[1:]) if len(subs) > 1 else found
    if isinstance(term, RecordOf):
        return RecordOf(tuple((name, element(item, subs)) for name, item in term.fields))
    return e.Subscript(term, subs)


def nested(items: list[Any], indices: list[tuple[int, ...]]) -> Any:
    """The array of items at these indices."""
    if len(indices[0]) == 1:
        return e.ArrayOf(tuple(items), "array")
    rows: dict[int, tuple[list[Any], list[tuple[int, ...]]]] = {}
    for item, (first, *rest) in zip(items, indices, strict=True):
        own = rows.setdefault(first, ([], []))
        own[0].append(item)
        own[1].append(tuple(rest))
    return e.ArrayOf(tuple(nested(*row) for row in rows.values()), "array")
