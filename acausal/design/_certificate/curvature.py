"""Classification of a point by its curvature, and descent directions from it."""

import dataclasses
from collections.abc import Iterator

import numpy as np

from .first_order import OPTIMAL, Bounds, Multipliers, Point, PointAt, multipliers_of, residual, stationarity
from .second_order import CLOSE, STEP, Eigenpair, Quadratic

ROUGH = 1e-3  # relative difference of one-sided curvatures within the error of differences
REACH = 0.1  # trial step of scaled variables


@dataclasses.dataclass(frozen=True)
class Curvature:
    """Second-order conditions at the end of a search.

    - `eigenvalues` of the Hessian of the Lagrangian in the null space of the constraints and bounds that have a
      multiplier. `error` is their uncertainty, and `kink` the difference between the one-sided Hessians, zero unless
      the first derivatives have a kink.
    - `least`: the smallest curvature in the critical cone; infinite if the cone contains no direction.
    - `distance`: the length of the Newton step, as the largest share of a range.
    - `is_level`: whether the first-order conditions also hold a step away along all directions without curvature.
    """

    eigenvalues: np.ndarray
    error: float
    kink: float = 0.0
    least: float = np.nan
    distance: float = 0.0
    is_level: bool = False

    @property
    def is_minimum(self) -> bool:
        """Whether the second-order conditions of a local minimum hold."""
        return self.verdict.startswith(("a strict", "a vertex", "a local minimum"))

    @property
    def is_far(self) -> bool:
        """Whether the Newton step leads away from the point."""
        return self.distance > STEP

    @property
    def verdict(self) -> str:
        """The second-order conditions in words."""
        if np.isinf(self.least):
            return "a vertex: as many limits are active as variables are free"
        if not np.all(np.isfinite(self.eigenvalues)):
            return "unknown: no design next to it can be computed"
        size = float(np.max(np.abs(self.eigenvalues)))
        rough = 0.5 * self.kink if self.kink > ROUGH * size else 0.0
        if self.is_far:
            return f"not a minimum: the Newton step leads {self.distance:.2g} ranges away"
        if self.least > max(self.error, rough):
            return "a strict local minimum"
        if rough > max(self.error, abs(self.least)):
            return "undecided: the first derivatives have a kink"
        if self.least < -self.error:
            return "not a minimum: the curvature is negative"
        return "a local minimum, flat in some directions" if self.is_level else "undecided: the objective is flat"


UNKNOWN = Curvature(np.full(1, np.nan), np.inf)


def curvature_of(at: PointAt, point: Point, quadratic: Quadratic, bounds: Bounds, is_equation: np.ndarray) -> Curvature:
    """Curvature at a point from its quadratic model."""
    if not len(quadratic.slope):
        return Curvature(np.zeros(0), 0.0, least=np.inf)
    if not quadratic.is_computed:
        return UNKNOWN
    pairs, eigenvalues = list(quadratic.pairs()), np.linalg.eigvalsh(quadratic.hessian)
    least = min((pair.value for pair in pairs), default=np.inf)
    if not quadratic.has_all_faces and eigenvalues[0] <= quadratic.error:
        least = min(least, 0.0)
    scale = max(float(np.max(np.abs(point.gradient))), float(np.max(np.abs(eigenvalues))))
    return Curvature(
        eigenvalues,
        quadratic.error,
        quadratic.kink,
        least,
        float(np.max(np.abs(quadratic.newton()))),
        quadratic.has_all_faces
        and all(_is_level(at, point, pair, bounds, is_equation, scale) for pair in quadratic.flat),
    )


def _trial_point(at: PointAt, point: Point, pair: Eigenpair, bounds: Bounds) -> Point | None:
    return at(np.clip(point.z + REACH * pair.vector, *bounds))


def _decreases_further(at: PointAt, point: Point, pair: Eigenpair, multipliers: Multipliers, bounds: Bounds) -> bool:
    """Whether the Lagrangian decreases further after a trial step."""
    trial = _trial_point(at, point, pair, bounds)
    return trial is not None and bool(stationarity(trial, multipliers) @ pair.vector < -CLOSE)


def _is_level(
    at: PointAt, point: Point, pair: Eigenpair, bounds: Bounds, is_equation: np.ndarray, scale: float
) -> bool:  # fmt: skip
    """Whether the first-order conditions also hold after a trial step."""
    trial = _trial_point(at, point, pair, bounds)
    if trial is None:
        return False
    return residual(trial, multipliers_of(trial, bounds, is_equation), is_equation, scale) <= OPTIMAL


def descent_steps(
    at: PointAt, point: Point, multipliers: Multipliers, quadratic: Quadratic, bounds: Bounds
) -> Iterator[np.ndarray]:
    """Steps along which the Lagrangian decreases: the Newton step, directions of negative curvature, and directions
    without curvature along which it has a slope at the point or after a trial step.
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
        elif abs(pair.value) <= quadratic.error and _decreases_further(at, point, pair, multipliers, bounds):
            yield REACH * pair.vector
