"""Other conditions of the duty: cold, hot, and with a worn clutch.

All sizes are those at 40 C; away from it the liquid is DOT 4, windings are of copper, and magnets of neodymium.
Friction of the drives stays: what part of it is the liquid's is not known.
"""

import functools as ft
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

from acausal import Scalar, parameters, replace
from components.hydraulic import dot_4

from ..actuators import STROKE, WORN_LOAD, magnets, winding
from ._architecture import M

ZERO = 273.15  # K
BASE = 40.0  # C
WORN_LEAKS = 10.0  # times those past new seals; assumed
PRESSURE = 2e6  # Pa, at which stiffnesses are compared


def at_temperature(celsius: Scalar, model: M) -> M:
    """The model with windings, magnets and liquid at a temperature in C."""
    thinner, softer = _liquid(celsius)
    copper, flux = (law(celsius + ZERO, BASE + ZERO) for law in (winding, magnets))
    factors = {
        "motor.resistor.R": copper, "coil.R": copper, "motor.emf.k": flux, "viscosity": thinner,
        "leak.resistance": thinner, "bulk_modulus": softer, "line.stiffness": softer,
    }  # fmt: skip
    return _multiplied(model, factors)


def worn(model: M) -> M:
    """The model with a clutch that takes `WORN_LOAD` to open, and with seals that leak more."""
    return _multiplied(replace(model, {"clutch.rate": WORN_LOAD / STROKE}), {"leak.resistance": 1.0 / WORN_LEAKS})


CONDITIONS: Mapping[str, Callable[[Any], Any]] = MappingProxyType(
    {"-30 C": ft.partial(at_temperature, -30.0), "120 C": ft.partial(at_temperature, 120.0), "worn": worn}
)


def _multiplied(model: M, factors: Mapping[str, Scalar]) -> M:
    """The model with all parameters multiplied whose path ends in a name."""
    changed = {
        path: value * factor
        for path, value in parameters(model).items()
        for name, factor in factors.items()
        if path == name or path.endswith(f".{name}")
    }
    return replace(model, changed)


def _liquid(celsius: Scalar) -> tuple[Scalar, Scalar]:
    """Viscosity and bulk modulus of DOT 4, over those at the base temperature."""
    now, base = (dot_4(temperature=ZERO + value, air=1e-6) for value in (celsius, BASE))
    return (
        now.kinematic_viscosity(PRESSURE) / base.kinematic_viscosity(PRESSURE),
        now.bulk_modulus_at(PRESSURE) / base.bulk_modulus_at(PRESSURE),
    )
