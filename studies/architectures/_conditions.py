"""Other conditions of the duty: cold, hot, and with a worn clutch.

All sizes are those at 40 C; away from it the liquid is DOT 4, windings are of copper, and magnets of neodymium.
Friction of the drives stays: what part of it is the liquid's is not known.
"""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

from ..actuators import at_temperature, worn

BASE = 40.0  # C

CONDITIONS: Mapping[str, Callable[[Any], Any]] = MappingProxyType(
    {
        "-30 C": lambda model: at_temperature(model, -30.0, reference=BASE),
        "120 C": lambda model: at_temperature(model, 120.0, reference=BASE),
        "worn": worn,
    }
)
