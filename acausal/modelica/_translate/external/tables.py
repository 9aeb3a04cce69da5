"""Tables: the functions of ModelicaStandardTables."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from ..tables import Table1D, Table2D, TimeTable
from ..tables.files import matrix
from ..values import is_known, plain


def _data(name: str, file: str, table: Any, verbose: bool = True, delimiter: str = ",", header_lines: int = 0) -> Any:
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
    *of_file: Any,
) -> TimeTable:
    return TimeTable.of(_data(name, file, table, *of_file), start, columns, smoothness, extrapolation, shift, events)


def _table_1d(
    name: str, file: str, table: Any, columns: Any, smoothness: int, extrapolation: int = 2, *of_file: Any
) -> Table1D:
    return Table1D.of(_data(name, file, table, *of_file), columns, smoothness, extrapolation)


def _table_2d(name: str, file: str, table: Any, smoothness: int, extrapolation: int = 2, *of_file: Any) -> Table2D:
    return Table2D.of(_data(name, file, table, *of_file), smoothness, extrapolation)


def _slope(value: Callable[..., Any], at: Sequence[Any], rates: Sequence[Any]) -> Any:
    """The derivative of a function by time."""
    return jax.jvp(value, _floats(at), _floats(rates))[1]


def _curvature(value: Callable[..., Any], at: Sequence[Any], rates: Sequence[Any], seconds: Sequence[Any]) -> Any:
    """The second derivative of a function by time."""
    count = len(at)
    return _slope(lambda *x: _slope(value, x[:count], x[count:]), (*at, *rates), (*rates, *seconds))


def _floats(values: Sequence[Any]) -> tuple[Any, ...]:
    return tuple(jnp.asarray(value, float) for value in values)


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
            "getDerValue": lambda table, column, t, following, before, rate: _slope(
                lambda time: table.value(column, time, following), (t,), (rate,)
            ),
            "getDer2Value": lambda table, column, t, following, before, rate, second: _curvature(
                lambda time: table.value(column, time, following), (t,), (rate,), (second,)
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
            "getDerValue": lambda table, column, u, rate: _slope(partial(table.value, column), (u,), (rate,)),
            "getDer2Value": lambda table, column, u, rate, second: _curvature(
                partial(table.value, column), (u,), (rate,), (second,)
            ),
            "minimumAbscissa": lambda table: table.curves.x[0],
            "maximumAbscissa": lambda table: table.curves.x[-1],
        },
    ),
    **_prefixed(
        "CombiTable2D",
        {
            "init3": _table_2d,
            "getValue": Table2D.value,
            "getDerValue": lambda table, *args: _slope(table.value, args[:2], args[2:]),
            "getDer2Value": lambda table, *args: _curvature(table.value, args[:2], args[2:4], args[4:]),
            "minimumAbscissa": _ends(0),
            "maximumAbscissa": _ends(-1),
        },
    ),
}
