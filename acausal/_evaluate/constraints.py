"""Constraints on the states, by connected sets: consistent start values, and the projection of a run."""

import dataclasses
import functools as ft
import math
from collections.abc import Callable, Sequence

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, PyTree

from .._jax_private import INLINE
from .._linear_solver import least_squares
from .._numbers import Numbers
from .._reduce.graph import sharing
from .._reduce.incidence import Pair
from .._reduce.sort import Sorted, Steps, chain
from .._reduce.states import nominal_of
from .blocks import Known, residuals
from .common_subexpressions import once
from .groups import Group, ModelParameters, Segments, over_members
from .implicit import Function, Inverse, nearest, refined, valued_slopes
from .plan import Plan
from .program import Program, chained_program_of
from .roots import row_scale

SWEEPS = 2  # steps of simplified Newton; each multiplies the error by about the first error
EXACT, CLOSE = 1e-14, 1e-9  # target and accepted violation of a constraint, relative to its size
MOST = 50  # maximum number of Newton iterations
SHARES = 0.25 ** np.arange(6)  # step lengths of the line search
LOOSE = 1e-8  # relative singular value below which a constraint counts as redundant
GIVEN = 1e-20  # weight of a given start value; that of a dependent variable is 1: see `weights`
TOLERANCE = 1e-6  # relative disagreement, of nominal size, at which start values contradict each other
STATE = 1e-6  # weight of a state
# `back`, `found_at_once` or `find`
Solve = Callable[[Callable[[Array], Array], Array, Array, Inverse], tuple[Array, Array]]


@dataclasses.dataclass(eq=False)
class Constraints:
    """The equations g(x) = 0 for the variables x below their highest derivatives (`pairs`), by connected sets.

    x is a flat vector. `sizes` are nominal sizes of its elements, `states` the positions of elements of the state
    vector in x, and `in_state_vector` their positions in the state vector.
    """

    pairs: list[Pair]
    plan: Plan
    groups: list[Group]  # similar connected sets together
    names: list[str]  # of the equations, in the order of `residuals`
    sizes: Float[np.ndarray, " elements"]
    states: np.ndarray
    in_state_vector: np.ndarray

    @ft.cached_property
    def is_state(self) -> np.ndarray:
        return np.isin(np.arange(len(self.sizes)), self.states)

    def weights(self, held: np.ndarray | bool = False, of_held: float = GIVEN) -> np.ndarray:
        """Mobility of the elements of x: high for dependent variables, small for states, least for those that are
        `held`.
        """
        return np.where(held, of_held, np.where(self.is_state, STATE, 1.0))

    def residuals(self, x: Float[Array, " elements"], t: Numbers, params: ModelParameters) -> Array:
        """All g(x), in the order of `names`."""
        store = Segments(t, {0: x})
        parts = [
            jnp.ravel(_of_members(group, store, params, lambda g, values, args: g(values, args)))
            for group in self.groups
        ]
        return jnp.concatenate(parts) if parts else jnp.zeros(0)

    def projected(
        self, x: Float[Array, " elements"], weight: Numbers, t: Numbers, params: ModelParameters, *, far: bool = False
    ) -> Array:
        """The nearest x with g(x) = 0; elements with a small `weight` change less.

        With G = dg/dx and weights W, in variables scaled by nominal sizes, x moves by -W G^T (G W G^T)^-1 g until g =
        0: a few times with one Jacobian, or, from `far` away, until convergence with a new one each time, and then to
        the nearest point itself; NaN if that fails. It is differentiated as an implicit function.
        """
        x, t, weight, params = jax.tree_util.tree_map(jnp.asarray, (x, t, weight, params))
        for group in self.groups:
            solve = back if not far else found_at_once if _is_linear(group.program) else find
            x = self._moved(group, Segments(t, {0: x}), weight, params, solve)
        return x

    def _moved(self, group: Group, store: Segments, weight: Numbers, params: ModelParameters, solve: Solve) -> Array:
        index = np.concatenate([read.elements.reshape(len(group.uses), -1) for read in group.reads], axis=1)

        def one(g: Function, values: Array, args: PyTree, weight: Array, sizes: Array) -> Array:
            return sizes * projected(_in_sizes(g), values / sizes, weight, (args, sizes), solve)

        moved = _of_members(group, store, params, one, jnp.asarray(weight)[index], jnp.asarray(self.sizes[index]))
        return placed(store.flat(0), np.ravel(index), jnp.ravel(moved))


def _is_linear(program: Program) -> bool:
    """Whether residuals are linear in the variables with constant coefficients."""
    forms = [step.template.form for step in (*program.steps, *program.residuals)]
    return not any(form.nonlinear or any(term.on for term in form.terms.values()) for form in forms)


def placed(vector: Array, places: np.ndarray, values: Array) -> Array:
    """The vector with values at some positions, by selection: XLA on the CPU does not compile a loop with scattered
    writes as one function.
    """
    source, is_new = np.zeros(len(vector), int), np.zeros(len(vector), bool)
    source[places], is_new[places] = np.arange(len(places)), True
    return jnp.where(is_new, values[source], vector) if len(places) else vector


def _in_sizes(g: Function) -> Function:
    """The function of elements scaled by their sizes, which are among its arguments."""
    return lambda z, args: g(args[1] * z, args[0])


def projected(
    g: Function, z: Array, weight: Numbers, args: PyTree, solve: Solve, inverse: Inverse | None = None
) -> Array:
    """The point with g(z, args) = 0 nearest to z by `weight`, from the result of `solve`, as a function of z, args."""
    inverse = _inverse if inverse is None else inverse
    start, fixed = jax.lax.stop_gradient((z, args))
    root = jnp.sqrt(weight)

    def measured(move: Array, args: PyTree) -> Array:
        z, root, rows, args = args
        return g(z + root * move, args) / rows

    end, rows = jax.lax.stop_gradient(solve(lambda z: g(z, fixed), start, root, inverse))
    found, origin = jnp.all(jnp.isfinite(end)), jnp.zeros_like(start)
    # Without a solution, derivatives must stay finite.
    move = jnp.where(found, (end - start) / root, origin)
    if solve is find:
        move = refined(measured, inverse, move, origin, (start, root, rows, fixed))
    moved = z + root * nearest(measured, inverse, move, origin, (z, root, rows, args))
    return jnp.where(found, moved, jnp.nan)


def _inverse(matrix: Array) -> Array:
    """The pseudo-inverse of a matrix with independent rows, which avoids squared weights."""
    return least_squares(matrix.T, jnp.eye(matrix.shape[1])).T


def loose_inverse(matrix: Array) -> Array:
    """The pseudo-inverse of a matrix with possibly dependent rows.

    Singular values below `LOOSE` of the largest count as zero. So redundant constraints are dropped, and variables of
    tiny weight do not move to meet constraints that only they could meet.
    """
    return jnp.linalg.pinv(matrix, rtol=LOOSE)


def _basis(g: Callable[[Array], Array], z: Array, root: Array, inverse: Inverse) -> tuple[Array, Array, Array]:
    """A direction for each constraint that changes it by its size and no other one, the sizes of constraints, and
    their violations relative to these sizes.
    """
    slopes, value = valued_slopes(g)(z)
    rows = row_scale(slopes)
    return root[:, None] * inverse(root * slopes / rows[:, None]), rows, value / rows


def back(g: Callable[[Array], Array], z: Array, root: Array, inverse: Inverse) -> tuple[Array, Array]:
    """A few steps of simplified Newton iteration with one Jacobian."""
    basis, rows, missing = _basis(g, z, root, inverse)
    z = z - basis @ missing
    for _ in range(SWEEPS - 1):
        z = z - basis @ (g(z) / rows)
    return z, rows


def found_at_once(g: Callable[[Array], Array], z: Array, root: Array, inverse: Inverse) -> tuple[Array, Array]:
    """The same as `find`, for linear constraints."""
    z, rows = back(g, z, root, inverse)
    return jnp.where(jnp.max(jnp.abs(g(z)) / rows) <= CLOSE, z, jnp.nan), rows


def find(g: Callable[[Array], Array], z: Numbers, root: Array, inverse: Inverse) -> tuple[Array, Array]:
    """Newton's method with a line search on the violation, until convergence."""

    def step(carry: PyTree) -> PyTree:
        z = carry[-1]
        basis, rows, missing = _basis(g, z, root, inverse)
        trials = z - SHARES[:, None] * (basis @ missing)
        violations = jax.vmap(lambda z: jnp.max(jnp.abs(g(z)) / rows))(trials)
        best = jnp.argmin(jnp.where(jnp.isfinite(violations), violations, jnp.inf))
        return carry[0] + 1, jnp.max(jnp.abs(missing)), z, rows, trials[best]

    def goes_on(carry: PyTree) -> Numbers:
        return (carry[1] > EXACT) & (carry[0] < MOST)

    m = jax.eval_shape(g, z).shape[0]
    carry = (0, jnp.asarray(jnp.inf), z, jnp.ones(m), z)
    _, violated, z, rows, _ = jax.lax.while_loop(goes_on, step, carry)
    return jnp.where(violated <= CLOSE, z, jnp.nan), rows


def _of_members(
    group: Group, store: Segments, params: ModelParameters, function: Callable[..., Array], *extra: Array
) -> Array:
    """Map `function(g, values, args, *extra)` over the connected sets of a group, where g(values, args) = 0 are the
    constraints of a set; values are flat.
    """
    shapes = [read.shape for read in group.reads]
    splits = np.cumsum([math.prod(shape) for shape in shapes])[:-1]

    def g(flat: Array, args: PyTree) -> Array:
        pieces = [piece.reshape(shape) for piece, shape in zip(jnp.split(flat, splits), shapes, strict=True)]
        return _residuals(group.program, pieces, *args)

    def one(known: Known, extra: list[Array]) -> Array:
        flat = jnp.concatenate([jnp.ravel(jnp.asarray(value, float)) for value in known.values])
        return function(g, flat, (list(known.params), known.time), *extra)

    return over_members(group, store, params, one, list(extra))


@ft.partial(jax.jit, static_argnums=0, inline=INLINE)
def _residuals(program: Program, values: list[Array], params: list[Array], t: Numbers) -> Array:
    """The residuals of a program as one flat vector. Traced once for all calls."""
    return once(lambda: jnp.concatenate([jnp.ravel(x) for x in residuals(program, Known(params, values, t))]))


def all_constraints(ordered: Sorted, plan: Plan, kinds: dict[int, int]) -> Constraints:
    """All constraints, in all variables below their highest derivatives."""
    return _made(ordered, plan, kinds, [([], rows) for rows in _connected(ordered)], ordered.constrained)


def invariants_of(ordered: Sorted, plan: Plan, kinds: dict[int, int]) -> Constraints:
    """The connected sets of constraints with an invariant, onto which a run is projected, in the states."""
    sets = [rows for rows in _connected(ordered) if not ordered.invariants.isdisjoint(rows)]
    return _chained(ordered, plan, kinds, sets, ordered.states)


def remaining_constraints(ordered: Sorted, plan: Plan, kinds: dict[int, int], given: Sequence[Pair]) -> Constraints:
    """The constraints that remain at a start with `given` pairs, in these pairs and the states."""
    return _chained(ordered, plan, kinds, _connected(ordered), given, ordered.states)


def _chained(
    ordered: Sorted, plan: Plan, kinds: dict[int, int], sets: list[list[int]], *known: Sequence[Pair]
) -> Constraints:
    """Constraints in the known pairs. Dependent variables that follow from them one by one are eliminated, so the
    matrices are small.
    """
    chains = [chain(ordered, rows, *known) for rows in sets]
    rest = [(steps, _without(rows, steps)) for steps, rows in zip(chains, sets, strict=True)]
    return _made(ordered, plan, kinds, [(steps, rows) for steps, rows in rest if rows], None)


def _made(
    ordered: Sorted, plan: Plan, kinds: dict[int, int], sets: list[tuple[Steps, list[int]]], pairs: list[Pair] | None
) -> Constraints:
    """Sets of constraints, each with the steps that determine dependent variables. The variables are those that the
    constraints read, unless all `pairs` are wanted.
    """
    uses = [chained_program_of(ordered, steps, rows, kinds) for steps, rows in sets]
    if pairs is None:
        used = {pair for use in uses for pair in use.values}
        pairs = [pair for pair in ordered.constrained if pair in used]
    own = Plan([], pairs, plan.shapes)
    counts = [plan.size(v) for v, _ in pairs]
    sizes = np.repeat([nominal_of(ordered.table, pair) for pair in pairs], counts)
    first = dict(zip(pairs, np.cumsum([0, *counts]).tolist(), strict=False))
    places, ours = [np.zeros(0, int)], [np.zeros(0, int)]
    for pair, start in zip(ordered.states, plan.starts.tolist(), strict=False):
        if pair in first:
            elements = np.arange(plan.size(pair[0]))
            places.append(first[pair] + elements)
            ours.append(start + elements)
    groups = own.residual_groups(uses)
    rows_of = {id(use): rows for use, (_, rows) in zip(uses, sets, strict=True)}
    names = [name for group in groups for use in group.uses for name in _names(ordered, rows_of[id(use)])]
    return Constraints(list(pairs), own, groups, names, sizes, np.concatenate(places), np.concatenate(ours))


def _without(rows: list[int], steps: Steps) -> list[int]:
    done = {row for row, _ in steps}
    return [row for row in rows if row not in done]


def _names(ordered: Sorted, rows: list[int]) -> list[str]:
    """The name of the equation of each element of the residuals."""
    table = ordered.table
    sizes = [math.prod(table.place(row)[0].template.shape) for row in rows]
    return [table.row_name(row) for row, size in zip(rows, sizes, strict=True) for _ in range(size)]


def _connected(ordered: Sorted) -> list[list[int]]:
    """Sets of constraints that share variables."""
    table = ordered.table
    chosen = np.isin(table.row, ordered.constraints)
    pair = table.variable[chosen] * 16 + table.order[chosen]
    return sharing(ordered.constraints, table.row[chosen], pair)[0]
