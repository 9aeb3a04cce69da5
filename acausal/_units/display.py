"""Display units: values are computed in SI units and shown in the units of drawings and data sheets."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, NamedTuple, Self

from .quantity import magnitude, quantity

# By declared unit, not by dimension: N.m/A and Wb have equal dimensions, but are units of different quantities.
DISPLAY: Mapping[str, str] = MappingProxyType(
    {
        "s": "ms", "m": "mm", "m2": "mm2", "m3": "cm3", "m/s": "mm/s", "m2/s": "mm2/s", "m3/s": "cm3/s",
        "rad/s": "rpm", "rad/m": "rad/mm", "m/rad": "mm/rev", "m3/rad": "cm3/rev", "N/m": "N/mm", "kg.m2": "g.cm2",
        "N.m.s/rad": "mN.m.s/rad", "N.m/A": "mN.m/A", "H": "mH", "Pa": "bar", "kg/Pa": "g/bar", "Pa/m3": "bar/cm3",
        "Pa.s/m3": "bar.s/cm3", "m3/(s.Pa)": "cm3/(s.bar)",
    }
)  # fmt: skip


def display_unit(unit: str) -> str:
    """The display unit of a declared unit: `cm3/rev` for `m3/rad`; the same unit without an entry."""
    return DISPLAY.get(unit, unit)


def displayed(value: Any, unit: str) -> tuple[Any, str]:
    """A value of a declared unit in its display unit, and that unit: 1.989e-7 m3/rad is (1.25, "cm3/rev")."""
    scale = Scale.of(unit)
    return scale.value(value), scale.shown


class Scale(NamedTuple):
    """Scale of displayed numbers: x is shown as (x - zero) / factor, in the unit `shown`."""

    shown: str = "1"
    factor: float = 1.0
    zero: float = 0.0

    @classmethod
    def of(cls, unit: str) -> Self:
        """The scale from a declared unit to its display unit."""
        return cls(*scale_of("", unit, unit))

    def value(self, number: Any) -> Any:
        """A number in the display unit."""
        return (number - self.zero) / self.factor

    def difference(self, number: Any) -> Any:
        """A difference in the display unit, without the offset of temperatures."""
        return number / self.factor

    @property
    def unit(self) -> str:
        """The name of the display unit; "1" for a pure number."""
        return self.shown or "1"

    @property
    def text(self) -> str:
        """The unit after a number, with a leading blank; empty for a pure number."""
        return "" if self.unit == "1" else f" {self.unit}"

    def headed(self, name: str) -> str:
        """A name with its unit, for a column or an axis: "time [ms]"."""
        return f"{name} [{self.unit}]" if self.text else name


def scale_of(shown: str, unit: str, where: str) -> Scale:
    """The scale from `unit` ("": the SI unit) to another unit; by default to its display unit."""
    shown = shown or display_unit(unit)
    if shown in ("", "1", unit):
        return Scale(shown)
    zero, one = (float(magnitude(quantity(number, shown), unit, where)) for number in (0.0, 1.0))
    return Scale(shown, one - zero, zero)
