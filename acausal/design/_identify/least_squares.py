"""Least squares from several starts, and descent from saddle points."""

import itertools
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from scipy.stats import qmc

from .._certificate.first_order import Bounds, Point
from .._certificate.second_order import STEP
from .._compute.cores import on_all_cores
from .._optimise.descent import descended
from .._optimise.local_search import ALIKE
from .fit_problem import REFUSED, FitProblem
from .levenberg_marquardt import Minimum, minimise, solved


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
