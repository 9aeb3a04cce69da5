"""Numbers with units as they are written in a problem: "15 mm", a quantity of pint, or a number in SI units."""

import re
from typing import Any, NamedTuple

from .._errors import ParameterError
from .._units.quantity import has_unit, magnitude, quantity

_NUMBER = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?|[+-]?inf)\s*(\S*)\s*")


class Scale(NamedTuple):
    """How numbers are shown: x is shown as (x - zero) / factor, in the unit `shown`."""

    shown: str = "1"
    factor: float = 1.0
    zero: float = 0.0

    def value(self, number: Any) -> Any:
        """A number as it is shown."""
        return (number - self.zero) / self.factor

    def difference(self, number: Any) -> Any:
        """A difference as it is shown; temperatures may have another zero."""
        return number / self.factor

    @property
    def unit(self) -> str:
        """The unit by its name; that of a pure number is "1"."""
        return self.shown or "1"

    @property
    def text(self) -> str:
        """The unit behind a number, with a blank before it; nothing for a pure number."""
        return "" if self.unit == "1" else f" {self.unit}"

    def headed(self, name: str) -> str:
        """A name with the unit of its numbers, above a column or along an axis: "time [ms]"."""
        return f"{name} [{self.unit}]" if self.text else name


def scale_of(shown: str, unit: str, where: str) -> Scale:
    """The scale that shows numbers of `unit`, "" being that of SI, in another unit."""
    if shown in ("", "1", unit):
        return Scale(shown)
    zero, one = (float(magnitude(quantity(number, shown), unit, where)) for number in (0.0, 1.0))
    return Scale(shown, one - zero, zero)


def number_in(value: Any, unit: str, where: str) -> tuple[float, str]:
    """A number in `unit`, "" being that of SI, and the unit that it was written in.

    Raises `ParameterError` for text that is not a number with a unit, and for a unit of another dimension.
    """
    if isinstance(value, str):
        found = _NUMBER.fullmatch(value)
        if found is None:
            raise ParameterError(f"{where}: {value!r} is not a number with a unit, such as '15 mm'.")
        number, written = float(found[1]), found[2]
        if not written:
            return number, unit
        return float(magnitude(quantity(number, written), unit, where)), written
    if has_unit(value):
        written = f"{value.units:~C}".replace("**", "").replace("*", ".")
        for symbol, name in (("Δ°C", "delta_degC"), ("°C", "degC"), ("°", "deg")):
            written = written.replace(symbol, name)
        return float(magnitude(value, unit, where)), written
    try:
        return float(value), unit
    except (TypeError, ValueError) as error:
        raise ParameterError(f"{where}: {value!r} is not a number, nor one with a unit such as '15 mm'.") from error


def difference_in(value: object, unit: str, where: str) -> float:
    """A difference in `unit`: 2 degC are 2 K, although the temperature of 2 degC is 275.15 K."""
    number, written = number_in(value, unit, where)
    return number - scale_of(written, unit, where).zero
