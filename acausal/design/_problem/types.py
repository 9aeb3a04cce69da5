"""Types of arguments, and numbers with units: texts such as "15 mm", quantities of pint, and plain numbers."""

import re
from collections.abc import Callable, Mapping
from typing import Any, Protocol, TypeAlias, TypeVar

from ..._errors import ParameterError
from ..._units.display import scale_of
from ..._units.quantity import has_unit, magnitude, quantity

Value = TypeVar("Value")

Function: TypeAlias = Callable[[Any], Any]  # of a model, or of the result of a user's run
One: TypeAlias = Function | tuple[Function, str]  # a result, possibly with its display unit
Key: TypeAlias = str | tuple[str, ...]  # a path, or several paths that share a value
ByPath: TypeAlias = Mapping[str, Value] | Mapping[tuple[str, ...], Value] | Mapping[Key, Value]
Progress: TypeAlias = Callable[[int, int], None]  # takes the numbers of finished and of all members


class Executor(Protocol):
    """Common interface of the executors of `concurrent.futures`, Dask and submitit."""

    def submit(self, fn: Callable[..., Any], /, *args: Any) -> Any:
        """Runs a function in another thread or process; returns a future."""
        ...


_NUMBER = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?|[+-]?inf)\s*(\S*)\s*")


def number_in(value: Any, unit: str, where: str) -> tuple[float, str]:
    """A number converted to `unit` ("": the SI unit), and the unit it was written in ("" for a plain number).

    Raises `ParameterError` for text that is not a number with a unit, and for a unit of another dimension.
    """
    if isinstance(value, str):
        found = _NUMBER.fullmatch(value)
        if found is None:
            raise ParameterError(f"{where}: {value!r} is not a number with a unit, such as '15 mm'.")
        number, written = float(found[1]), found[2]
        if not written:
            return number, ""
        return float(magnitude(quantity(number, written), unit, where)), written
    if has_unit(value):
        written = f"{value.units:~C}".replace("**", "").replace("*", ".")
        for symbol, name in (("Δ°C", "delta_degC"), ("°C", "degC"), ("°", "deg")):
            written = written.replace(symbol, name)
        return float(magnitude(value, unit, where)), written
    try:
        return float(value), ""
    except (TypeError, ValueError) as error:
        raise ParameterError(f"{where}: expected a number, with or without a unit, got {value!r}.") from error


def difference_in(value: object, unit: str, where: str) -> float:
    """A difference converted to `unit`: 2 degC become 2 K, whereas the temperature 2 degC is 275.15 K."""
    number, written = number_in(value, unit, where)
    return number - scale_of(written or unit, unit, where).zero
