"""Positions of sliders."""

from collections.abc import Sequence

import numpy as np

from .._problem.free import Free

COUNT = 101  # positions between the bounds


def positions(free: Free, x: Sequence[float]) -> list[dict[float, float]]:
    """The positions of the slider of each parameter: numbers as shown, and the values in the declared unit.

    They lie between the bounds, evenly or logarithmically spaced like the scaled variables, with four digits, and
    include the bounds and the values `x`.
    """
    shares = np.linspace(0.0, 1.0, COUNT)[:, None] * np.ones(len(free.variables))
    columns = np.asarray([free.unscaled(row) for row in shares]).T
    found = []
    for variable, column, value in zip(free.variables, columns, x, strict=True):
        scale = variable.scale
        rounded = [float(f"{number:.4g}") for number in scale.value(column).tolist()]
        made = {number: scale.zero + scale.factor * number for number in rounded}
        exact = {float(f"{scale.value(one):.7g}"): one for one in (variable.low, variable.high, value)}
        inside = {number: one for number, one in made.items() if variable.low < one < variable.high}
        found.append(dict(sorted((inside | exact).items())))
    return found
