"""What curvature says of a place: a minimum, none, or undecided; and which steps lead on from it."""

import dataclasses
from collections.abc import Iterator

import numpy as np

from .first_order import OPTIMAL, Multipliers, multipliers_of, residual, stationarity
from .point import Bounds, Point, PointAt
from .second_order import CLOSE, STEP, Eigenpair, Quadratic

ROUGH = 1e-3  # share of a curvature by which those to both sides may differ by errors of differences
REACH = 0.1  # of scaled variables: a step aside


@dataclasses.dataclass(frozen=True)
class Curvature:
    """The second-order conditions at the end of a search.

    - `eigenvalues` of the Hessian of the Lagrangian on the directions that constraints and bounds with a multiplier
      leave free; `error` is how uncertain they are, and `kink` by how much the Hessians to both sides of the place
      differ: not at all, unless first derivatives have a kink there.
    - `least`: the least curvature along directions that do not break active limits either; infinite without any.
    - `distance`: how far Newton's step leads, as the largest share of a range.
    - `is_level`: whether the first-order conditions are met aside of the place as well, along all directions without
      curvature.
    """

    eigenvalues: np.ndarray
    error: float
    kink: float = 0.0
    least: float = np.nan
    distance: float = 0.0
    is_level: bool = False

    @property
    def is_minimum(self) -> bool:
        """Whether the second-order conditions of a local minimum are met."""
        return self.verdict.startswith(("a strict", "a vertex", "a local minimum"))

    @property
    def is_far(self) -> bool:
        """Whether there is curvature, but slope as well: the minimum is elsewhere."""
        return self.distance > STEP

    @property
    def verdict(self) -> str:
        if np.isinf(self.least):
            return "a vertex: as many limits are active as variables are free"
        if not np.all(np.isfinite(self.eigenvalues)):
            return "unknown: what lies beside it cannot be computed"
        size = float(np.max(np.abs(self.eigenvalues)))
        rough = 0.5 * self.kink if self.kink > ROUGH * size else 0.0
        if self.is_far:
            return f"no minimum: by slope and curvature, one may be {self.distance:.2g} ranges away"
        if self.least > max(self.error, rough):
            return "a strict local minimum"
        if rough > max(self.error, abs(self.least)):
            return "undecided: it has no second derivatives, but a kink in the first ones"
        if self.least < -self.error:
            return "no minimum: the objective falls to second order"
        return "a local minimum, flat in some directions" if self.is_level else "undecided: it is flat"


UNKNOWN = Curvature(np.full(1, np.nan), np.inf)


def curvature_of(at: PointAt, point: Point, quadratic: Quadratic, bounds: Bounds, is_equation: np.ndarray) -> Curvature:
    """The curvature at a point, from the quadratic model there."""
    if not len(quadratic.slope):
        return Curvature(np.zeros(0), 0.0, least=np.inf)
    if not quadratic.is_computed:
        return UNKNOWN
    pairs, eigenvalues = list(quadratic.pairs()), np.linalg.eigvalsh(quadratic.hessian)
    least = min((pair.value for pair in pairs), default=np.inf)
    if not quadratic.has_all_faces and eigenvalues[0] <= quadratic.error:
        least = min(least, 0.0)
    flat = [pair for pair in pairs if abs(pair.value) <= quadratic.error]
    scale = max(float(np.max(np.abs(point.gradient))), float(np.max(np.abs(eigenvalues))))
    return Curvature(
        eigenvalues,
        quadratic.error,
        quadratic.kink,
        least,
        float(np.max(np.abs(quadratic.newton()))),
        quadratic.has_all_faces and all(_is_level(at, point, pair, bounds, is_equation, scale) for pair in flat),
    )


def _aside(at: PointAt, point: Point, pair: Eigenpair, bounds: Bounds) -> Point | None:
    return at(np.clip(point.z + REACH * pair.vector, *bounds))


def _falls_aside(at: PointAt, point: Point, pair: Eigenpair, multipliers: Multipliers, bounds: Bounds) -> bool:
    """Whether the Lagrangian falls further at a step aside."""
    aside = _aside(at, point, pair, bounds)
    return aside is not None and bool(stationarity(aside, multipliers) @ pair.vector < -CLOSE)


def _is_level(
    at: PointAt, point: Point, pair: Eigenpair, bounds: Bounds, is_equation: np.ndarray, scale: float
) -> bool:  # fmt: skip
    """Whether the first-order conditions are met aside, too."""
    aside = _aside(at, point, pair, bounds)
    if aside is None:
        return False
    return residual(aside, multipliers_of(aside, bounds, is_equation), is_equation, scale) <= OPTIMAL


def ways(
    at: PointAt, point: Point, multipliers: Multipliers, quadratic: Quadratic, bounds: Bounds
) -> Iterator[np.ndarray]:
    """Steps from a point along which the Lagrangian falls: Newton's step, directions of negative curvature, and
    directions without curvature along which it has a slope here or aside.
    """
    if not quadratic.is_computed or not len(quadratic.slope):
        return
    newton = quadratic.newton()
    if np.max(np.abs(newton)) > STEP:
        yield newton
    for pair in sorted(quadratic.pairs(), key=lambda pair: (pair.value, pair.slope)):
        if pair.value < -quadratic.error and pair.slope <= CLOSE:
            yield REACH * pair.vector
        elif abs(pair.value) <= quadratic.error and pair.slope < -CLOSE:
            yield pair.vector
        elif abs(pair.value) <= quadratic.error and _falls_aside(at, point, pair, multipliers, bounds):
            yield REACH * pair.vector
