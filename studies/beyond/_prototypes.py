"""The prototypes, with the opening times measured in the thesis."""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import NamedTuple, TypeAlias

from .._measured import DEAD_TIME, FULL, MEASURED
from ..actuators import ElectrohydraulicActuator, ElectromechanicalActuator, ehs_maxon, ema_fise, ema_maxon

Build: TypeAlias = Callable[[], ElectromechanicalActuator | ElectrohydraulicActuator]


class Prototype(NamedTuple):
    """The builder of a prototype, and its measured opening time in s."""

    build: Build  # an actuator
    measured: float


FISE, RE50, RE40 = "EMA, FISE", "EMA, RE50", "EHS, RE40"
PROTOTYPES: Mapping[str, Prototype] = MappingProxyType(
    {
        FISE: Prototype(ema_fise, MEASURED["ema_fise"][FULL]["opening time"].value),
        RE50: Prototype(ema_maxon, MEASURED["ema_maxon"][FULL]["opening time"].value),
        RE40: Prototype(ehs_maxon, DEAD_TIME["opening time"].value),
    }
)
