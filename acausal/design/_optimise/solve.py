"""Local optima by the solvers of scipy, with a penalty for points that cannot be computed."""

from collections.abc import Callable
from typing import Any, Literal

import numpy as np
from scipy import optimize

from .._certificate.point import Point, PointAt

Callback = Callable[[np.ndarray], None]
Method = Literal["SLSQP", "trust-constr"]
# First radius of the trust region in scaled variables, and first barrier parameter in sizes of the objective. The
# larger defaults of scipy lead to points that cannot be computed.
RADIUS, BARRIER = 0.1, 0.01
FAILED = 1e10  # scaled objective of a point that cannot be computed: line searches step back from it


class _Updated(optimize.BFGS):
    """BFGS approximation that ignores steps without a change of the gradient."""

    def update(self, delta_x: np.ndarray, delta_grad: np.ndarray) -> None:
        if np.any(delta_grad):
            super().update(delta_x, delta_grad)


class Guarded:
    """Objective and constraints for scipy, with a high objective at points that cannot be computed."""

    def __init__(self, at: PointAt, start: np.ndarray) -> None:
        point = at(start)
        assert point is not None
        self._at, self._good = at, point

    def _point(self, z: np.ndarray) -> Point:
        point = self._at(np.asarray(z, float))
        if point is None:
            return self._good._replace(f=FAILED)
        self._good = point
        return point

    @property
    def good(self) -> np.ndarray:
        """The last point that could be computed."""
        return self._good.z

    def objective(self, z: np.ndarray) -> float:
        return self._point(z).f

    def gradient(self, z: np.ndarray) -> np.ndarray:
        return self._point(z).gradient

    def constraints(self, z: np.ndarray) -> np.ndarray:
        return self._point(z).c

    def jacobian(self, z: np.ndarray) -> np.ndarray:
        return self._point(z).jacobian


def solve(
    at: PointAt,
    start: np.ndarray,
    bounds: tuple[np.ndarray, np.ndarray],
    is_equation: np.ndarray,
    *,
    method: Method = "SLSQP",
    tolerance: float = 1e-12,
    most: int = 200,
    watch: Callback = lambda z: None,
) -> np.ndarray:
    """The end of a search by scipy from `start`, a point that can be computed."""
    guarded = Guarded(at, start)
    box = optimize.Bounds(*bounds, keep_feasible=True)  # pyright: ignore[reportArgumentType]
    if method == "SLSQP":
        constraints = [_as_dictionary(guarded, rows, kind) for rows, kind in _kinds(is_equation)]
        options, hessian = {"ftol": tolerance, "maxiter": most}, None
    else:
        low = np.where(is_equation, 0.0, -np.inf)
        nonlinear: Any = optimize.NonlinearConstraint
        made = nonlinear(guarded.constraints, low, np.zeros(len(low)), jac=guarded.jacobian, hess=_Updated())
        constraints = [made] if len(low) else []
        options = {"gtol": 1e-9, "xtol": 1e-11, "barrier_tol": 1e-9, "maxiter": most, "initial_tr_radius": RADIUS}
        hessian = _Updated()
        options |= {"initial_barrier_parameter": BARRIER, "initial_barrier_tolerance": BARRIER}
    found = optimize.minimize(
        guarded.objective, start, jac=guarded.gradient, hess=hessian, bounds=box, constraints=constraints,
        method=method, options=options, callback=lambda z, *state: watch(np.array(z)),
    )  # fmt: skip
    end = np.clip(found.x, *bounds)
    return end if at(end) is not None else guarded.good


def _kinds(is_equation: np.ndarray) -> list[tuple[np.ndarray, str]]:
    rows = [(np.flatnonzero(~is_equation), "ineq"), (np.flatnonzero(is_equation), "eq")]
    return [(numbers, kind) for numbers, kind in rows if len(numbers)]


def _as_dictionary(guarded: Guarded, rows: np.ndarray, kind: str) -> dict[str, Any]:
    """Constraints for SLSQP, which requires non-negative values."""
    return {
        "type": kind,
        "fun": lambda z: -guarded.constraints(z)[rows],
        "jac": lambda z: -guarded.jacobian(z)[rows],
    }
