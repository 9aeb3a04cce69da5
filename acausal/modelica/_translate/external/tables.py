"""Tables: the functions of ModelicaStandardTables."""

from collections.abc import Callable
from typing import Any

import jax.numpy as jnp
import numpy as np

from ..tables import Table1D, Table2D, TimeTable
from ..tables.files import matrix
from ..values import is_known, plain


def _data(name: str, file: str, table: Any, delimiter: str, header_lines: int) -> Any:
    return table if file in ("NoName", "") or not file.strip() else matrix(file, name, delimiter, header_lines)


def _time_table(
    name: str,
    file: str,
    table: Any,
    start: Any,
    columns: Any,
    smoothness: int,
    extrapolation: int,
    shift: Any = 0.0,
    events: int = 1,
    verbose: bool = True,
    delimiter: str = ",",
    header_lines: int = 0,
) -> TimeTable:
    data = _data(name, file, table, delimiter, header_lines)
    return TimeTable.of(data, start, columns, smoothness, extrapolation, shift, events)


def _table_1d(
    name: str,
    file: str,
    table: Any,
    columns: Any,
    smoothness: int,
    extrapolation: int = 2,
    verbose: bool = True,
    delimiter: str = ",",
    header_lines: int = 0,
) -> Table1D:
    return Table1D.of(_data(name, file, table, delimiter, header_lines), columns, smoothness, extrapolation)


def _table_2d(
    name: str,
    file: str,
    table: Any,
    smoothness: int,
    extrapolation: int = 2,
    verbose: bool = True,
    delimiter: str = ",",
    header_lines: int = 0,
) -> Table2D:
    return Table2D.of(_data(name, file, table, delimiter, header_lines), smoothness, extrapolation)


def _ends(index: int) -> Callable[[Table2D], Any]:
    def call(table: Table2D) -> Any:
        xp = np if is_known(table.x) and is_known(table.y) else jnp
        return xp.stack([table.x[index], table.y[index]])

    return call


def _prefixed(prefix: str, functions: dict[str, Callable[..., Any]]) -> dict[str, Callable[..., Any]]:
    def plainly(function: Callable[..., Any]) -> Callable[..., Any]:
        return lambda *args: plain(function(*args))

    return {f"ModelicaStandardTables_{prefix}_{name}": plainly(item) for name, item in functions.items()}


FUNCTIONS: dict[str, Callable[..., Any]] = {
    **_prefixed(
        "CombiTimeTable",
        {
            "init3": _time_table,
            "getValue": lambda table, column, t, following, before: table.value(column, t, following),
            "getDerValue": lambda table, column, t, following, before, rate: table.derivative(
                column, t, following, rate
            ),
            "getDer2Value": lambda table, column, t, following, before, *rates: table.second_derivative(
                column, t, following, *rates
            ),
            "minimumTime": lambda table: table.curves.x[0],
            "maximumTime": lambda table: table.curves.x[-1],
            "nextTimeEvent": TimeTable.next_event,
        },
    ),
    **_prefixed(
        "CombiTable1D",
        {
            "init3": _table_1d,
            "getValue": Table1D.value,
            "getDerValue": Table1D.derivative,
            "getDer2Value": Table1D.second_derivative,
            "minimumAbscissa": lambda table: table.curves.x[0],
            "maximumAbscissa": lambda table: table.curves.x[-1],
        },
    ),
    **_prefixed(
        "CombiTable2D",
        {
            "init3": _table_2d,
            "getValue": Table2D.value,
            "getDerValue": Table2D.derivative,
            "getDer2Value": Table2D.second_derivative,
            "minimumAbscissa": _ends(0),
            "maximumAbscissa": _ends(-1),
        },
    ),
}
