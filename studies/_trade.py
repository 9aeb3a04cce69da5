"""Units of the trade: what figures in SI units are shown in."""

from collections.abc import Mapping
from types import MappingProxyType

from acausal import quantity

# By SI unit.
TRADE: Mapping[str, str] = MappingProxyType(
    {
        "s": "ms", "m": "mm", "m/s": "mm/s", "rad/s": "rpm", "Pa": "bar", "N/m": "N/mm", "rad/m": "rad/mm",
        "N.m/A": "mN.m/A", "N.m.s/rad": "mN.m.s/rad", "kg.m2": "g.cm2", "m3": "cm3", "m3/rad": "cm3/rev",
        "m3/s": "cm3/s", "kg/Pa": "g/bar", "Pa/m3": "bar/cm3", "Pa.s/m3": "bar.s/cm3", "m2/s": "mm2/s",
    }
)  # fmt: skip


def trade(value: float, unit: str) -> tuple[float, str]:
    """A value in an SI unit, and that unit, as the trade has them: 1.989e-7 m3/rad is 1.25 cm3/rev."""
    shown = TRADE.get(unit, unit)
    return value / in_si(shown) if shown != unit else value, shown


def in_si(unit: str) -> float:
    """The size of a unit in SI units."""
    return float(quantity(1.0, unit).to_base_units().magnitude)
