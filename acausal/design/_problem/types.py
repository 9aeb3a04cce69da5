"""Types of arguments, and numbers with units: texts such as "15 mm", quantities of pint, and plain numbers."""

from collections.abc import Callable, Mapping
from typing import Any, Protocol, TypeAlias, TypeVar

from ..._errors import ParameterError
from ..._units.display import scale_of
from ..._units.quantity import has_unit, magnitude, written

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


def number_in(value: Any, unit: str, where: str) -> tuple[float, str]:
    """A number converted to `unit` ("": the SI unit), and the unit it was written in ("" for a plain number).

    Raises `ParameterError` for text that is not a number with a unit, and for a unit of another dimension.
    """
    if isinstance(value, str):
        return float(magnitude(value, unit, where)), written(value, where)[1]
    if has_unit(value):
        own = f"{value.units:~C}".replace("**", "").replace("*", ".")
        for symbol, name in (("Δ°C", "delta_degC"), ("°C", "degC"), ("°", "deg")):
            own = own.replace(symbol, name)
        return float(magnitude(value, unit, where)), own
    try:
        return float(value), ""
    except (TypeError, ValueError) as error:
        raise ParameterError(f"{where}: expected a number, with or without a unit, got {value!r}.") from error


def difference_in(value: object, unit: str, where: str) -> float:
    """A difference converted to `unit`: 2 degC become 2 K, whereas the temperature 2 degC is 275.15 K."""
    number, own = number_in(value, unit, where)
    return number - scale_of(own or unit, unit, where).zero
