"""Tables of data sheets: CSV files, validated on loading."""

import csv
import math
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from acausal import ArgumentError, ParameterError, magnitude, quantity

from .._data_sheet import DataSheet

TEXTS = ("order", "family", "maker", "source", "date")
_HEAD = re.compile(r"^(?P<name>\w+) \[(?P<unit>[^\]]+)\]$")


class Column(NamedTuple):
    """Unit and range of a column of figures."""

    unit: str  # SI unit, to which the unit in the file must be convertible
    low: float  # minimum in this unit
    high: float  # maximum in this unit
    needed: bool = False  # whether each row must state it


class Catalogue(tuple[DataSheet, ...]):
    """Data sheets by order name: `catalogue["148867"]`, `catalogue.search(family="RE 40")`."""

    name: str

    def __new__(cls, name: str, sheets: Any = ()) -> "Catalogue":
        made = super().__new__(cls, sheets)
        made.name = name
        return made

    def __getitem__(self, key: Any) -> Any:
        """The sheet with an order name; raises `ArgumentError`, listing all names, if there is none."""
        if not isinstance(key, str):
            return super().__getitem__(key)
        for sheet in self:
            if sheet.order == key:
                return sheet
        names = ", ".join(f"{sheet.order} ({sheet.family})" for sheet in self)
        raise ArgumentError(f"{self.name} has no {key!r}. It has {names}.")

    def search(self, family: str | None = None, maker: str | None = None, **wanted: Any) -> "Catalogue":
        """The sheets of a family or maker with figures in ranges: `search(stall_torque=(1.0, None))`.

        A range is (minimum, maximum), with None for an open end, or a single value; in SI units or as quantities. A
        sheet that does not state a figure does not match a range of it. Raises `ArgumentError` for figures that this
        catalogue does not have.
        """
        units = dict(self[0].units) if self else {}
        if other := sorted(set(wanted) - set(units)):
            raise ArgumentError(f"{self.name} has no column {other[0]!r}. It has {', '.join(units)}.")
        ranges = {name: _range(value, units[name]) for name, value in wanted.items()}
        found = [
            sheet
            for sheet in self
            if family in (None, sheet.family) and maker in (None, sheet.maker) and _meets(sheet, ranges)
        ]
        return Catalogue(self.name, found)


def _range(value: Any, unit: str) -> tuple[float, float]:
    low, high = value if isinstance(value, tuple) else (value, value)
    least = -math.inf if low is None else float(magnitude(low, unit))
    return least, math.inf if high is None else float(magnitude(high, unit))


def _meets(sheet: DataSheet, ranges: Mapping[str, tuple[float, float]]) -> bool:
    values = {name: sheet.get(name) for name in ranges}
    slack = 1e-9
    return all(
        value is not None and low - slack * abs(low) <= value <= high + slack * abs(high)
        for value, (low, high) in zip(values.values(), ranges.values(), strict=True)
    )


def load(path: str | Path, columns: Mapping[str, Column]) -> Catalogue:
    """Reads data sheets from a CSV file with a header line: `order`, `family`, `maker`, `source`, `date`, and figures.

    The header of a figure is its name and unit, `resistance [ohm]`; an empty field means not stated. Raises
    `ParameterError` with file, row and column for an incompatible unit, a number out of range, a missing or invalid
    number, and a duplicate order name.
    """
    path = Path(path)
    with path.open(newline="", encoding="utf-8") as file:
        lines = csv.reader(file)
        heads = next(lines, [])
        units = _units(path.name, heads, columns)
        sheets = [_sheet(path, row, dict(zip(heads, line, strict=False)), units, columns) for row, line in _rows(lines)]
    orders = [sheet.order for sheet in sheets]
    if twice := [order for order in orders if orders.count(order) > 1]:
        raise ParameterError(f"{path.name}, column order: {twice[0]!r} appears in {orders.count(twice[0])} rows.")
    return Catalogue(path.name, sheets)


def _rows(lines: Iterator[list[str]]) -> Iterator[tuple[int, list[str]]]:
    """Nonempty lines and their line numbers in the file; the header is line 1."""
    yield from ((row, line) for row, line in enumerate(lines, start=2) if line)


def _units(file: str, heads: list[str], columns: Mapping[str, Column]) -> dict[str, tuple[str, str]]:
    """Name and unit from the header of each figure."""
    found = {}
    for head in heads:
        if head in TEXTS:
            continue
        parts = _HEAD.match(head)
        if head in columns:
            raise ParameterError(f"{file}, column {head!r}: has no unit. Write {head} [{columns[head].unit}].")
        if parts is None or parts["name"] not in columns:
            raise ParameterError(
                f"{file}, column {head!r}: is unknown. Use one of {', '.join((*TEXTS, *columns))} with its [unit]."
            )
        _converted(f"{file}, column {parts['name']}", 1.0, parts["unit"], columns[parts["name"]].unit)
        found[head] = parts["name"], parts["unit"]
    names = {name for name, _ in found.values()}
    missing = [text for text in TEXTS if text not in heads]
    missing += [name for name, column in columns.items() if column.needed and name not in names]
    if missing:
        raise ParameterError(f"{file}: has no column {missing[0]}.")
    return found


def _sheet(
    path: Path, row: int, fields: dict[str, str], units: dict[str, tuple[str, str]], columns: Mapping[str, Column]
) -> DataSheet:
    where = f"{path.name}, row {row}"
    for text in TEXTS:
        if not fields.get(text, "").strip():
            raise ParameterError(f"{where}, column {text}: is missing.")
    figures = []
    for head, (name, unit) in units.items():
        given, column, here = fields.get(head, "").strip(), columns[name], f"{where}, column {name}"
        if not given:
            if column.needed:
                raise ParameterError(f"{here}: is missing.")
            continue
        try:
            number = float(given)
        except ValueError as error:
            raise ParameterError(f"{here}: must be a number, got {given!r}.") from error
        value = _converted(here, number, unit, column.unit)
        if not column.low <= value <= column.high:
            raise ParameterError(
                f"{here}: must be within {column.low:g} .. {column.high:g} {column.unit}, got {given} {unit}."
            )
        figures.append((name, value))
    text = {name: fields[name].strip() for name in TEXTS}
    stated = tuple((name, columns[name].unit) for name, _ in units.values())
    return DataSheet(catalogue=path.name, figures=tuple(figures), units=stated, **text)


def _converted(where: str, number: float, unit: str, wanted: str) -> float:
    try:
        return float(magnitude(quantity(number, unit), wanted))
    except Exception as error:
        raise ParameterError(
            f"{where}: has the unit {unit!r}, which is not convertible to {wanted}. Correct the header."
        ) from error
