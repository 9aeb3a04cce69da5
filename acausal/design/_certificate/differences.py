"""One-sided differences."""

from collections.abc import Mapping

import numpy as np


def from_sides(values: Mapping[int, np.ndarray], step: float) -> list[np.ndarray]:
    """Second-order one-sided derivatives, right then left, from values at multiples of a step.

    A side with a missing value is left out.
    """
    sides = {sign: [values[sign * k] for k in (0, 1, 2)] for sign in (1, -1) if {sign, 2 * sign} <= values.keys()}
    return [sign * (4.0 * once - twice - 3.0 * here) / (2.0 * step) for sign, (here, once, twice) in sides.items()]
