"""Local optima by the solvers of scipy, with a penalty for points that cannot be computed."""

from collections.abc import Callable
from typing import Any, Literal, cast

import numpy as np
from scipy import optimize

from .._certificate.first_order import Point, PointAt

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


class _Guarded:
    """Points for scipy, with a high objective if they cannot be computed; `last` is the last one that could be."""

    def __init__(self, at: PointAt, start: np.ndarray) -> None:
        point = at(start)
        assert point is not None
        self._at, self.last = at, point

    def __call__(self, z: np.ndarray) -> Point:
        point = self._at(np.asarray(z, float))
        if point is None:
            return self.last._replace(f=FAILED)
        self.last = point
        return point


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
    guarded = _Guarded(at, start)
    box = optimize.Bounds(*bounds, keep_feasible=True)  # pyright: ignore[reportArgumentType]
    options: dict[str, Any] = {"maxiter": most}
    if method == "SLSQP":
        # SLSQP requires non-negative constraints.
        constraints: list[Any] = [
            {
                "type": kind,
                "fun": lambda z, rows=rows: -guarded(z).c[rows],
                "jac": lambda z, rows=rows: -guarded(z).jacobian[rows],
            }
            for rows, kind in ((np.flatnonzero(~is_equation), "ineq"), (np.flatnonzero(is_equation), "eq"))
            if len(rows)
        ]
        hessian, options = None, options | {"ftol": tolerance}
    else:
        low, nonlinear = np.where(is_equation, 0.0, -np.inf), cast(Any, optimize.NonlinearConstraint)
        made = nonlinear(
            lambda z: guarded(z).c, low, np.zeros(len(low)), jac=lambda z: guarded(z).jacobian, hess=_Updated()
        )
        constraints, hessian = [made] if len(low) else [], _Updated()
        options |= {"gtol": 1e-9, "xtol": 1e-11, "barrier_tol": 1e-9, "initial_tr_radius": RADIUS}
        options |= {"initial_barrier_parameter": BARRIER, "initial_barrier_tolerance": BARRIER}
    found = optimize.minimize(
        lambda z: guarded(z).f, start, jac=lambda z: guarded(z).gradient, hess=hessian, bounds=box,
        constraints=constraints, method=method, options=options, callback=lambda z, *state: watch(np.array(z)),
    )  # fmt: skip
    end = np.clip(found.x, *bounds)
    return end if at(end) is not None else guarded.last.z
