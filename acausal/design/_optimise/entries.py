"""Entries of a design: active constraints, limited results, sensitivities and the steps of the search."""

from typing import Literal, NamedTuple

import numpy as np

from ..._units.display import Scale
from .._problem.limits import Limit

ROUNDING = 1e-9  # of a margin
BROKEN = 1e-6  # share of a limit


class Active(NamedTuple):
    """A limit or bound that holds the optimum, with its multiplier: the fall of the objective per unit of relaxation.

    The multiplier of an equation is the fall of the objective per rise of the right-hand side, and may be negative.
    """

    name: str
    side: Literal["<=", ">=", "==", "lower bound", "upper bound"]
    multiplier: float
    scale: Scale


class LimitedResult(NamedTuple):
    """A result that has a limit, and the fraction of the limit that is left; negative where it is broken."""

    limit: Limit
    value: float

    @property
    def margin(self) -> float:
        excess = self.limit.violation(self.value) if self.limit.is_equation else self.limit.excess(self.value)
        return 0.0 if abs(excess) < ROUNDING else -float(excess)

    @property
    def is_broken(self) -> bool:
        return self.margin < -BROKEN

    def row(self) -> tuple[str, ...]:
        """Its line in a table."""
        value = f"{self.limit.scale.value(self.value):.6g}"
        margin = f"{100.0 * self.margin:.3g} %"
        return self.limit.name, value, self.limit.text, margin, "broken" if self.is_broken else ""


class Sensitivity(NamedTuple):
    """The derivative of the optimum by a parameter that is not free, all that is free following."""

    path: str
    value: float
    unit: str
    slope: float

    @property
    def per_percent(self) -> float:
        """The change of the optimum for 1 % more of the parameter."""
        return 0.01 * self.value * self.slope


class Tried(NamedTuple):
    """A design on the way: the values of the variables, of the objective and of the limited results.

    `why` says why it could not be computed, and is empty where it could.
    """

    x: np.ndarray
    objective: float
    results: np.ndarray
    why: str = ""
