"""Entries of a design: active constraints, limited results and the steps of the search."""

from typing import Literal, NamedTuple

import numpy as np

from ..._units.display import Scale
from .._problem.limits import Limit

ROUNDING = 1e-9  # margin that counts as zero
BROKEN = 1e-6  # relative violation that counts as broken


class Active(NamedTuple):
    """An active limit or bound with its multiplier: the decrease of the objective per unit of relaxation.

    The multiplier of an equation is the decrease per unit of its right-hand side, and can be negative.
    """

    name: str
    side: Literal["<=", ">=", "==", "lower bound", "upper bound"]
    multiplier: float
    scale: Scale


class LimitedResult(NamedTuple):
    """A result with a limit. The margin is relative to the limit, and negative for a violated one."""

    limit: Limit
    value: float

    @property
    def margin(self) -> float:
        """The distance from the limit, as a share of it; negative if the limit is broken."""
        excess = float(self.limit.excess(self.value))
        return 0.0 if abs(excess) < ROUNDING else -excess

    @property
    def is_broken(self) -> bool:
        """Whether the limit is violated by more than rounding errors."""
        return self.margin < -BROKEN

    def row(self) -> tuple[str, ...]:
        """Its line in a table."""
        value = f"{self.limit.scale.value(self.value):.6g}"
        margin = f"{100.0 * self.margin:.3g} %"
        return self.limit.name, value, self.limit.text, margin, "broken" if self.is_broken else ""


class Tried(NamedTuple):
    """An iterate of a search: values of the variables, the objective and the limited results.

    `why` is the reason of a failed one, otherwise empty.
    """

    x: np.ndarray
    objective: float
    results: np.ndarray
    why: str = ""
