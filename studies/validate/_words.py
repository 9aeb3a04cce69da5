"""Names of quantities and conditions, with their units."""

from collections.abc import Mapping
from types import MappingProxyType

from acausal import displayed

UNITS: Mapping[str, str] = MappingProxyType(
    {
        "opening_time": "s",
        "peak_current": "A",
        "holding_current": "A",
        "holding_power": "W",
        "battery_current": "A",
        "mode_frequency_1": "Hz",
        "mode_frequency_2": "Hz",
        "mass_motor": "kg",
        "mass_slave": "kg",
        "stiffness_liquid": "N/m",
        "stiffness_clutch": "N/m",
        "static_gain": "N/(N.m)",
        "static_gain_level": "dB",
        "angle_per_stroke": "rad/m",
        **{
            f"{energy}_{side}_{mode}": "1"
            for mode in (1, 2)
            for energy in ("kinetic", "potential", "displacement")
            for side in ("motor", "slave")
        },
        "holding_pressure": "Pa",
        "no_load_speed": "rad/s",
        "stall_torque": "N.m",
        "least_ratio": "1",
        "best_ratio": "1",
        "dead_time": "s",
        "identified_resistance": "ohm",
        "identified_friction": "N.m.s/rad",
    }
)
CHANGED: Mapping[str, tuple[str, str]] = MappingProxyType(
    {"voltage": ("supply of", "V"), "spring_rate": ("clutch of", "N/m"), "friction": ("friction of", "N.m.s/rad")}
)
NAMES: Mapping[str, str] = MappingProxyType(
    {
        "mass_motor": "motor mass referred to the slave",
        "mass_slave": "mass of the slave",
        "stiffness_liquid": "stiffness of the liquid",
        "stiffness_clutch": "stiffness of the clutch",
        "holding_current": "motor current, held",
        "holding_power": "power, held",
        "battery_current": "battery current, held",
        "holding_pressure": "pressure, held",
        "no_load_speed": "no-load speed",
    }
)
STORES: Mapping[str, Mapping[str, str]] = MappingProxyType(
    {
        "kinetic": {"motor": "motor", "slave": "piston"},
        "potential": {"motor": "liquid", "slave": "clutch"},
        "displacement": {"motor": "motor", "slave": "piston"},
    }
)
NOTE = (
    "Modes are undamped, at a stroke of 6 mm, and without pressure unless held against the spring. The battery "
    "supplies the power of the held motor through a lossless converter."
)


def spoken(quantity: str) -> str:
    """The name of a quantity; for modes, with the share of an energy or of the largest displacement."""
    name, *place = quantity.split("_")
    if name in STORES:
        return f"mode {place[1]}, {name}: {STORES[name][place[0]]}"
    return NAMES.get(quantity, quantity.replace("_", " "))


def readable(condition: str) -> str:
    """The name of a condition with units."""
    return ", ".join(_readable(change) for change in condition.split(", "))


def _readable(change: str) -> str:
    name, _, value = change.partition("=")
    if name not in CHANGED:
        return change
    words, unit = CHANGED[name]
    shown, unit = displayed(float(value), unit)
    return f"{words} {shown:.4g} {unit}"
