"""Operating conditions of an actuator: temperature and wear."""

from collections.abc import Mapping
from typing import TypeVar

from acausal import Component, Scalar, parameters, replace
from components.hydraulic import dot_4

from ._opening import STROKE, WORN_LOAD
from ._warm import SHEETS, magnets, winding

M = TypeVar("M", bound=Component)

ZERO = 273.15  # K, of 0 C
WORN_LEAKS = 10.0  # leakage relative to new seals and a new pump; assumed
PRESSURE = 2e6  # Pa, pressure of the bulk modulus


def at_temperature(model: M, celsius: Scalar, *, reference: Scalar = SHEETS - ZERO) -> M:
    """The model with windings, magnets and liquid at a temperature in C; its parameters hold at `reference` in C.

    Scales the parameters whose paths end in these names:

    - `motor.resistor.R`, `coil.R`: resistance of copper, 3.93e-3 1/K at 20 C (IEC 60028); leads count as winding;
    - `motor.emf.k`: flux of NdFeB magnets, -1.1e-3 1/K (IEC 60404-8-1);
    - `pipe.resistance`, `leak.resistance`, `viscosity`: viscosity of DOT 4; `pump.leakage`: its inverse;
    - `line.stiffness`, `bulk_modulus`: bulk modulus of DOT 4 at 20 bar.

    The friction of bearings and seals does not change, because the share of the liquid in it is not known. The battery
    does not change either.
    """
    thicker, stiffer = _liquid(celsius, reference)
    copper, flux = (law(celsius + ZERO, reference + ZERO) for law in (winding, magnets))
    factors = {
        "motor.resistor.R": copper, "coil.R": copper, "motor.emf.k": flux, "viscosity": thicker,
        "leak.resistance": thicker, "pipe.resistance": thicker, "pump.leakage": 1.0 / thicker,
        "bulk_modulus": stiffer, "line.stiffness": stiffer,
    }  # fmt: skip
    return _multiplied(model, factors)


def worn(model: M, *, load: Scalar = WORN_LOAD, leaks: Scalar = WORN_LEAKS) -> M:
    """The model with a linear clutch spring that takes `load` in N to open, and with leakage `leaks` times as large.

    Leakage is that past the seals, `leak.resistance`, and that in the pump, `pump.leakage`.
    """
    changed = replace(model, {"clutch.rate": load / STROKE})
    return _multiplied(changed, {"leak.resistance": 1.0 / leaks, "pump.leakage": leaks})


def _multiplied(model: M, factors: Mapping[str, Scalar]) -> M:
    """The model with the parameters multiplied whose path ends in a name of `factors`."""
    changed = {
        path: value * factor
        for path, value in parameters(model).items()
        for name, factor in factors.items()
        if path == name or path.endswith(f".{name}")
    }
    return replace(model, changed)


def _liquid(celsius: Scalar, reference: Scalar) -> tuple[Scalar, Scalar]:
    """Viscosity and bulk modulus of DOT 4, relative to the reference temperature."""
    now, base = (dot_4(temperature=ZERO + value, air=1e-6) for value in (celsius, reference))
    return (
        now.kinematic_viscosity(PRESSURE) / base.kinematic_viscosity(PRESSURE),
        now.bulk_modulus_at(PRESSURE) / base.bulk_modulus_at(PRESSURE),
    )
