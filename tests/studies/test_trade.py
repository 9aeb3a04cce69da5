"""Printed tables have units of the trade; the rows that are written have SI units."""

import pytest

from studies import identify
from studies._trade import TRADE, trade
from studies.beyond._row import Row, cells
from studies.prototypes import stored

TABLES = [table for table in stored().all() if "unit" in table[1]]


@pytest.mark.parametrize(("unit", "value", "shown"), [
    ("m3/rad", 1.25e-6 / 6.283185307179586, (1.25, "cm3/rev")), ("m", 12e-3, (12.0, "mm")), ("s", 0.13, (130.0, "ms")),
    ("Pa", 29e5, (29.0, "bar")), ("N/m", 58e3, (58.0, "N/mm")), ("m3/s", 2e-5, (20.0, "cm3/s")),
    ("kg/Pa", -2e-7, (-20.0, "g/bar")), ("A", 41.0, (41.0, "A")), ("1/min", 9.7, (9.7, "1/min")),
])  # fmt: skip
def test_trade(unit: str, value: float, shown: tuple[float, str]) -> None:
    found, name = trade(value, unit)
    assert name == shown[1]
    assert found == pytest.approx(shown[0], rel=1e-12)


@pytest.mark.parametrize("table", TABLES, ids=[table[0] for table in TABLES])
def test_prototypes(table: tuple[str, tuple[str, ...], list[tuple[str, ...]]]) -> None:
    _, heads, lines = table
    assert {line[heads.index("unit")] for line in lines}.isdisjoint(TRADE)


def test_estimates_of_the_prototypes() -> None:
    """A number and its unit are shown together: the friction of Table 8.2."""
    _, heads, lines = stored().estimates()
    shown = {
        (line[heads.index("unit")], line[heads.index("thesis")])
        for line in lines
        if line[0] == "EMA, Maxon RE50" and line[heads.index("parameter")] == "motor.bearing.C"
    }
    assert shown == {("mN.m.s/rad", "4")}


def test_beyond() -> None:
    """Both the figure and that of the thesis."""
    (line,) = cells([Row("load", "case", "opening time", "s", 0.1402, 0.148)])
    assert line[2:5] == ("140.2", "ms", "148")


def test_identify() -> None:
    row = identify.Row("case", "motor.bearing.C", "N.m.s/rad", 4e-3, 3.97e-3, 3.9e-3, 4.1e-3)
    assert identify._cells(row)[2:] == ("mN.m.s/rad", "4", "3.97", "3.9", "4.1")
