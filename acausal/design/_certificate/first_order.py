"""First-order (KKT) conditions of an optimum.

At a local minimum of f with c <= 0, within bounds, there are non-negative multipliers with

    grad f + sum_i lambda_i grad c_i + (upper - lower bound multipliers) = 0,    lambda_i c_i = 0,

if a constraint qualification holds, such as that of Mangasarian and Fromovitz: some direction leads inside all active
limits, to first order, along equations with independent gradients. Otherwise multipliers need not exist, or they are
unbounded nearby. See Nocedal and Wright, Numerical Optimization, 2nd ed. (Springer, 2006), chapter 12.
"""

from collections.abc import Callable
from typing import NamedTuple, TypeAlias

import numpy as np
from scipy import linalg, optimize

FEASIBLE = 1e-7  # largest violation of a constraint that counts as none, relative to the size of its limit

Bounds: TypeAlias = tuple[np.ndarray, np.ndarray]


class Point(NamedTuple):
    """A point `z` with objective `f` and constraints `c` <= 0, or `c` = 0 for equations."""

    z: np.ndarray
    f: float
    gradient: np.ndarray
    c: np.ndarray
    jacobian: np.ndarray


PointAt: TypeAlias = Callable[[np.ndarray], Point | None]  # None if nothing can be computed there


def violation(point: Point, is_equation: np.ndarray) -> float:
    """The largest constraint violation."""
    broken = np.where(is_equation, np.abs(point.c), np.maximum(point.c, 0.0))
    return float(np.max(broken, initial=0.0))


OPTIMAL = 1e-6  # tolerance of the KKT residual
NEAR = 1e-3  # tolerance of active constraints at an inaccurate point
ACTIVE = 1e-6  # tolerance of active constraints, relative to the size of the limit or the distance of the bounds
DEPENDENT = 1e-6  # norm of a scaled gradient, or of a combination of gradients, that counts as zero
UNQUALIFIED = FEASIBLE**0.5  # the gradient of x^2 where x^2 is FEASIBLE
SHARE = 1e-3  # least share of a gradient in a vanishing combination


class Multipliers(NamedTuple):
    """Scaled multipliers of the constraints and bounds, zero for inactive ones."""

    constraints: np.ndarray
    lower: np.ndarray
    upper: np.ndarray

    def active(self, least: float = 0.0) -> "Multipliers":
        """Truth values: which of them are above `least`."""
        return Multipliers(*(np.abs(values) > least for values in self))


def multipliers_of(point: Point, bounds: Bounds, is_equation: np.ndarray, within: float = ACTIVE) -> Multipliers:
    """The smallest multipliers that minimise the gradient of the Lagrangian, by least squares over active constraints.

    Multipliers of inequalities and bounds are restricted to non-negative values. If that restriction is active, the
    point is not an optimum and has a large residual.
    """
    places, columns = _active(point, bounds, is_equation, within)
    found = np.zeros(columns.shape[1])
    if len(found):
        n_bounds = len(places.lower) + len(places.upper)
        least = np.where(np.append(is_equation[places.constraints], np.zeros(n_bounds, bool)), -np.inf, 0.0)
        # A vanishing combination of gradients contributes nothing, however large its multipliers are.
        left, values, right = np.linalg.svd(columns, full_matrices=False)
        kept = values > DEPENDENT
        columns = (left[:, kept] * values[kept]) @ right[kept]
        found = right[kept].T @ ((left[:, kept].T @ -point.gradient) / values[kept])
        if np.any(found < least):
            found = optimize.lsq_linear(columns, -point.gradient, (least, np.inf), method="bvls", tol=1e-14).x
    return _spread(point, places, found)


def ambiguous(point: Point, bounds: Bounds, is_equation: np.ndarray, within: float = ACTIVE) -> Multipliers:
    """Truth values: which multipliers are not unique because the gradients of active constraints depend on each other.

    Constraints with a zero gradient are excluded.
    """
    places, columns = _active(point, bounds, is_equation, within)
    lengths = np.linalg.norm(columns, axis=0)
    shares, moves = np.zeros(len(lengths)), lengths > DEPENDENT
    if np.any(moves):
        null = linalg.null_space(columns[:, moves] / lengths[moves], rcond=DEPENDENT)
        shares[moves] = np.max(np.abs(null), axis=1, initial=0.0)
    return _spread(point, places, shares).active(SHARE)


def unmoved(point: Point, is_equation: np.ndarray, within: float = ACTIVE) -> np.ndarray:
    """Active constraints with a zero gradient. They have no multiplier."""
    return (is_equation | (point.c >= -within)) & (np.linalg.norm(point.jacobian, axis=1) <= DEPENDENT)


def unqualified(point: Point, bounds: Bounds, is_equation: np.ndarray, within: float = ACTIVE) -> Multipliers:
    """Truth values: which constraints and bounds violate the constraint qualification of Mangasarian and Fromovitz.

    They form a vanishing combination of gradients with non-negative weights for limits and bounds (Gordan's theorem).
    None if the qualification holds, or if moderate multipliers satisfy the first-order conditions.
    """
    multipliers = multipliers_of(point, bounds, is_equation, within)
    scale = float(np.max(np.abs(point.gradient)))
    forces = np.abs(multipliers.constraints) * np.linalg.norm(point.jacobian, axis=1)
    is_met = np.max(np.abs(stationarity(point, multipliers))) <= OPTIMAL * scale
    if is_met and np.max(forces, initial=0.0) * UNQUALIFIED <= scale:
        return Multipliers(*(np.zeros(len(values), bool) for values in multipliers))
    places, columns = _active(point, bounds, is_equation, within)
    shares = np.zeros(columns.shape[1])
    equations = np.zeros(len(shares), bool)
    equations[: len(places.constraints)] = is_equation[places.constraints]
    left, values, right = np.linalg.svd(columns[:, equations])
    independent = int(np.sum(values > UNQUALIFIED))
    shares[equations] = np.max(np.abs(right[independent:]), axis=0, initial=0.0)
    others = left[:, independent:].T @ columns[:, ~equations]  # along the equations
    if np.any(~equations):
        rows = np.concatenate([others, np.ones((1, others.shape[1]))])
        weights, rest = optimize.nnls(rows, np.append(np.zeros(len(others)), 1.0))
        shares[~equations] = weights if rest <= UNQUALIFIED else 0.0
    return _spread(point, places, shares).active(SHARE)


def _active(point: Point, bounds: Bounds, is_equation: np.ndarray, within: float) -> tuple[Multipliers, np.ndarray]:
    """Indices of the active constraints and bounds, and the matrix with their gradients as columns."""
    rows = np.flatnonzero(is_equation | (np.abs(point.c) <= within))
    lower, upper = (np.flatnonzero(np.abs(point.z - bound) <= within) for bound in bounds)
    unit = np.eye(len(point.z))
    return Multipliers(rows, lower, upper), np.concatenate([point.jacobian[rows], -unit[lower], unit[upper]]).T


def _spread(point: Point, places: Multipliers, values: np.ndarray) -> Multipliers:
    """Full vectors with `values` at the active indices and zero elsewhere."""
    n = len(point.z)
    made = Multipliers(np.zeros(len(point.c)), np.zeros(n), np.zeros(n))
    ends = np.cumsum([len(places.constraints), len(places.lower)])
    for target, where, part in zip(made, places, np.split(values, ends), strict=True):
        target[where] = part
    return made


def stationarity(point: Point, multipliers: Multipliers) -> np.ndarray:
    """The gradient of the Lagrangian."""
    return point.gradient + multipliers.constraints @ point.jacobian - multipliers.lower + multipliers.upper


def residual(point: Point, multipliers: Multipliers, is_equation: np.ndarray, scale: float = 1.0) -> float:
    """KKT residual: the largest of the gradient of the Lagrangian, constraint violations and lambda_i c_i.

    `scale` normalises gradients and multipliers.
    """
    parts = np.append(stationarity(point, multipliers), multipliers.constraints * point.c) / scale
    return max(float(np.max(np.abs(parts), initial=0.0)), violation(point, is_equation))
