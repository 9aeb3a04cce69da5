"""The choices of tables, with their ordinals in the Modelica Standard Library, and their data."""

import enum
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from ...._errors import ModelError


class Smoothness(enum.IntEnum):
    LINEAR = 1
    AKIMA = 2
    CONSTANT = 3
    FRITSCH_BUTLAND = 4
    STEFFEN = 5
    MODIFIED_AKIMA = 6


class Extrapolation(enum.IntEnum):
    HOLD = 1
    LINE = 2
    PERIODIC = 3
    NONE = 4


class TimeEvents(enum.IntEnum):
    ALWAYS = 1
    JUMPS = 2
    NEVER = 3


CUBIC = (Smoothness.AKIMA, Smoothness.FRITSCH_BUTLAND, Smoothness.STEFFEN, Smoothness.MODIFIED_AKIMA)


def library_of(*values: Any) -> Any:
    """NumPy for known arrays, otherwise that of jax."""
    return jnp if any(isinstance(value, jax.Array) for value in values) else np


def as_array(values: Any) -> Any:
    return library_of(values).asarray(values, float)


def increasing(knots: Any, what: str, *, strictly: bool) -> None:
    """Raises `ModelError` for known abscissas that do not increase."""
    if isinstance(knots, np.ndarray):
        steps = np.diff(knots)
        if np.any(steps <= 0.0 if strictly else steps < 0.0):
            word = "strictly " if strictly else ""
            raise ModelError(f"the {what} of a table must be {word}increasing, got {knots.tolist()}.")


def within(u: Any, knots: Any, extrapolation: Extrapolation) -> Any:
    """u in the range of the knots: its nearest end, or moved by whole periods."""
    first, last = knots[0], knots[-1]
    xp = library_of(u, knots)
    if len(knots) == 1 or extrapolation is not Extrapolation.PERIODIC:
        # The derivative of `clip` at an end is one half.
        return xp.where(u < first, first, xp.where(u > last, last, u))
    period = last - first
    above, below = xp.ceil((u - last) / period), xp.ceil((first - u) / period)
    return u - period * xp.maximum(above, 0.0) + period * xp.maximum(below, 0.0)


def interval(u: Any, knots: Any, last: int) -> Any:
    """The index of the interval that contains u, at most the last one; at a knot the one to its right."""
    xp = library_of(u, knots)
    return xp.clip(xp.searchsorted(xp.asarray(knots), u, side="right") - 1, 0, last)


def refused(value: Any, u: Any, inside: Any, extrapolation: Extrapolation) -> Any:
    """The value; where the table must not be extrapolated, an error if u is known, otherwise not a number."""
    if extrapolation is not Extrapolation.NONE:
        return value
    if library_of(u, inside) is np:
        if np.any(np.asarray(u) != inside):
            raise ModelError(f"a table without extrapolation has no value at {u}.")
        return value
    return jnp.where(u == inside, value, jnp.nan)
