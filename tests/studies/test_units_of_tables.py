"""Printed tables have display units; written rows have SI units."""

import pytest

from acausal._units.display import DISPLAY
from studies import identify
from studies.beyond._row import Row, cells
from studies.prototypes import stored

TABLES = [table for table in stored().all() if "unit" in table[1]]


@pytest.mark.parametrize("table", TABLES, ids=[table[0] for table in TABLES])
def test_prototypes(table: tuple[str, tuple[str, ...], list[tuple[str, ...]]]) -> None:
    _, heads, lines = table
    assert {line[heads.index("unit")] for line in lines}.isdisjoint(DISPLAY)


def test_estimates_of_the_prototypes() -> None:
    """A number is shown in its display unit: the friction of Table 8.2."""
    _, heads, lines = stored().estimates()
    shown = {
        (line[heads.index("unit")], line[heads.index("thesis")])
        for line in lines
        if line[0] == "EMA, Maxon RE50" and line[heads.index("parameter")] == "motor.bearing.C"
    }
    assert shown == {("mN.m.s/rad", "4")}


def test_beyond() -> None:
    """Both the figure of the model and that of the thesis have display units."""
    (line,) = cells([Row("load", "case", "opening time", "s", 0.1402, 0.148)])
    assert line[2:5] == ("140.2", "ms", "148")


def test_identify() -> None:
    row = identify.Row("case", "motor.bearing.C", "N.m.s/rad", 4e-3, 3.97e-3, 3.9e-3, 4.1e-3)
    assert identify._cells(row)[2:] == ("mN.m.s/rad", "4", "3.97", "3.9", "4.1")
