"""Quantities, and their conversion to SI units."""

import re
import sys
from collections.abc import Callable
from typing import Any, TypeVar

from .._errors import ParameterError
from .dimension import LENGTH, described
from .parsing import Unit, UnknownUnit, parsed, pint_unit, registry, unit_of

U = TypeVar("U")


def quantity(value: Any, unit: str) -> Any:
    """A value in another unit than the SI unit, as in `Inertia(J=quantity(120.0, "g.cm2"))` or `quantity(3000, "rpm")`.
    A text does for a known number: `Inertia(J="120 g.cm2")`.

    It is a quantity of pint, so `quantity(1.5, "GPa") / quantity(10.0, "cm3")` is one, too. A component converts it to
    the declared unit when it is built, also from a quantity of another pint registry. `value` may be an
    array, and may be traced.

    The unit has the notation of declarations: `N.m.s/rad`, `m3/(s.Pa)`, `cm3/rev`. `degC` is an absolute temperature,
    `delta_degC` a difference. Raises `ParameterError` for an unknown unit.
    """
    return registry().Quantity(value, _named("quantity", pint_unit, unit))


_NUMBER = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?|[+-]?inf)\s*(\S*)\s*")


def written(text: str, where: str) -> tuple[float, str]:
    """The number and the unit in a text such as "15 mm"; the unit may be empty.

    Raises `ParameterError`, naming `where`, for other texts.
    """
    found = _NUMBER.fullmatch(text)
    if found is None:
        raise ParameterError(f"{where} must be a real number, with a unit as in '15 mm' or without, got {text!r}.")
    return float(found[1]), found[2]


def magnitude(value: Any, unit: str, where: str = "magnitude") -> Any:
    """The number of a quantity in a unit; a plain number counts as already in this unit.

    `magnitude(quantity(50.0, "rad/s"), "rpm")` and `magnitude("50 rad/s", "rpm")` are 477.46. The unit "" stands for
    the SI unit of any dimension.

    Raises `ParameterError`, naming `where`, for other texts, for a quantity of another dimension, and for turns per
    time (Hz, 1/min) given as an angular speed (rad/s, rpm) or vice versa, which would lose a factor of 2 pi. A length
    or a volume given for one per angle is refused for the same reason: data sheets often mean one per turn.
    """
    if isinstance(value, str):
        number, own = written(value, where)
        value = registry().Quantity(number, _named(where, pint_unit, own)) if own else number
    if not has_unit(value):
        return value
    given, source = _own(value, where)
    if not unit:
        return given.to_base_units().magnitude
    target = _named(where, parsed, unit)
    if source.dimension != target.dimension:
        raise ParameterError(
            f"{where} is in {described(target.dimension, unit)}, but is given in "
            f"{described(source.dimension, _text(given))}."
        )
    if _confuses_turns(source, target):
        raise ParameterError(
            f"{where} is in {unit}, but is given in {_text(given)}: Hz and 1/min count turns, rad/s and rpm "
            "measure an angle. For turns per minute write rpm, for turns per second rev/s."
        )
    if _lacks_turns(source, target):
        raise ParameterError(
            f"{where} is in {unit}, but is given in {_text(given)}: of a radian or of a turn? "
            f"Write {_text(given)}/rad or {_text(given)}/rev."
        )
    return given.to(pint_unit(unit)).magnitude


def from_si(value: Any, unit: str, where: str) -> Any:
    """The number in a unit of a value in SI units. Raises `ParameterError`, naming `where`, for an unknown unit."""
    target = _named(where, pint_unit, unit)
    return registry().Quantity(value, registry().Quantity(0.0, target).to_base_units().units).to(target).magnitude


def has_unit(value: object) -> bool:
    """Whether a value is a quantity of pint. Does not import pint."""
    pint = sys.modules.get("pint")
    return pint is not None and isinstance(value, pint.Quantity)


def _named(where: str, read: Callable[[str], U], unit: str) -> U:
    """The result of `read` for a unit, with `where` in its error."""
    try:
        return read(unit)
    except UnknownUnit as error:
        raise ParameterError(f"{where}: {error}") from error


def _own(value: Any, where: str) -> tuple[Any, Unit]:
    """The quantity in the registry of this library, and its unit."""
    units = registry()
    try:
        unit = units.Unit(units.UnitsContainer(dict(value.unit_items())))
        return units.Quantity(value.magnitude, unit), unit_of(unit, units)
    except AttributeError as error:  # pint's UndefinedUnitError
        raise ParameterError(
            f"{where} is given in {value.units}, a unit of another registry only: convert it first."
        ) from error
    except UnknownUnit as error:
        raise ParameterError(f"{where}: {error}") from error


def _confuses_turns(a: Unit, b: Unit) -> bool:
    return (a.counts and b.has_angle) or (b.counts and a.has_angle)


def _lacks_turns(given: Unit, declared: Unit) -> bool:
    """Whether a length, area or volume is given for one per angle."""
    is_size = any(declared.dimension == LENGTH**power for power in (1, 2, 3))
    return is_size and declared.has_angle and not given.has_angle


def _text(given: Any) -> str:
    return f"{given.units:~D}".replace(" * ", ".").replace(" ** ", "").replace(" / ", "/") or "1"
