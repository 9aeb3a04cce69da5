"""Checks of what the front end made of the conditions and sizes of components (`part_marks.py`)."""

import re
from collections.abc import Sequence
from typing import Any

from .._errors import ModelicaError
from .marks import joined, mark, marks
from .modifiers import KnownContent
from .sources import Sources

_Tree = dict[str, Any]
_REMEDY = "Remedy: use an Integer or Boolean parameter with a value of its own, such as a literal."


def check_parts(content: _Tree, sources: Sources) -> None:
    """Raises `ModelicaError` for a component that the front end made present or absent against its condition, and for
    an array of components with another size than its declaration says.
    """
    known = KnownContent(content)
    for path, kind, name, variable in marks(content, "if", "size"):
        value = known.value(joined(path, mark(kind, name)))
        if value is None:
            continue
        if kind == "if":
            is_right = bool(value) == (joined(path, mark("on", name)) in content["variables"])
            what = f"a condition of a component of {path or 'the model'}"
        else:
            is_right = _has_size(content, joined(path, name), [int(size) for size in value])
            what = f"the size of {joined(path, name)}"
        if not is_right:
            span = variable["source_span"]
            raise ModelicaError(
                f"{sources.where(span['source'], span['start'])}the front end loses {what}, because it does not find "
                f"the value of a parameter. {_REMEDY}"
            )


def _has_size(content: _Tree, part: str, sizes: Sequence[int]) -> bool:
    """Whether an array of components has these sizes. The elements of an array of records may be arrays of numbers."""
    members = re.compile(rf"{re.escape(part)}(?:\[([\d,]+)\])?\.")
    found = {one[1]: name for name in content["variables"] if (one := members.match(name))}
    if None in found:
        is_record = part in content["record_instances"]
        return is_record and content["variables"][found[None]]["dims"][: len(sizes)] == list(sizes)
    indices = [[int(i) for i in index.split(",")] for index in found]
    return not indices or [max(column) for column in zip(*indices, strict=True)] == list(sizes)
