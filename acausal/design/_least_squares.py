"""Weighted least squares within bounds, by the Levenberg-Marquardt method of optimistix, as one compiled program."""

from collections.abc import Hashable, Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
from jaxtyping import Array, Bool, Float

from .._declare.component import Component
from .._progress import compiling
from ._certificate import Bounds
from ._cores import heard
from ._descent import descended
from ._experiment import Prepared
from ._free import Free
from ._orthogonal import Reflections
from ._second_order import STEP
from ._task import Point

DAMPING = 0.1  # of the first step, as a share of the largest curvature
REFUSED = 1e10  # residual of a trial that cannot be computed: no step leads there


class Problem(eqx.Module):
    """Residuals of experiments and priors, as functions of the scaled free parameters z.

    Experiments of the same kind, with as many values, are stacked and share the program of one run.
    """

    free: Free = eqx.field(static=True)
    shared: int = eqx.field(static=True)  # how many of the free parameters, the first ones, all experiments share
    model: Component
    groups: tuple[Prepared, ...]
    prior_mean: Float[Array, " n"]
    prior_std: Float[Array, " n"]  # infinite where there is none

    def predicted(self, z: Float[Array, " n"]) -> list[dict[str, Array]]:
        """What the model predicts for each group, by name, with an axis of experiments in front."""
        x = self.free.unscaled(z)
        model = self.shared_model(x)
        return [_each(group, model, x) for group in self.groups]

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Of the scaled parameters; infinite where there are none."""
        return jnp.asarray(self.free.scaled(self.free.low)), jnp.asarray(self.free.scaled(self.free.high))

    def shared_model(self, x: Array | np.ndarray) -> Component:
        """The model with the values of what is free in all experiments."""
        return Free(self.free.variables[: self.shared]).with_values(self.model, x[: self.shared])

    def residuals(self, z: Float[Array, " n"]) -> Float[Array, " m"]:
        """(predicted - measured) / sigma of all experiments, group by group, then those of the priors."""
        parts = [
            ((found[name] - group.measured[name]) / group.sigma[name]).ravel()
            for group, found in zip(self.groups, self.predicted(z), strict=True)
            for name in group.names
        ]
        return jnp.concatenate([*parts, (self.free.unscaled(z) - self.prior_mean) / self.prior_std])

    def residuals_and_jacobian(self, z: Float[Array, " n"]) -> tuple[Float[Array, " m"], Float[Array, "m n"]]:
        """Residuals and their derivatives by forward mode, from one run of each experiment."""

        def twice(z: Array) -> tuple[Array, Array]:
            residuals = self.residuals(z)
            return residuals, residuals

        jacobian, residuals = jax.jacfwd(twice, has_aux=True)(z)
        sound = jnp.all(jnp.isfinite(residuals)) & jnp.all(jnp.isfinite(jacobian))
        return jnp.where(sound, residuals, REFUSED), jnp.where(sound, jacobian, 0.0)


def _each(group: Prepared, model: Component, x: Array) -> dict[str, Array]:
    if group.measured[group.names[0]].shape[0] == 1:
        # A loop over one costs more to compile than the experiment by itself.
        single = jax.tree_util.tree_map(lambda leaf: leaf[0], group)
        return {name: value[None] for name, value in single.predicted(single.applied(model, x)).items()}
    # One by one: runs that are stepped together wait for the slowest one.
    return jax.lax.map(lambda one: one.predicted(one.applied(model, x)), group)


def stacked(experiments: Sequence[Prepared]) -> tuple[tuple[Prepared, ...], list[tuple[int, int]]]:
    """Experiments of the same kind as one, and for each experiment its group and its place in it."""
    kinds: dict[Hashable, list[int]] = {}
    for i, experiment in enumerate(experiments):
        leaves, structure = jax.tree_util.tree_flatten(experiment)
        kinds.setdefault((structure, tuple(np.shape(leaf) for leaf in leaves)), []).append(i)
    groups, places = [], [(0, 0)] * len(experiments)
    for number, members in enumerate(kinds.values()):
        groups.append(jax.tree_util.tree_map(lambda *x: jnp.stack(x), *(experiments[i] for i in members)))
        for place, i in enumerate(members):
            places[i] = number, place
    return tuple(groups), places


class Minimum(NamedTuple):
    """Where a search ended: scaled parameters, residuals, their derivatives, and whether it converged."""

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
        """Whether the model could be run at all."""
        return not np.any(np.abs(self.residuals) >= REFUSED)


class _Search(optx.ClassicalTrustRegion):
    """Damps the first step by a share of the largest curvature, as Nielsen (1999) does: the scale of residuals is no
    matter.
    """

    def step(self, first_step: Array, y: Array, y_eval: Array, f_info: Any, f_eval_info: Any, state: Any) -> Any:
        size, accept, result, state = super().step(first_step, y, y_eval, f_info, f_eval_info, state)
        curvature = jnp.max(jnp.sum(f_eval_info.jac.as_matrix() ** 2, axis=0), initial=0.0)
        first = 1.0 / (DAMPING * jnp.where(curvature > 0.0, curvature, 1.0))
        size = jnp.where(first_step, first, size)
        return size, accept, result, eqx.tree_at(lambda s: s.step_size, state, size)


class _Solver(optx.LevenbergMarquardt):
    """Stops also where the next step would not change anything, since noise of the runs may refuse it for ever, and at
    a start that cannot be computed.
    """

    def __init__(self, tolerance: float) -> None:
        super().__init__(rtol=tolerance, atol=tolerance, linear_solver=Reflections())
        self.search = _Search()

    def terminate(self, fn: Any, y: Array, args: Any, options: Any, state: Any, tags: Any) -> Any:
        done, result = super().terminate(fn, y, args, options, state, tags)
        small = jnp.all(jnp.abs(state.y_eval - y) <= self.atol + self.rtol * jnp.abs(y))
        refused = jnp.any(jnp.abs(state.f_info.residual) >= REFUSED)
        return done | ((small | refused) & ~state.first_step), result


@eqx.filter_jit
def _solve(problem: Problem, z: Array, held: Bool[Array, " n"], low: Array, high: Array, tol: float, most: int) -> Any:
    """One search; parameters that are `held`, or that a step would take past a bound, stay where they are."""

    @jax.custom_jvp
    def function(y: Array) -> tuple[Array, tuple[Array, Array]]:
        residuals, jacobian = problem.residuals_and_jacobian(jnp.clip(y, low, high))
        return residuals, (residuals, jacobian)

    # The Jacobian comes with the residuals: the search takes it from there instead of differentiating the runs again.
    @function.defjvp
    def _derivative(primals: Any, tangents: Any) -> Any:
        (y,), (dy,) = primals, tangents
        residuals, (_, jacobian) = function(y)
        moves = ~held & (y >= low) & (y <= high)
        change = jacobian @ jnp.where(moves, dy, 0.0)
        return (residuals, (residuals, jacobian)), (change, (change, jnp.zeros_like(jacobian)))

    solver = _Solver(tol)
    found = optx.least_squares(lambda y, args: function(y), solver, z, has_aux=True, max_steps=most, throw=False)
    residuals, jacobian = found.state.aux
    return found.value, residuals, jacobian, found.stats["num_steps"], found.result == optx.RESULTS.successful


def _solved(problem: Problem, z: np.ndarray, held: Bool[Array, " n"], tolerance: float, most: int) -> Any:
    """One search, while the main thread listens for an interrupt."""

    def work() -> Any:
        with compiling("the fit", problem.model, _solve):
            return jax.block_until_ready(_solve(problem, jnp.asarray(z), held, *problem.bounds, tolerance, most))

    return heard(work)


def minimise(problem: Problem, start: np.ndarray, held: np.ndarray, tolerance: float, most: int = 200) -> Minimum:
    """The least squares within the bounds, from a start, with some parameters held.

    A projection: a search takes each parameter to its bound at most, where it stays. From there the next search starts,
    without those parameters that the residuals push against their bounds, until nothing changes. What is returned meets
    the conditions of optimality: no slope along free parameters, and one outwards at each bound.
    """
    low, high = problem.bounds
    none = np.zeros(len(start), bool)
    found = Minimum(start, np.zeros(0), np.zeros((0, 0)), 0, False, none)
    for _ in range(2 * len(start) + 2):
        fixed = jnp.asarray(held | found.at_bound)
        outcome = _solved(problem, found.z, fixed, tolerance, most)
        z, residuals, jacobian, steps, converged = (np.asarray(value) for value in outcome)
        z = np.clip(z, low, high)
        pushed = ~held & _pushed(z, residuals @ jacobian, low, high)
        settled = np.array_equal(pushed, found.at_bound)
        found = Minimum(z, residuals, jacobian, found.evaluations + int(steps), bool(converged) and settled, pushed)
        if settled:
            break
    return found


def _pushed(z: np.ndarray, slope: np.ndarray, low: Array, high: Array) -> np.ndarray:
    """Which parameters the residuals push against their bounds."""
    return np.asarray(((z <= low) & (slope > 0.0)) | ((z >= high) & (slope < 0.0)))


def least(problem: Problem, start: np.ndarray, tolerance: float, most: int = 200) -> Minimum:
    """The least squares within the bounds, as `minimise` finds it, but not a saddle of the sum of squares.

    A parameter that residuals depend on by its square, for example, has no slope where it is zero, and the search does
    not move it. Where the Hessian of the sum is not positive, the search goes on from a step along which the sum falls.
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
    """The largest curvature of the sum of squares by first derivatives, or its value."""
    return float(np.max(np.sum(found.jacobian**2, axis=0))) or found.chi2 or 1.0


def _point(problem: Problem, z: np.ndarray, tolerance: float, most: int, size: float) -> Point | None:
    """Half of the sum of squares at a place, from the program of the search, in which all parameters are held."""
    held = jnp.ones(len(z), bool)
    _, residuals, jacobian, *_ = _solved(problem, z, held, tolerance, most)
    residuals, jacobian = np.asarray(residuals), np.asarray(jacobian)
    if np.any(np.abs(residuals) >= REFUSED):
        return None
    value, slope = 0.5 * float(residuals @ residuals) / size, residuals @ jacobian / size
    return Point(np.array(z, float), value, slope, np.zeros(0), np.zeros((0, len(z))))


def _is_convex(problem: Problem, found: Minimum, bounds: Bounds, tolerance: float, most: int) -> bool:
    """Whether the Hessian of the sum of squares is positive, by differences of its gradients to one side."""
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
