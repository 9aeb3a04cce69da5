"""Display units: values are computed in SI units and shown in those of drawings and data sheets."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, NamedTuple, Self

from .quantity import magnitude, quantity

# By declared unit, not by dimension: N.m/A and Wb have one dimension, and are units of different quantities.
DISPLAY: Mapping[str, str] = MappingProxyType(
    {
        "s": "ms", "m": "mm", "m2": "mm2", "m3": "cm3", "m/s": "mm/s", "m2/s": "mm2/s", "m3/s": "cm3/s",
        "rad/s": "rpm", "rad/m": "rad/mm", "m/rad": "mm/rev", "m3/rad": "cm3/rev", "N/m": "N/mm", "kg.m2": "g.cm2",
        "N.m.s/rad": "mN.m.s/rad", "N.m/A": "mN.m/A", "H": "mH", "Pa": "bar", "kg/Pa": "g/bar", "Pa/m3": "bar/cm3",
        "Pa.s/m3": "bar.s/cm3", "m3/(s.Pa)": "cm3/(s.bar)",
    }
)  # fmt: skip


def display_unit(unit: str) -> str:
    """The unit in which values of a declared unit are shown: `cm3/rev` for `m3/rad`; without an entry, the same."""
    return DISPLAY.get(unit, unit)


def displayed(value: Any, unit: str) -> tuple[Any, str]:
    """A value of a declared unit in its display unit, and that unit: 1.989e-7 m3/rad is (1.25, "cm3/rev")."""
    scale = Scale.of(unit)
    return scale.value(value), scale.shown


class Scale(NamedTuple):
    """The scale of shown numbers: x is shown as (x - zero) / factor, in the unit `shown`."""

    shown: str = "1"
    factor: float = 1.0
    zero: float = 0.0

    @classmethod
    def of(cls, unit: str) -> Self:
        """The scale that shows numbers of a declared unit in its display unit."""
        return cls(*scale_of("", unit, unit))

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
    """The scale that shows numbers of `unit`, "" being that of SI, in another unit; by default in the display unit."""
    shown = shown or display_unit(unit)
    if shown in ("", "1", unit):
        return Scale(shown)
    zero, one = (float(magnitude(quantity(number, shown), unit, where)) for number in (0.0, 1.0))
    return Scale(shown, one - zero, zero)
