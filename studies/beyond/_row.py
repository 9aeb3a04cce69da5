"""What every item of the study gives: figures, each with its unit and what the thesis says of it."""

import dataclasses
from collections.abc import Iterable, Sequence

HEADS = ("case", "quantity", "value", "unit", "thesis", "remark")


@dataclasses.dataclass(frozen=True)
class Row:
    """A figure; `thesis` is None where the thesis is silent."""

    item: str
    case: str
    quantity: str
    unit: str
    value: float
    thesis: float | None = None
    remark: str = ""


def cells(rows: Iterable[Row]) -> list[Sequence[str]]:
    """The table as texts."""
    return [
        (
            row.case, row.quantity, f"{row.value:.4g}", row.unit, "-" if row.thesis is None else f"{row.thesis:g}",
            row.remark,
        )
        for row in rows
    ]  # fmt: skip
