"""Derivatives by differences on one side."""

from collections.abc import Mapping

import numpy as np


def from_sides(values: Mapping[int, np.ndarray], step: float) -> list[np.ndarray]:
    """The derivatives to the right and to the left of a place, of second order, by values at multiples of a step.

    A side of which a value is missing is left out.
    """
    sides = {sign: [values[sign * k] for k in (0, 1, 2)] for sign in (1, -1) if {sign, 2 * sign} <= values.keys()}
    return [sign * (4.0 * once - twice - 3.0 * here) / (2.0 * step) for sign, (here, once, twice) in sides.items()]
