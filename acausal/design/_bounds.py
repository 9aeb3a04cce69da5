"""Numbers with units as they are written in a problem: "15 mm", a quantity of pint, or a number in SI units."""

import dataclasses
import re
from typing import Any

from .._errors import ParameterError
from .._units.quantity import has_unit, magnitude, quantity

_NUMBER = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?|[+-]?inf)\s*(\S*)\s*")


@dataclasses.dataclass(frozen=True)
class Scale:
    """The unit that numbers are shown in, beside the one that they are computed in; "" is that of SI."""

    shown: str
    unit: str = ""

    def value(self, number: Any) -> Any:
        """A number as it is shown."""
        return number if self._is_same else magnitude(quantity(number, self._source), self.shown)

    def difference(self, number: Any) -> Any:
        """A difference as it is shown; that between temperatures has another zero."""
        return number * float(self.value(1.0) - self.value(0.0))

    @property
    def _is_same(self) -> bool:
        return self.shown in ("", "1", self.unit)

    @property
    def _source(self) -> str:
        return self.unit or f"{quantity(0.0, self.shown).to_base_units().units:~C}".replace("**", "").replace("*", ".")

    @property
    def text(self) -> str:
        """The unit behind a number, with a blank before it; nothing for a pure number."""
        return f" {self.shown}" if self.shown not in ("", "1") else ""


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
        return float(magnitude(value, unit, where)), written
    try:
        return float(value), unit
    except (TypeError, ValueError) as error:
        raise ParameterError(f"{where}: {value!r} is not a number, nor one with a unit such as '15 mm'.") from error
