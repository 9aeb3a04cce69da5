"""Weighted least squares within bounds by the Levenberg-Marquardt method, from several starts, with descent from saddle
points."""

import itertools
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import lineax as lx
import numpy as np
import optimistix as optx
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Bool, Float
from scipy.stats import qmc

from ..._linear_solver import least_squares
from ..._progress import compiling
from .._certificate.first_order import Bounds, Point
from .._certificate.second_order import STEP
from .._compute.cores import interruptible, on_all_cores
from .._compute.evaluator import CHANGED
from .._optimise.descent import descended
from .._optimise.local_search import ALIKE
from .._problem.free import Free
from .entries import Channel
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


class Multistart(NamedTuple):
    """Ends of searches from several starts, row by row; chi2 is infinite if the model could not be run."""

    starts: Float[np.ndarray, "s n"]
    z: Float[np.ndarray, "s n"]
    chi2: Float[np.ndarray, " s"]


def multistart(problem: FitProblem, starts: Float[np.ndarray, "s n"], tolerance: float, most: int) -> Multistart:
    """Searches from several starts on all cores. They stop if all of the first ones fail."""
    held, z, chi2 = np.zeros(starts.shape[1], bool), np.array(starts), np.full(len(starts), np.inf)

    def search(which: np.ndarray) -> tuple[int, Minimum]:
        return int(which[0]), minimise(problem, starts[which[0]], held, tolerance, most)

    numbers = np.arange(len(starts))
    others = (found for _, found in on_all_cores(search, numbers[1:], most=1))
    # The first search compiles the program for the others.
    for done, (place, found) in enumerate(itertools.chain([search(numbers[:1])], others), start=1):
        z[place], chi2[place] = found.z, found.chi2 if found.computed else np.inf
        if done >= ALIKE and not np.any(np.isfinite(chi2)):
            break
    return Multistart(starts, z, chi2)


def starts_between(problem: FitProblem, first: np.ndarray, n: int) -> Float[np.ndarray, "s n"]:
    """`first` and points of a Sobol sequence between the bounds, or within one width without bounds."""
    low, high = (np.asarray(bound) for bound in problem.bounds)
    low, high = np.where(np.isfinite(low), low, first - 1.0), np.where(np.isfinite(high), high, first + 1.0)
    points = qmc.Sobol(len(low), rng=0).random_base2(max(n - 2, 0).bit_length())[: n - 1]
    return np.concatenate([first[None], low + points * (high - low)])


def least(problem: FitProblem, start: np.ndarray, tolerance: float, most: int = 200) -> Minimum:
    """Least squares within the bounds, excluding saddle points of the sum of squares.

    If residuals depend on the square of a parameter, for example, its slope is zero at zero, and `minimise` does not
    move it. If the Hessian is not positive definite, the search continues after a step along which the sum decreases.
    """
    none = np.zeros(len(start), bool)
    first = minimise(problem, start, none, tolerance, most)
    bounds = np.asarray(problem.bounds[0]), np.asarray(problem.bounds[1])
    if not first.computed or _is_convex(problem, first, bounds, tolerance, most):
        return first
    ends = [first]

    def at(z: np.ndarray) -> Point | None:
        return _point(problem, z, tolerance, most, _curvature(first))

    def solver(z: np.ndarray) -> np.ndarray:
        if len(ends) > 1 or not np.array_equal(z, first.z):
            ends.append(minimise(problem, z, none, tolerance, most))
        return ends[-1].z

    end = descended(at, first.z, bounds, np.zeros(0, bool), lambda z: none, solver)
    found = next(one for one in ends if np.array_equal(one.z, end.z))
    return found._replace(evaluations=sum(one.evaluations for one in ends))


def _curvature(found: Minimum) -> float:
    """The largest Gauss-Newton curvature of the sum of squares, or its value."""
    return float(np.max(np.sum(found.jacobian**2, axis=0))) or found.chi2 or 1.0


def _point(problem: FitProblem, z: np.ndarray, tolerance: float, most: int, size: float) -> Point | None:
    """Half of the sum of squares at a point, from the compiled search with all parameters held."""
    held = jnp.ones(len(z), bool)
    _, residuals, jacobian, *_ = solved(problem, z, held, tolerance, most)
    residuals, jacobian = np.asarray(residuals), np.asarray(jacobian)
    if np.any(np.abs(residuals) >= REFUSED):
        return None
    value, slope = 0.5 * float(residuals @ residuals) / size, residuals @ jacobian / size
    return Point(np.array(z, float), value, slope, np.zeros(0), np.zeros((0, len(z))))


def _is_convex(problem: FitProblem, found: Minimum, bounds: Bounds, tolerance: float, most: int) -> bool:
    """Whether the Hessian of the sum of squares is positive definite, by one-sided differences of gradients."""
    size, free = _curvature(found), np.flatnonzero(~found.at_bound)
    here, columns = found.residuals @ found.jacobian / size, []
    for i in free:
        step = STEP if found.z[i] + STEP <= bounds[1][i] else -STEP
        there = _point(problem, found.z + step * (np.arange(len(found.z)) == i), tolerance, most, size)
        if there is None:
            return False
        columns.append((there.gradient - here)[free] / step)
    hessian = np.array(columns).reshape(len(free), len(free))
    error = np.max(np.abs(hessian - hessian.T), initial=0.0)
    return bool(np.min(np.linalg.eigvalsh(0.5 * (hessian + hessian.T)), initial=np.inf) > error)


def unexplained(
    problem: FitProblem, free: Free, minimum: Minimum, channels: Sequence[Channel], tolerance: float, most: int
) -> Iterator[str]:
    """Sentences about predictions that change with a parameter although their derivatives are zero, here and there.

    Predictions that round or count are constant in steps. A rank, an interval or an estimate then says nothing about
    the parameter. It is compared with the bounds, or with values a size away without bounds.
    """
    n, held = len(minimum.z), jnp.ones(len(minimum.z), bool)
    low, high = (np.asarray(bound) for bound in problem.bounds)
    for i in np.flatnonzero(~np.any(minimum.jacobian[:-n], axis=0)).tolist():
        ends = [low[i] if np.isfinite(low[i]) else minimum.z[i] - 1.0]
        ends += [high[i] if np.isfinite(high[i]) else minimum.z[i] + 1.0]
        for end in (ends[0], 0.5 * (ends[0] + ends[1]), ends[1]):
            z = np.where(np.arange(n) == i, end, minimum.z)
            _, residuals, jacobian, *_ = (np.asarray(value) for value in solved(problem, z, held, tolerance, most))
            if np.any(np.abs(residuals) >= REFUSED) or np.any(jacobian[:-n, i]):
                continue
            if label := _changed(problem, channels, minimum.residuals, residuals):
                x, y = (free.variables[i].text(float(np.asarray(free.unscaled(one))[i])) for one in (minimum.z, z))
                name = free.names[i]
                yield (
                    f"{label} changes from {name} = {x} to {y}, but its derivatives are zero. Functions that count or "
                    f"round say nothing about {name} by derivatives: compare chi2 for several fixed values of it"
                )
                break


def _changed(problem: FitProblem, channels: Sequence[Channel], before: np.ndarray, after: np.ndarray) -> str:
    """The first channel with other predictions; empty if there is none."""
    for channel in channels:
        sigma = np.ravel(problem.groups[channel.group].sigma[channel.name][channel.place])
        one, other = (problem.loss.weighted(residuals[channel.rows]) for residuals in (before, after))
        change = np.where(np.isnan(channel.measured), 0.0, np.abs(other - one) * sigma)
        if np.max(change) > CHANGED * np.nanmax(np.abs(channel.measured)):
            return channel.label
    return ""
