"""The first- and second-order conditions of an optimum, whatever found it.

At a local minimum of f with c <= 0, within bounds, there are multipliers that are not negative with

    grad f + sum_i lambda_i grad c_i + (upper - lower bound multipliers) = 0,    lambda_i c_i = 0,

and the Hessian of the Lagrangian is not negative on all directions in which active constraints stay as they are. See
Nocedal and Wright, Numerical Optimization, 2nd ed. (Springer, 2006), chapter 12.
"""

import dataclasses
from typing import NamedTuple

import numpy as np
from scipy import linalg, optimize

from ._differences import from_sides
from ._solve import At
from ._task import Point

ACTIVE = 1e-6  # of the size of a limit, or of the distance of the bounds
DEPENDENT = 1e-6  # gradients, scaled to length 1, depend on each other where they differ by less
SHARE = 1e-3  # least share of a gradient that takes part in a combination that vanishes
STEP = 1e-3  # of scaled variables, for differences of gradients
ROUGH = 1e-3  # a difference of scaled curvatures to both sides that is no rounding


class Multipliers(NamedTuple):
    """Scaled: of the constraints and of the lower and upper bounds, zero where these are not active."""

    constraints: np.ndarray
    lower: np.ndarray
    upper: np.ndarray

    def active(self, least: float = 0.0) -> "Multipliers":
        """Which of them are above `least`, as truth values."""
        return Multipliers(*(np.abs(values) > least for values in self))


@dataclasses.dataclass(frozen=True)
class Curvature:
    """Eigenvalues of the Hessian of the Lagrangian on the free subspace, how uncertain they are, and by how much the
    Hessians to both sides of the place differ: not at all, unless first derivatives have a kink there.
    """

    eigenvalues: np.ndarray
    error: float
    kink: float = 0.0

    @property
    def verdict(self) -> str:
        if not len(self.eigenvalues):
            return "a vertex: as many limits are active as variables are free"
        if not np.all(np.isfinite(self.eigenvalues)):
            return "unknown: what lies beside it cannot be computed"
        least, rough = float(np.min(self.eigenvalues)), 0.5 * self.kink if self.kink > ROUGH else 0.0
        if least > max(self.error, rough):
            return "a strict local minimum"
        if rough > max(self.error, abs(least)):
            return "undecided: it has no second derivatives, but a kink in the first ones"
        return "no minimum: the objective falls to second order" if least < -self.error else "undecided: it is flat"


def multipliers_of(
    point: Point, bounds: tuple[np.ndarray, np.ndarray], is_equation: np.ndarray, within: float = ACTIVE
) -> Multipliers:
    """The multipliers that come closest to making the point stationary, by least squares over what is active.

    Those of inequalities and bounds are not negative: where the unrestricted ones have a wrong sign, the point is no
    optimum, and the residual says so.
    """
    places, columns = _active(point, bounds, is_equation, within)
    found = np.zeros(columns.shape[1])
    if len(found):
        n_bounds = len(places.lower) + len(places.upper)
        least = np.where(np.append(is_equation[places.constraints], np.zeros(n_bounds, bool)), -np.inf, 0.0)
        found = linalg.lstsq(columns, -point.gradient)[0]  # pyright: ignore[reportOptionalSubscript]
        if np.any(found < least):
            found = optimize.lsq_linear(columns, -point.gradient, (least, np.inf), method="bvls", tol=1e-14).x
    return _spread(point, places, found)


def ambiguous(
    point: Point, bounds: tuple[np.ndarray, np.ndarray], is_equation: np.ndarray, within: float = ACTIVE
) -> Multipliers:
    """Which multipliers are not unique, as truth values: the gradients of what is active depend on each other there.

    A constraint whose gradient vanishes does not count.
    """
    places, columns = _active(point, bounds, is_equation, within)
    lengths = np.linalg.norm(columns, axis=0)
    shares, moves = np.zeros(len(lengths)), lengths > 0.0
    if np.any(moves):
        null = linalg.null_space(columns[:, moves] / lengths[moves], rcond=DEPENDENT)
        shares[moves] = np.max(np.abs(null), axis=1, initial=0.0)
    return _spread(point, places, shares).active(SHARE)


def unmoved(point: Point, is_equation: np.ndarray, within: float = ACTIVE) -> np.ndarray:
    """Which active constraints no variable moves, to first order: they have no price."""
    return (is_equation | (point.c >= -within)) & ~np.any(point.jacobian, axis=1)


def _active(
    point: Point, bounds: tuple[np.ndarray, np.ndarray], is_equation: np.ndarray, within: float
) -> tuple[Multipliers, np.ndarray]:
    """Where constraints and bounds are active, and in columns the gradients of all of them."""
    rows = np.flatnonzero(is_equation | (np.abs(point.c) <= within))
    lower, upper = (np.flatnonzero(np.abs(point.z - bound) <= within) for bound in bounds)
    unit = np.eye(len(point.z))
    return Multipliers(rows, lower, upper), np.concatenate([point.jacobian[rows], -unit[lower], unit[upper]]).T


def _spread(point: Point, places: Multipliers, values: np.ndarray) -> Multipliers:
    """`values`, of which there is one for each active place, put at these places; zero elsewhere."""
    n = len(point.z)
    made = Multipliers(np.zeros(len(point.c)), np.zeros(n), np.zeros(n))
    ends = np.cumsum([len(places.constraints), len(places.lower)])
    for target, where, part in zip(made, places, np.split(values, ends), strict=True):
        target[where] = part
    return made


def stationarity(point: Point, multipliers: Multipliers) -> np.ndarray:
    """The gradient of the Lagrangian."""
    return point.gradient + multipliers.constraints @ point.jacobian - multipliers.lower + multipliers.upper


def residual(point: Point, multipliers: Multipliers, is_equation: np.ndarray) -> float:
    """The largest of what is left of stationarity, of the limits that are broken, and of lambda_i c_i."""
    broken = np.where(is_equation, np.abs(point.c), np.maximum(point.c, 0.0))
    slack = multipliers.constraints * point.c
    return float(max(np.max(np.abs(part), initial=0.0) for part in (stationarity(point, multipliers), broken, slack)))


def free_directions(point: Point, multipliers: Multipliers, idle: np.ndarray) -> np.ndarray:
    """An orthonormal basis, in columns, of the directions that change, to first order, neither the constraints and
    bounds with a multiplier nor the variables that do not matter, which `idle` marks.
    """
    unit, active = np.eye(len(point.z)), multipliers.active()
    held = np.concatenate([point.jacobian[active.constraints], unit[active.lower | active.upper | idle]])
    return linalg.null_space(held) if len(held) else unit


UNKNOWN = Curvature(np.full(1, np.nan), np.inf)


def curvature(at: At, point: Point, multipliers: Multipliers, idle: np.ndarray, step: float = STEP) -> Curvature:
    """The Hessian on the free subspace by differences of exact gradients, over `step` and 2 `step`.

    The subspace is without the variables that do not matter, which `idle` marks.
    """
    basis = free_directions(point, multipliers, idle)
    if not basis.shape[1]:
        return Curvature(np.zeros(0), 0.0)
    slopes = [_slopes(at, point, multipliers, basis, direction, step) for direction in basis.T]
    once, twice = (np.stack([(s[k] - s[-k]) / (2.0 * k * step) for s in slopes], axis=1) for k in (1, 2))
    best = (4.0 * once - twice) / 3.0
    if not np.all(np.isfinite(best)):
        return Curvature(np.full(basis.shape[1], np.nan), np.inf)
    error = np.max(np.abs(once - twice)) / 3.0 + np.max(np.abs(best - best.T))
    right, left = np.moveaxis(np.array([from_sides(s, step) for s in slopes]), 1, 0)
    kink = float(np.linalg.norm(right - left, 2))
    return Curvature(np.linalg.eigvalsh(0.5 * (best + best.T)), float(error), kink)


def _slopes(
    at: At, point: Point, multipliers: Multipliers, basis: np.ndarray, direction: np.ndarray, step: float
) -> dict[int, np.ndarray]:
    """The gradient of the Lagrangian on the basis, at multiples of a step along a direction."""
    found = {}
    for k in (-2, -1, 0, 1, 2):
        side = at(point.z + k * step * direction) if k else point
        found[k] = np.full(basis.shape[1], np.nan) if side is None else basis.T @ stationarity(side, multipliers)
    return found
