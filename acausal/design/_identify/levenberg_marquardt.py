"""Weighted least squares within bounds, by the Levenberg-Marquardt method of optimistix, as one compiled program."""

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import lineax as lx
import numpy as np
import optimistix as optx
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Bool, Float

from ..._linear_solver import least_squares
from ..._progress import compiling
from .._compute.cores import interruptible
from .fit_problem import REFUSED, FitProblem

DAMPING = 0.1  # damping of the first step, relative to the largest curvature


class Minimum(NamedTuple):
    """The end of a search: scaled parameters, residuals, their derivatives, and whether it converged."""

    z: np.ndarray
    residuals: np.ndarray
    jacobian: np.ndarray
    evaluations: int
    converged: bool
    at_bound: np.ndarray  # parameters that the data push against a bound

    @property
    def chi2(self) -> float:
        return float(self.residuals @ self.residuals)

    @property
    def computed(self) -> bool:
        """Whether the model could be run."""
        return not np.any(np.abs(self.residuals) >= REFUSED)


class Reflections(lx.AbstractLinearSolver[Any]):
    """`least_squares` with Householder reflections as a lineax solver for one vector.

    The `QR` of lineax calls LAPACK, which jaxlib cannot always compile together with large runs ("no registered
    implementation for untyped custom call").
    """

    def init(self, operator: lx.AbstractLinearOperator, options: dict[str, Any]) -> Float[Array, "m n"]:
        del options
        return operator.as_matrix()

    def compute(
        self, state: Float[Array, "m n"], vector: Any, options: dict[str, Any]
    ) -> tuple[Float[Array, " n"], lx.RESULTS, dict[str, Any]]:
        del options
        x = least_squares(state, ravel_pytree(vector)[0][:, None])[:, 0]
        return x, lx.RESULTS.successful, {}

    def transpose(self, state: Any, options: dict[str, Any]) -> tuple[Any, dict[str, Any]]:
        raise NotImplementedError("Least squares by reflections are not differentiated.")

    def conj(self, state: Any, options: dict[str, Any]) -> tuple[Any, dict[str, Any]]:
        return state.conj(), options

    def assume_full_rank(self) -> bool:
        return True


class _TrustRegion(optx.ClassicalTrustRegion):
    """Trust region with the first damping relative to the largest curvature (Nielsen, 1999), so that the scale of the
    residuals does not matter.
    """

    def step(self, first_step: Array, y: Array, y_eval: Array, f_info: Any, f_eval_info: Any, state: Any) -> Any:
        size, accept, result, state = super().step(first_step, y, y_eval, f_info, f_eval_info, state)
        curvature = jnp.max(jnp.sum(f_eval_info.jac.as_matrix() ** 2, axis=0), initial=0.0)
        first = 1.0 / (DAMPING * jnp.where(curvature > 0.0, curvature, 1.0))
        size = jnp.where(first_step, first, size)
        return size, accept, result, eqx.tree_at(lambda s: s.step_size, state, size)


class _LevenbergMarquardt(optx.LevenbergMarquardt):
    """Also stops at negligible steps, which numerical noise could reject forever, and at a failing start."""

    def __init__(self, tolerance: float) -> None:
        super().__init__(rtol=tolerance, atol=tolerance, linear_solver=Reflections())
        self.search = _TrustRegion()

    def terminate(self, fn: Any, y: Array, args: Any, options: Any, state: Any, tags: Any) -> Any:
        done, result = super().terminate(fn, y, args, options, state, tags)
        small = jnp.all(jnp.abs(state.y_eval - y) <= self.atol + self.rtol * jnp.abs(y))
        refused = jnp.any(jnp.abs(state.f_info.residual) >= REFUSED)
        return done | ((small | refused) & ~state.first_step), result


@eqx.filter_jit
def _solve(
    problem: FitProblem, z: Array, held: Bool[Array, " n"], low: Array, high: Array, tol: float, most: int
) -> Any:
    """One search with some parameters `held`; steps stop at the bounds."""

    @jax.custom_jvp
    def function(y: Array) -> tuple[Array, tuple[Array, Array]]:
        residuals, jacobian = problem.residuals_and_jacobian(jnp.clip(y, low, high))
        return residuals, (residuals, jacobian)

    # The Jacobian comes with the residuals, so that the search does not differentiate the runs again.
    @function.defjvp
    def _derivative(primals: Any, tangents: Any) -> Any:
        (y,), (dy,) = primals, tangents
        residuals, (_, jacobian) = function(y)
        moves = ~held & (y >= low) & (y <= high)
        change = jacobian @ jnp.where(moves, dy, 0.0)
        return (residuals, (residuals, jacobian)), (change, (change, jnp.zeros_like(jacobian)))

    solver = _LevenbergMarquardt(tol)
    found = optx.least_squares(lambda y, args: function(y), solver, z, has_aux=True, max_steps=most, throw=False)
    residuals, jacobian = found.state.aux
    return found.value, residuals, jacobian, found.stats["num_steps"], found.result == optx.RESULTS.successful


def solved(problem: FitProblem, z: np.ndarray, held: Bool[Array, " n"], tolerance: float, most: int) -> Any:
    """One search that a keyboard interrupt can end."""

    def work() -> Any:
        with compiling("the fit", problem.model, _solve, True):
            return jax.block_until_ready(_solve(problem, jnp.asarray(z), held, *problem.bounds, tolerance, most))

    return interruptible(work)


def minimise(problem: FitProblem, start: np.ndarray, held: np.ndarray, tolerance: float, most: int = 200) -> Minimum:
    """Least squares within the bounds from a start, with some parameters held.

    Projection method: a search moves parameters up to their bounds. The next search holds the parameters that the
    residuals push against their bounds, until this active set does not change. The result satisfies the KKT conditions:
    no slope along free parameters, and an outward slope at each active bound.
    """
    low, high = problem.bounds
    none = np.zeros(len(start), bool)
    found = Minimum(start, np.zeros(0), np.zeros((0, 0)), 0, False, none)
    for _ in range(2 * len(start) + 2):
        fixed = jnp.asarray(held | found.at_bound)
        outcome = solved(problem, found.z, fixed, tolerance, most)
        z, residuals, jacobian, steps, converged = (np.asarray(value) for value in outcome)
        z = np.clip(z, low, high)
        pushed = ~held & _pushed(z, residuals @ jacobian, low, high)
        settled = np.array_equal(pushed, found.at_bound)
        found = Minimum(z, residuals, jacobian, found.evaluations + int(steps), bool(converged) and settled, pushed)
        if settled:
            break
    return found


def _pushed(z: np.ndarray, slope: np.ndarray, low: Array, high: Array) -> np.ndarray:
    """Marks parameters that the residuals push against their bounds."""
    return np.asarray(((z <= low) & (slope > 0.0)) | ((z >= high) & (slope < 0.0)))
