"""Which parameters cause the variance of a result."""

import dataclasses
from collections.abc import Sequence

from .._analyse.table import aligned
from .._units.display import Scale


@dataclasses.dataclass(frozen=True)
class Cause:
    """The part that the scatter of one parameter has in the variance of a result, to first order.

    `std`: standard deviation of the parameter, in its declared unit. `change`: that of the result for one such standard
    deviation. `share`: of the variance; with correlated parameters it may be negative. All shares sum to one.
    """

    parameter: str
    scale: Scale
    std: float
    change: float
    share: float


def table_of(result: str, scale: Scale, causes: Sequence[Cause]) -> str:
    """Lines of causes, the largest share first."""
    rows = [
        [
            cause.parameter,
            f"{cause.share:.4f}",
            f"{scale.difference(cause.change):.4g}",
            f"{cause.scale.difference(cause.std):.4g}",
            cause.scale.unit,
        ]
        for cause in sorted(causes, key=lambda cause: -abs(cause.share))
    ]
    return aligned([[f"variance of {result}", "share", scale.headed("change"), "for std", "unit"], *rows])
