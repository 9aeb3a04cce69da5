"""The search for consistent start values and modes."""

import dataclasses
import functools as ft
from collections.abc import Mapping
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import PyTree

from ..._declare.history import Past
from ..._evaluate.constraints import CLOSE, placed
from ..._evaluate.groups import ModelParameters
from ..._evaluate.initial import ChainedStarts, given_pairs, start_point
from ..._evaluate.observe import observe
from ..._evaluate.starts import Inputs
from ..._indices import joined
from ..._numbers import Numbers
from ..._tracing import traced_once
from ..loop.loop_start import event_start
from ..programs.program_digest import digest_of
from ..programs.stored_program import result_of
from ..setup.field import RunArgs
from ..setup.options import starts_after_past
from .problem import Problem, Values
from .search import NearestPoint, Search, is_met
from .start_modes import Solver, modes_at

OPEN = 1e-6  # freedom above which a state counts as undetermined
# The initial guesses of unknown parameters are scaled by 1, 2, 1/2, 4, 1/4, ... until the search succeeds.
GUESSES = (1.0, *(2.0**k for n in range(1, 11) for k in (n, -n)))


class Outcome(NamedTuple):
    """The point found, and masks of the events that fire there without end, of refused events, of undetermined unknowns
    and of requirements that the parameters found violate; whether the search failed; and the event history.
    """

    found: NearestPoint
    happen: Array
    refused: Array
    is_open: Numbers
    violated: Array
    params: Mapping[int, Numbers]  # parameters found, by number
    is_bad: Array
    past: Past | None


class Ends(NamedTuple):
    """End points of the search by components and of the whole search, with its guesses moved by `shift`."""

    own: Array
    whole: Array
    shift: Array


class _Searches:
    """Two searches. The first solves only the initial equations of components for the states of these components. The
    second starts there and solves all conditions for all free unknowns. Other states move only if necessary.
    """

    def __init__(self, problem: Problem) -> None:
        constraints, ones = problem.system.constraints, np.ones(problem.trim.count)
        weights = constraints.weights(problem.held, 0.0)
        self._whole = Search(problem.residual, np.append(constraints.sizes, ones), np.append(weights, ones))
        self._guesses = GUESSES if problem.trim.count else GUESSES[:1]
        own = np.where(problem.foreign, 0.0, weights)
        self._own: Search | None = None
        if problem.system.initial_equations is not None:
            self._own = Search(problem.of_components.residual, constraints.sizes, own)

    def best(self, x0: Array, unknowns: Array, values: Values, easier: Values | None) -> tuple[Ends, Array]:
        """Runs both searches from states x0 and further unknowns. Returns their end points and the residual."""
        x0, unknowns, values, easier = jax.lax.stop_gradient((x0, unknowns, values, easier))
        own = x0 if self._own is None else self._own.direct(x0, values)

        def attempted(k: Numbers) -> tuple[Array, Array, Array]:
            guess = jnp.where(unknowns == 0.0, 1.0, unknowns) * jnp.array(self._guesses)[k]
            shift = jnp.where(k == 0, 0.0, guess - unknowns)
            return shift, *self._whole.best(jnp.append(own, unknowns + shift), values, easier)

        def another(found: PyTree) -> PyTree:
            k, first = found[0], found[1:]
            new = attempt(k)
            return k + 1, *jax.tree.map(lambda a, b: jnp.where((k == 0) | is_met(new[2]), a, b), new, first)

        def goes_on(found: PyTree) -> Array:
            return (found[0] == 0) | (~is_met(found[3]) & (found[0] < len(self._guesses)))

        if len(self._guesses) == 1:
            shift, whole, lack = attempted(0)
        else:
            attempt, shapes = traced_once(attempted, jnp.asarray(0))
            nothing = jax.tree.map(lambda a: jnp.zeros(a.shape), shapes)
            _, shift, whole, lack = jax.lax.while_loop(goes_on, another, (jnp.asarray(0), *nothing))
        return Ends(own, whole, shift), lack

    def found(self, best: Ends, x0: Array, unknowns: Array, values: Values) -> NearestPoint:
        """The point found, as an implicit function of all numbers."""
        origin = jnp.append(self._origin(best, x0, values), unknowns + best.shift)
        return self._whole.found(best.whole, origin, values)

    def followed(self, best: Ends, x0: Array, unknowns: Array, values: Values) -> Ends:
        """The end points, as functions of all numbers."""
        own = self._origin(best, x0, values)
        return Ends(own, self._whole.followed(best.whole, jnp.append(own, unknowns + best.shift), values), best.shift)

    def _origin(self, best: Ends, x0: Array, values: Values) -> Array:
        if self._own is None:
            return x0
        found = self._own.found(best.own, x0, values)
        return jnp.where(found.violation <= CLOSE, found.x, x0)


def search_start(
    problem: Problem,
    params: ModelParameters,
    easy: ModelParameters | None,
    starts: Numbers,
    t0: Array,
    constants: list[Numbers],
    past: Past | None,
) -> tuple[Outcome, dict[int, Any]]:
    """Searches for start values. Returns the outcome and the new values of leaves by number.

    `easy` parameters are the origin of a homotopy. If the search fails, the values are those at its end.
    """
    return result_of(_StartSearch(problem), (params, easy, jnp.asarray(starts), t0, constants, past))


@dataclasses.dataclass(frozen=True)
class _StartSearch:
    """The search of a problem, as a function of numbers only."""

    problem: Problem

    @property
    def name(self) -> str:
        return "search"

    @ft.partial(jax.jit, static_argnums=0)
    def __call__(self, arguments: Any) -> tuple[Outcome, dict[int, Numbers]]:
        return _search(self.problem, *arguments)

    def steps(self, arguments: Any) -> int:
        return 1

    def contents(self, arguments: Any) -> list[object]:
        problem, conditions = self.problem, self.problem.conditions
        handled = ("system", "conditions", "trim")
        return [
            digest_of(problem.system),
            None if conditions is None else (conditions.closed, conditions.leaves),
            problem.trim.leaves,
            *(getattr(problem, field.name) for field in dataclasses.fields(problem) if field.name not in handled),
        ]


def _search(
    problem: Problem,
    params: ModelParameters,
    easy: ModelParameters | None,
    starts: Array,
    t0: Array,
    constants: list[Numbers],
    past: Past | None,
) -> tuple[Outcome, dict[int, Numbers]]:
    """The outcome of `search_start`, and the new values."""
    system, trim, states = problem.system, problem.trim, problem.system.constraints.states
    sizes, searches = trim.sizes(params), _Searches(problem)
    inputs = Inputs(system.intake.packed(params), jnp.asarray(starts), problem.given)
    values = easier = Values(inputs, t0, constants, sizes)
    if easy is not None:
        easy_inputs = Inputs(system.intake.packed(easy), inputs.starts, problem.given)
        easier = Values(easy_inputs, t0, constants, sizes)
    x0 = ChainedStarts(system, given_pairs(system, inputs)).guess(start_point(system, inputs), t0, inputs)
    unknowns = trim.unknowns(params, sizes)

    def root(discrete: Array | None) -> tuple[Ends, Array]:
        here = None if easy is None else easier.in_modes(system, discrete)
        return searches.best(x0, unknowns, values.in_modes(system, discrete), here)

    def followed(best: Ends, discrete: Array) -> Ends:
        return searches.followed(best, x0, unknowns, values.in_modes(system, discrete))

    def at(best: Ends, args: RunArgs) -> tuple[Array, RunArgs]:
        return best.whole[states], trim.run_args(best.whole, jax.lax.stop_gradient(sizes), args)

    if system.events is None:
        best, discrete, happen, refused = root(None)[0], None, jnp.zeros(0, bool), jnp.zeros(0, bool)
        new_past = None
    else:
        start = event_start(system, t0, x0[states], inputs, past, is_search=True)
        x0 = placed(x0, states, start.states)  # past events also set states
        best, discrete, happen, refused, holds = modes_at(start, t0, Solver(root, followed, at))
        new_past = Past(jnp.asarray(t0, float), holds.astype(float))
    values = values.in_modes(system, discrete)
    found = searches.found(best, x0, unknowns, values)
    values = values.at(trim, found.x)
    is_open = np.append(system.constraints.is_state, np.ones(trim.count) > 0) & (found.freedom > OPEN)
    violated = joined(system.intake.requirements.broken(values.inputs.params) if trim.leaves else [])
    is_bad = ~(found.violation <= CLOSE)
    is_bad |= jnp.any(happen) | jnp.any(refused) | jnp.any(violated) | (problem.strict & jnp.any(is_open))
    if past is not None:
        is_bad |= ~starts_after_past(system, past, t0).holds
    y = found.x[states]
    new = dict(zip(problem.wanted, observe(system, t0, y, values.inputs, problem.wanted), strict=True))
    trimmed = trim.values(found.x, sizes)
    outcome = Outcome(found, happen, refused, is_open, violated, trimmed, is_bad, new_past)
    return outcome, new | trimmed | system.carried.discrete_values(y, values.inputs)
