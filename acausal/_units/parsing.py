"""Unit strings in Modelica's notation, parsed by pint.

`.` multiplies, digits after a symbol are its exponent, and the denominator follows one `/`, in parentheses if it has
more than one factor: `N.m.s/rad`, `m3/(s.Pa)`, `kg.m2`, `1/s`. Exponents may be decimal: `m3/(s.Pa0.5)`.
"""

import dataclasses
import functools as ft
import math
import re
from collections.abc import Sequence
from fractions import Fraction
from typing import Any

from .._errors import suggestion
from .dimension import BASE_UNITS, DERIVED, NUMBER, TIME, Dimension, base, whole

_TOKEN = re.compile(r"(?P<symbol>[^\W\d](?:\w*[^\W\d])?)(?P<exponent>[+-]?\d+(?:\.\d+)?)?|1|[./()]")
_GROUP = r"(?:f|\(f(?:\.f)*\))"  # f: a factor
_SHAPE = re.compile(rf"{_GROUP}(?:\.{_GROUP})*(?:/{_GROUP})?")
_COMMON = (*BASE_UNITS, *DERIVED.values(), "rad", "rad/s", "rev", "deg", "Hz", "J", "m2", "m3", "m/s", "m3/s", "1")
_QUANTITIES = ("[mass]", "[length]", "[time]", "[current]", "[temperature]", "[substance]", "[luminosity]")


class UnknownUnit(ValueError):
    """A string that is not a unit. The message gives the reason."""


@dataclasses.dataclass(frozen=True)
class Unit:
    """Properties of a unit. `is_si`: a value in it equals that in SI base units, with angles in rad.

    An angle has the dimension of a number, but turns are not radians: `has_angle` is true of rad/s and rpm, `counts` of
    Hz and 1/min.
    """

    dimension: Dimension
    is_si: bool
    has_angle: bool
    counts: bool


@ft.cache
def registry() -> Any:
    """All units of pint, and `rev`. Created on first use, which takes 0.1 s."""
    import pint

    made = pint.UnitRegistry()
    made.define("rev = turn")
    made.define("@alias ohm = Ohm")
    return made


def _coherent() -> dict[str, Dimension]:
    """The units of declarations: values in a product of them equal those in SI base units."""
    named = {symbol: dimension for dimension, symbol in DERIVED.items() if symbol.isalpha()}
    ohm = named["ohm"]
    others = {"J": named["W"] * TIME, "Ohm": ohm, "Ω": ohm, "S": ohm**-1, "Hz": TIME**-1, "rad": NUMBER}
    return {unit: base(unit) for unit in BASE_UNITS} | named | others


_COHERENT = _coherent()


@ft.cache
def parsed(unit: str) -> Unit:
    """The unit of a string. Raises `UnknownUnit`."""
    _expression(unit)
    if not is_coherent(unit):
        return unit_of(pint_unit(unit), registry())  # pint has many more, but its import is slow
    powers = _powers(unit)
    dimension = math.prod((_COHERENT[symbol] ** power for symbol, power in powers.items()), start=NUMBER)
    return Unit(dimension, is_si=True, has_angle=powers.get("rad", 0) != 0, counts=powers.get("Hz", 0) != 0)


def common_unit(units: Sequence[str]) -> str:
    """The unit of quantities in some units, if these have the same values: of 1/s and rad/s the one with the angle.
    Otherwise "".
    """
    if len(units) < 2:
        return "".join(units)
    all_units = [parsed(unit) for unit in units]
    angles = [unit for unit, one in zip(units, all_units, strict=True) if one.has_angle]
    is_mixed = len({one.dimension for one in all_units}) > 1 or not all(one.is_si for one in all_units)
    if is_mixed or (angles and any(one.counts for one in all_units)):
        return ""
    return [*angles, *units][0]


def is_coherent(unit: str) -> bool:
    """Whether a string is a product of units of declarations, which needs no import of pint."""
    return _powers(unit).keys() <= _COHERENT.keys()


def _powers(unit: str) -> dict[str, Fraction]:
    """The symbols in a string with their exponents."""
    powers: dict[str, Fraction] = {}
    for sign, part in zip((1, -1), unit.partition("/")[::2], strict=True):
        for token in _TOKEN.finditer(part):
            if token["symbol"]:
                power = powers.get(token["symbol"], Fraction(0))
                powers[token["symbol"]] = power + sign * Fraction(token["exponent"] or 1)
    return powers


@ft.cache
def pint_unit(unit: str) -> Any:
    """The unit of pint's registry for a string. Raises `UnknownUnit`."""
    try:
        return registry().parse_units(_expression(unit))
    except AttributeError as error:  # pint's UndefinedUnitError
        raise UnknownUnit(_unknown(unit, "pint has no such unit")) from error


def _expression(unit: str) -> str:
    """The unit in pint's notation."""
    tokens = list(_TOKEN.finditer(unit))
    kinds = "".join("f" if token["symbol"] or token[0] == "1" else token[0] for token in tokens)
    if "".join(token[0] for token in tokens) != unit or not _SHAPE.fullmatch(kinds):
        raise UnknownUnit(_unknown(unit, "write it as in N.m.s/rad or m3/(s.Pa)"))
    if any(token["symbol"] == "Nm" for token in tokens):  # a unit of yarn in pint
        raise UnknownUnit(_unknown(unit, "newton metre is N.m"))
    return "".join(map(_translated, tokens))


def _translated(token: re.Match[str]) -> str:
    if token["exponent"]:
        return f"{token['symbol']}**({token['exponent']})"
    return "*" if token[0] == "." else token[0]


def quotient(above: str, below: str) -> str:
    """The unit of a quantity in one unit divided by one in another: `s` and `N.m/A` give `s.A/(N.m)`."""
    (over, under), (under_too, over_too) = _factors(above), _factors(below)
    over, under = over + over_too, under + under_too
    for factor in [factor for factor in over if factor in under]:
        if factor in under:
            over.remove(factor)
            under.remove(factor)
    divisor = f"({'.'.join(under)})" if len(under) > 1 else "".join(under)
    return ".".join(over or ["1"]) + (f"/{divisor}" if under else "")


def _factors(unit: str) -> tuple[list[str], list[str]]:
    """The factors of numerator and denominator."""
    above, _, below = unit.partition("/")
    return tuple([t[0] for t in _TOKEN.finditer(part) if t["symbol"]] for part in (above, below))  # pyright: ignore[reportReturnType]


def unit_of(unit: Any, units: Any) -> Unit:
    """A unit of a registry, with its dimension and its need for conversion."""
    exponents = dict(units.get_dimensionality(unit))
    if set(exponents) - set(_QUANTITIES):
        raise UnknownUnit(_unknown(str(unit), "it measures no physical quantity"))
    dimension = Dimension(tuple(_fraction(exponents.get(name, 0)) for name in _QUANTITIES))
    factor, basic = units.get_base_units(unit)
    zero = units.Quantity(0.0, unit).to(basic).magnitude
    is_si = bool(abs(factor - 1.0) < 1e-12 and zero == 0.0)
    names = {name for name, _ in units.Quantity(1.0, unit).unit_items()}
    has_angle = "radian" in {name for name, _ in units.Quantity(1.0, basic).unit_items()}
    per_time = dimension == TIME**-1 and not is_si and not has_angle
    return Unit(dimension, is_si, has_angle, per_time or any(name.endswith("hertz") for name in names))


def _fraction(exponent: float) -> Fraction | int:
    return whole(Fraction(exponent).limit_denominator(1000))


def _unknown(unit: str, why: str) -> str:
    return f"the unit {unit!r} is not known: {why}.{suggestion(unit, _COMMON)}"
