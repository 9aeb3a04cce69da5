"""Rows of results, each with its unit and its value in the thesis."""

import dataclasses
from collections.abc import Iterable, Sequence

from acausal import displayed

HEADS = ("case", "quantity", "value", "unit", "thesis", "remark")


@dataclasses.dataclass(frozen=True)
class Row:
    """A result; `thesis` is None if the thesis has no value."""

    item: str
    case: str
    quantity: str
    unit: str
    value: float
    thesis: float | None = None
    remark: str = ""


def cells(rows: Iterable[Row]) -> list[Sequence[str]]:
    """The table cells as text, in display units."""
    return [_line(row) for row in rows]


def _line(row: Row) -> Sequence[str]:
    value, unit = displayed(row.value, row.unit)
    thesis = "-" if row.thesis is None else f"{displayed(row.thesis, row.unit)[0]:g}"
    return row.case, row.quantity, f"{value:.4g}", unit, thesis, row.remark
