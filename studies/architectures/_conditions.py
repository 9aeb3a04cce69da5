"""Operating conditions of the duty: the no-load set, cold, hot, and with a worn clutch.

The base temperature is 40 C. The temperature dependence is that of DOT 4, copper windings and NdFeB magnets. The
friction of the drives does not depend on the temperature, because the share of the liquid in it is not known.
"""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

from acausal import replace

from ..actuators import NO_LOAD_FRICTION, at_temperature, worn

BASE = 40.0  # C

NO_LOAD = "no-load set"
CONDITIONS: Mapping[str, Callable[[Any], Any]] = MappingProxyType(
    {
        NO_LOAD: lambda model: replace(model, {"motor.bearing.C": NO_LOAD_FRICTION}),
        "-30 C": lambda model: at_temperature(model, -30.0, reference=BASE),
        "120 C": lambda model: at_temperature(model, 120.0, reference=BASE),
        "worn": worn,
    }
)


def conditions_of(model: Any) -> dict[str, Any]:
    """The model under each condition that it has; only drives with a pump have a no-load set."""
    pumped = hasattr(model, "pump")
    return {name: change(model) for name, change in CONDITIONS.items() if pumped or name != NO_LOAD}
