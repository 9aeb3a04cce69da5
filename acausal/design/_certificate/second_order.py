"""Second-order conditions of an optimum: the curvature of the Lagrangian on the critical cone.

The critical cone contains the directions d along which, to first order, constraints and bounds with a multiplier stay
constant, and active ones without a multiplier are not violated. At a local minimum d'Hd >= 0 on the cone, with the
Hessian H of the Lagrangian. If the first-order conditions hold and d'Hd > 0, the point is a strict local minimum. See
Nocedal and Wright, Numerical Optimization, 2nd ed. (Springer, 2006), theorems 12.5 and 12.6.

On a polyhedral cone, d'Hd is smallest along an eigenvector of H on one of its faces (a Pareto eigenvector:
Seeger, Linear Algebra Appl. 292 (1999) 1).
"""

import dataclasses
import itertools
from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np
from scipy import linalg

from .first_order import (
    ACTIVE,
    DEPENDENT,
    OPTIMAL,
    Bounds,
    Multipliers,
    Point,
    PointAt,
    multipliers_of,
    residual,
    stationarity,
)

STEP = 1e-3  # step of scaled variables for differences of gradients
CLOSE = 1e-9  # scaled slope or multiplier that counts as zero
FACES = 8  # most active limits without a multiplier for which all faces are examined
WITHIN = 1e-9  # distance from the cone that a unit vector may have


class Eigenpair(NamedTuple):
    """Curvature and slope of the Lagrangian along a unit vector in the critical cone."""

    value: float
    vector: np.ndarray
    slope: float


class Quadratic(NamedTuple):
    """Quadratic model of the Lagrangian in the null space of the constraints and bounds that have a multiplier.

    Columns of `basis` span the null space; `slope` and `hessian` are in this basis. `error` is the uncertainty of the
    Hessian and `kink` the difference between its one-sided values. Rows of `weak` are gradients of active limits
    without a multiplier, in this basis.
    """

    basis: np.ndarray
    slope: np.ndarray
    hessian: np.ndarray
    error: float
    kink: float
    weak: np.ndarray

    @property
    def is_computed(self) -> bool:
        return bool(np.all(np.isfinite(self.hessian)))

    @property
    def has_all_faces(self) -> bool:
        """Whether `pairs` examines all faces of the cone."""
        return len(self.weak) <= FACES

    def pairs(self) -> Iterator[Eigenpair]:
        """Eigenvectors on the faces of the critical cone that point into it, with either sign."""
        numbers = range(len(self.weak))
        sizes = numbers if self.has_all_faces else range(2)
        faces = itertools.chain.from_iterable(itertools.combinations(numbers, size) for size in (*sizes, len(numbers)))
        for face in dict.fromkeys(faces):
            edge = self.weak[list(face)]
            along = linalg.null_space(edge, rcond=DEPENDENT) if len(edge) else np.eye(len(self.slope))
            values, vectors = np.linalg.eigh(along.T @ self.hessian @ along)
            for value, reduced in zip(values.tolist(), vectors.T, strict=True):
                for vector in (along @ reduced, -along @ reduced):
                    if np.all(self.weak @ vector <= WITHIN):
                        yield Eigenpair(value, self.basis @ vector, float(self.slope @ vector))

    @property
    def flat(self) -> list[Eigenpair]:
        """The eigenvectors without curvature."""
        if not self.is_computed or not len(self.slope):
            return []
        return [pair for pair in self.pairs() if abs(pair.value) <= self.error]

    def newton(self) -> np.ndarray:
        """The Newton step along directions of positive curvature."""
        values, vectors = np.linalg.eigh(self.hessian)
        bent = values > self.error
        return -self.basis @ (vectors[:, bent] @ ((vectors[:, bent].T @ self.slope) / values[bent]))


def quadratic_of(
    at: PointAt, point: Point, multipliers: Multipliers, bounds: Bounds, is_equation: np.ndarray, idle: np.ndarray
) -> Quadratic:
    """Quadratic model from differences of exact gradients over `STEP` and 2 `STEP` within the bounds.

    It excludes the variables that `idle` marks.
    """
    unit, strong = np.eye(len(point.z)), multipliers.active(CLOSE)
    rows = (strong.constraints | is_equation) & (np.linalg.norm(point.jacobian, axis=1) > DEPENDENT)
    held = strong.lower | strong.upper | idle | (bounds[0] >= bounds[1])
    fixed = np.concatenate([_unit(point.jacobian[rows]), unit[held]])
    basis = linalg.null_space(fixed, rcond=DEPENDENT) if len(fixed) else unit
    moving = np.flatnonzero(np.any(np.abs(basis) > WITHIN, axis=1))
    hessian, error, kink = _hessian(at, point, multipliers, bounds, moving, basis)
    lower, upper = (~held & (np.abs(point.z - bound) <= ACTIVE) for bound in bounds)
    limits = ~rows & ~is_equation & (np.abs(point.c) <= ACTIVE)
    weak = np.concatenate([point.jacobian[limits], -unit[lower], unit[upper]]) @ basis
    weak = _unit(weak[np.linalg.norm(weak, axis=1) > DEPENDENT])
    return Quadratic(basis, basis.T @ stationarity(point, multipliers), hessian, error, kink, weak)


def _unit(rows: np.ndarray) -> np.ndarray:
    return rows / np.linalg.norm(rows, axis=1, keepdims=True)


def _hessian(
    at: PointAt, point: Point, multipliers: Multipliers, bounds: Bounds, moving: np.ndarray, basis: np.ndarray
) -> tuple[np.ndarray, float, float]:
    """Hessian of the Lagrangian in a basis, with its error and kink."""
    n = basis.shape[1]
    if not n:
        return np.zeros((0, 0)), 0.0, 0.0
    columns = [_column(slopes_along(at, point, multipliers, bounds, variable)) for variable in moving]
    full, errors, kinks = (np.stack(parts, axis=1) for parts in zip(*columns, strict=True))
    if not np.all(np.isfinite(full)):
        return np.full((n, n), np.nan), np.inf, 0.0
    part = basis[moving]
    found, kink = (basis.T @ matrix @ part for matrix in (full, kinks))
    error = np.max(np.abs(errors[moving])) + np.max(np.abs(found - found.T))
    return 0.5 * (found + found.T), float(error), float(np.linalg.norm(kink, 2))


def slopes_along(
    at: PointAt, point: Point, multipliers: Multipliers, bounds: Bounds, variable: int, reach: int = 2
) -> dict[int, np.ndarray]:
    """Gradient of the Lagrangian at multiples of a step of one variable, within the bounds and if computable."""
    found = {0: stationarity(point, multipliers)}
    for k in range(-reach, reach + 1):
        z = point.z + k * STEP * np.eye(len(point.z))[variable]
        if k and bounds[0][variable] <= z[variable] <= bounds[1][variable] and (side := at(z)) is not None:
            found[k] = stationarity(side, multipliers)
    return found


def _column(slopes: dict[int, np.ndarray]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A column of the Hessian, its error, and the difference between its one-sided values."""
    none = np.zeros(len(slopes[0]))
    sides = one_sided_derivatives(slopes, STEP)
    if len(sides) == 2:
        once, twice = ((slopes[k] - slopes[-k]) / (2.0 * k * STEP) for k in (1, 2))
        return (4.0 * once - twice) / 3.0, (once - twice) / 3.0, sides[0] - sides[1]
    if len(sides) == 1:
        sign = 1 if 1 in slopes else -1
        return sides[0], sides[0] - sign * (slopes[sign] - slopes[0]) / STEP, none
    return none + np.nan, none, none


def one_sided_derivatives(values: Mapping[int, np.ndarray], step: float) -> list[np.ndarray]:
    """Second-order one-sided derivatives, right then left, from values at multiples of a step.

    A side with a missing value is left out.
    """
    sides = {sign: [values[sign * k] for k in (0, 1, 2)] for sign in (1, -1) if {sign, 2 * sign} <= values.keys()}
    return [sign * (4.0 * once - twice - 3.0 * here) / (2.0 * step) for sign, (here, once, twice) in sides.items()]


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
