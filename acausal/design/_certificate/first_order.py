"""The first-order conditions of an optimum, whatever found it.

At a local minimum of f with c <= 0, within bounds, there are multipliers that are not negative with

    grad f + sum_i lambda_i grad c_i + (upper - lower bound multipliers) = 0,    lambda_i c_i = 0,

if a constraint qualification holds, such as that of Mangasarian and Fromovitz: some direction leads inside all active
limits, to first order, along equations whose gradients are independent. Where none does, multipliers need not exist, or
grow beyond all bounds nearby. See Nocedal and Wright, Numerical Optimization, 2nd ed. (Springer, 2006), chapter 12.
"""

from typing import NamedTuple

import numpy as np
from scipy import linalg, optimize

from .point import FEASIBLE, Bounds, Point

OPTIMAL = 1e-6  # the residual of the conditions of an optimum
NEAR = 1e-3  # what is so close to a limit may be active, as long as the place is not accurate
ACTIVE = 1e-6  # of the size of a limit, or of the distance of the bounds
DEPENDENT = 1e-6  # a scaled gradient, or a combination of gradients, that is none
UNQUALIFIED = FEASIBLE**0.5  # gradients as small as those of x^2 where it is FEASIBLE
SHARE = 1e-3  # least share of a gradient that takes part in a combination that vanishes


class Multipliers(NamedTuple):
    """Scaled: of the constraints and of the lower and upper bounds, zero where these are not active."""

    constraints: np.ndarray
    lower: np.ndarray
    upper: np.ndarray

    def active(self, least: float = 0.0) -> "Multipliers":
        """Which of them are above `least`, as truth values."""
        return Multipliers(*(np.abs(values) > least for values in self))


def multipliers_of(point: Point, bounds: Bounds, is_equation: np.ndarray, within: float = ACTIVE) -> Multipliers:
    """The multipliers that come closest to making the point stationary, by least squares over what is active: the
    smallest ones.

    Those of inequalities and bounds are not negative: where the unrestricted ones have a wrong sign, the point is no
    optimum, and the residual says so.
    """
    places, columns = _active(point, bounds, is_equation, within)
    found = np.zeros(columns.shape[1])
    if len(found):
        n_bounds = len(places.lower) + len(places.upper)
        least = np.where(np.append(is_equation[places.constraints], np.zeros(n_bounds, bool)), -np.inf, 0.0)
        # A combination of gradients that vanishes balances nothing, however large its multipliers are.
        left, values, right = np.linalg.svd(columns, full_matrices=False)
        kept = values > DEPENDENT
        columns = (left[:, kept] * values[kept]) @ right[kept]
        found = right[kept].T @ ((left[:, kept].T @ -point.gradient) / values[kept])
        if np.any(found < least):
            found = optimize.lsq_linear(columns, -point.gradient, (least, np.inf), method="bvls", tol=1e-14).x
    return _spread(point, places, found)


def ambiguous(point: Point, bounds: Bounds, is_equation: np.ndarray, within: float = ACTIVE) -> Multipliers:
    """Which multipliers are not unique, as truth values: the gradients of what is active depend on each other there.

    A constraint whose gradient vanishes does not count.
    """
    places, columns = _active(point, bounds, is_equation, within)
    lengths = np.linalg.norm(columns, axis=0)
    shares, moves = np.zeros(len(lengths)), lengths > DEPENDENT
    if np.any(moves):
        null = linalg.null_space(columns[:, moves] / lengths[moves], rcond=DEPENDENT)
        shares[moves] = np.max(np.abs(null), axis=1, initial=0.0)
    return _spread(point, places, shares).active(SHARE)


def unmoved(point: Point, is_equation: np.ndarray, within: float = ACTIVE) -> np.ndarray:
    """Which active constraints no variable moves, to first order: they have no price."""
    return (is_equation | (point.c >= -within)) & (np.linalg.norm(point.jacobian, axis=1) <= DEPENDENT)


def unqualified(point: Point, bounds: Bounds, is_equation: np.ndarray, within: float = ACTIVE) -> Multipliers:
    """Which constraints and bounds violate the constraint qualification of Mangasarian and Fromovitz, as truth values.

    They are those in a combination of gradients that vanishes, with weights that are not negative for limits and bounds
    (Gordan's theorem). None if the qualification holds, or if moderate multipliers meet the first-order conditions.
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


def residual(point: Point, multipliers: Multipliers, is_equation: np.ndarray, scale: float = 1.0) -> float:
    """The largest of what is left of stationarity, of the limits that are broken, and of lambda_i c_i; slopes and
    multipliers are measured by `scale`.
    """
    broken = np.where(is_equation, np.abs(point.c), np.maximum(point.c, 0.0))
    slack = multipliers.constraints * point.c / scale
    parts = (stationarity(point, multipliers) / scale, broken, slack)
    return float(max(np.max(np.abs(part), initial=0.0) for part in parts))
