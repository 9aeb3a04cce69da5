"""Conversion of the arguments of constructors."""

import dataclasses
import inspect
import math
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
from jax import Array

from .._errors import ParameterError
from .._numbers import Numbers
from .._units.quantity import magnitude


def as_parameter(value: Any, *, unit: str, where: str) -> Array:
    """An array of floats in double precision, in `unit`; an integer would break differentiation.

    Raises `ParameterError` for anything except real numbers and arrays of them.
    """
    value = magnitude(value, unit, where)
    if isinstance(value, float | int):
        return jnp.asarray(value, dtype=float)
    if value is None or any(isinstance(item, str) for item in jax.tree_util.tree_leaves(value)):
        raise _not_a_number(value, where)
    try:
        array = jnp.asarray(value)
    except (TypeError, ValueError) as error:
        raise _not_a_number(value, where) from error
    if jnp.iscomplexobj(array):
        raise _not_a_number(value, where)
    return array.astype(float)


def _not_a_number(value: object, where: str) -> ParameterError:
    has_digits = isinstance(value, str) and value[:1].isdigit()
    remedy = ' A number with a unit is quantity(11.0, "cm3/rev").' if has_digits else ""
    return ParameterError(f"{where} must be a real number or an array of them, got {value!r}.{remedy}")


def as_start(value: Any, *, unit: str, where: str) -> Numbers | None:
    """A start value. A float stays one: `eqx.filter_grad` skips start values unless they are given as arrays."""
    if value is None:
        return None
    value = magnitude(value, unit, where)
    return float(value) if isinstance(value, bool | int | float) else as_parameter(value, unit=unit, where=where)


@dataclasses.dataclass(frozen=True)
class Converter:
    """Conversion of the value of one field."""

    convert: Callable[..., object]
    unit: str
    where: str

    # Equinox reads the signature of each converter. To derive it from the code would take a third of the time to create
    # a class.
    __signature__ = inspect.Signature([inspect.Parameter("value", inspect.Parameter.POSITIONAL_ONLY)])

    def __call__(self, value: object) -> object:
        return self.convert(value, unit=self.unit, where=self.where)


CONVERTERS = {"param": as_parameter, "var": as_start, "flow": as_start, "time": as_start, "discrete": as_start}


def plain_number(kind: type) -> Callable[[Any], Any] | None:
    """A converter for fields annotated as plain numbers; None for others.

    Models are cached by their static fields, where 1, 1.0 and True are equal, as are 0.0 and -0.0. So the converter
    turns an equal number into one of the annotated type.
    """
    if kind not in (bool, int, float):
        return None

    def converted(value: Any) -> Any:
        if type(value) not in (bool, int, float) or not math.isfinite(value):
            return value
        return kind(value + 0) if kind(value) == value else value

    return converted
