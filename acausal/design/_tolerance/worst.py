"""Worst case: the smallest and the largest value of a result within a tolerance box."""

import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.optimize import minimize

from ..._analyse.table import aligned
from ..._errors import SimulationError
from ..._units.display import Scale
from .._compute.evaluator import CHANGED, Evaluator

REFUSED = 1e6  # scaled value of a point that cannot be computed


@dataclasses.dataclass(frozen=True)
class Worst:
    """Both ends of a result within the tolerances, with their parameters by name; `print` it for a table.

    `jumps`: parameters that change the result although its derivatives are zero, because it counts or rounds. Larger
    and smaller values may then exist.
    """

    result: str
    scale: Scale
    low: float
    high: float
    at_low: Mapping[str, float]
    at_high: Mapping[str, float]
    evaluations: int
    units: tuple[str, ...] = ()
    jumps: tuple[str, ...] = ()

    def __str__(self) -> str:
        ends = [f"{self.scale.value(value):.6g}{self.scale.text}" for value in (self.low, self.high)]
        scales = map(Scale.of, self.units or ("",) * len(self.at_low))
        rows = [
            [name, *(f"{scale.value(place[name]):.6g}" for place in (self.at_low, self.at_high)), scale.shown]
            for name, scale in zip(self.at_low, scales, strict=True)
        ]
        table = aligned([[f"worst case of {self.result}", *ends, ""], *rows])
        names = ", ".join(self.jumps)
        note = f"\n{self.result} jumps with {names}, where its derivatives are zero: other values may be worse"
        return table + (note if names else "")


def worst(
    evaluator: Evaluator, row: int, box: np.ndarray, gradient: np.ndarray, scale: Scale, starts: int, seed: int,
) -> Worst:  # fmt: skip
    """Both ends, each the best of several searches."""
    before = evaluator.evaluations
    ends = [_end(evaluator, row, box, sign, gradient, starts, seed) for sign in (1.0, -1.0)]
    (low, at_low, below), (high, at_high, above) = ends
    free = evaluator.free
    places = [dict(zip(free.names, x.tolist(), strict=True)) for x in (at_low, at_high)]
    effort = evaluator.evaluations - before
    jumps = tuple(name for i, name in enumerate(free.names) if i in below | above)
    return Worst(evaluator.names[row], scale, low, high, places[0], places[1], effort, free.units, jumps)


def _end(
    evaluator: Evaluator, row: int, box: np.ndarray, sign: float, gradient: np.ndarray, starts: int, seed: int
) -> tuple[float, np.ndarray, set[int]]:
    """The minimum of `sign` times the result, its place, and variables that change it there without a derivative."""
    low, width = box[:, 0], box[:, 1] - box[:, 0]
    size = float(np.sum(np.abs(gradient) * width)) or 1.0
    corner = np.where(sign * gradient > 0.0, 0.0, 1.0)
    # In the corner itself the search would end immediately.
    places = [0.02 + 0.96 * corner, *np.random.default_rng(seed).random((max(starts - 1, 0), len(low)))]

    def function(z: np.ndarray) -> tuple[float, np.ndarray]:
        found = evaluator(low + width * z)
        if not found.is_good:
            return REFUSED, np.zeros(len(low))
        return sign * found.values[row] / size, sign * found.jacobian[row] * width / size

    options: Any = dict(ftol=1e-14, gtol=1e-10)
    ends = [
        minimize(function, z, jac=True, method="L-BFGS-B", bounds=[(0.0, 1.0)] * len(low), options=options)
        for z in places
    ]
    best = min(ends, key=lambda end: float(end.fun))
    if best.fun >= REFUSED:
        raise SimulationError("No design within the tolerances could be computed.")
    value, z, jumps = float(best.fun), np.array(best.x), set[int]()
    for i in np.flatnonzero(function(z)[1] == 0.0).tolist():
        for end in (0.0, 1.0):
            other = np.where(np.arange(len(z)) == i, end, z)
            lower, slopes = function(other)
            if lower < REFUSED and slopes[i] == 0.0 and abs(lower - value) > CHANGED * max(abs(lower), abs(value)):
                value, z = (lower, other) if lower < value else (value, z)
                jumps.add(i)
    return sign * size * value, low + width * z, jumps
