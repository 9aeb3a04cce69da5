"""Changes by events at one point: discrete variables, states, the variables that constraints tie to them, impulses at
contacts, and discrete variables that follow values.
"""

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from ..._evaluate.complementarity import solve_complementarity
from ..._evaluate.constraints import GIVEN, STATE, TOLERANCE, placed
from ..._evaluate.invariants import discrete_in_invariants
from ..._evaluate.observe import constrained_places
from ..._numbers import Numbers
from ..setup.field import RunArgs
from .run_events import Here, RunEvents


def changed(
    events: RunEvents, t: Numbers, y: Array, values: list[Array], fired: Array, remains: Array, args: RunArgs
) -> tuple[Numbers, Numbers]:
    """The vector after the events that `fired`, and whether its constraints forbid the change. If several events set
    one variable, the last one wins. The events in `remains` have already set their discrete variables.

    If a discrete variable in an invariant changes, the states move to the nearest point that satisfies the invariant.
    """
    if events.system.events is None:
        return y, jnp.asarray(False)
    wanted = _wanted(events, values, fired)
    new = with_discrete(events, y, values, fired & ~remains)
    bound = discrete_in_invariants(events.system)
    if not wanted and not bound.size:
        return new, jnp.asarray(False)
    return _reset(events, t, new, wanted, jnp.any(new[bound] != y[bound]), args)


def with_discrete(events: RunEvents, y: Array, values: list[Array], fired: Array) -> Array:
    """The vector with the discrete variables as set by the events that `fired`. What follows a value keeps its own
    while the value is NaN.
    """
    number, element, is_own = events.writes
    if not number.size:
        return y
    old, new = y[events.layout.discrete], jnp.concatenate(values)[element]
    is_set = fired[number] & is_own & ~(events.follows[number] & jnp.isnan(new))
    turns = np.arange(len(number))[:, None]
    last = jnp.max(jnp.where(is_set, turns, -1), axis=0)  # -1 if nothing is set
    # All turns at once, because a loop would compile operations for each; by selection, as in `placed`.
    chosen = jnp.sum(jnp.where(turns == last, new, 0.0), axis=0)
    return events.layout.with_part(y, events.layout.discrete, jnp.where(last >= 0, chosen, old))


def _wanted(events: RunEvents, values: list[Array], fired: Array) -> dict[int, tuple[Array, Array]]:
    """For each leaf other than discrete variables that events set: its new values, and the mask of set elements."""
    wanted: dict[int, tuple[Array, Array]] = {}
    for (first, count, leaf), value in zip(events.targets, values, strict=True):
        if leaf in events.system.carried.discrete_places:
            continue
        is_here = fired[first : first + count]
        old, was = wanted.get(leaf, (value, jnp.zeros_like(is_here)))
        wanted[leaf] = (jnp.where(is_here, value, old), was | is_here)
    return wanted


def _reset(
    events: RunEvents, t: Numbers, y: Array, wanted: dict[int, tuple[Array, Array]], is_moved: Array, args: RunArgs
) -> tuple[Array, Array]:
    """The vector with new values of variables: states are set directly, others through the constraints. `is_moved`
    marks a change of the invariants. If the constraints forbid the values, the vector is unchanged.
    """
    system, constraints = events.system, events.system.constraints
    places = {leaf: constrained_places(system, leaf) for leaf in wanted}
    x, touched = jnp.zeros(len(constraints.sizes)), jnp.zeros(len(constraints.sizes), bool)
    for leaf, (value, is_here) in wanted.items():
        where, signs = places[leaf]
        x = placed(x, where, jnp.where(is_here, signs * value, x[where]))
        touched = placed(touched, where, touched[where] | is_here)
    is_bad = jnp.asarray(False)
    if system.ordered.invariants or not all(constraints.is_state[where].all() for where, _ in places.values()):
        x, is_bad = _followed(events, t, y, x, touched, args)
        touched = jnp.broadcast_to((jnp.any(touched) | is_moved) & ~is_bad, touched.shape)
    new = jnp.where(touched[constraints.states], x[constraints.states], y[constraints.in_state_vector])
    return placed(y, constraints.in_state_vector, new), is_bad


def _followed(
    events: RunEvents, t: Numbers, y: Array, aimed: Array, touched: Array, args: RunArgs
) -> tuple[Array, Array]:
    """All constrained variables after the `touched` ones are set to the values `aimed`, and whether that fails."""
    system, constraints, inputs = events.system, events.system.constraints, events.bound(y, args)
    weight = jnp.where(touched, GIVEN, np.where(constraints.is_state, STATE, 1.0))

    def project(x: Array, _: None) -> tuple[Array, None]:
        start = jnp.where(touched, aimed, x)
        return constraints.projected(start, weight, t, inputs.params, far=True), None

    # The constraints are nonlinear, so the first projection moves the new values slightly. They are restored, and the
    # second projection, which starts close to a solution, preserves them.
    start = system.collected(t, y[events.layout.point], args.inputs, constraints.pairs)
    x = jax.lax.scan(project, start, None, length=2)[0]
    missed = jnp.abs(x - aimed) > TOLERANCE * (constraints.sizes + jnp.abs(aimed))
    return x, jnp.any(touched & missed) | ~jnp.all(jnp.isfinite(x))


def with_impulses(
    events: RunEvents,
    t: Numbers,
    y: Array,
    new: Numbers,
    here: Here,
    fired: Array,
    args: RunArgs,
) -> Numbers:
    """The vector `new` with the states after the impacts among the events that `fired` at y.

    A force that acts for an instant with the impulse p changes each state by the derivative of its rate with respect to
    this force, times p. The rates are those with all closed contacts open and all stuck friction free; see `impact`.
    Impacts that a start search leaves to the run do not happen.
    """
    if not np.any(events.impacts & ~events.waits):
        return new
    struck = fired[events.impacts]

    def jump() -> Array:
        free = with_discrete(events, y, here.values, jnp.asarray(events.yields))
        none = jnp.zeros(len(struck))
        rates = lambda forces: events.contact_rates(t, placed(free, events.forces, forces), args)  # noqa: E731
        push = lambda force: jax.jvp(rates, (none,), (force,))[1]  # noqa: E731
        answers, accelerations = jax.vmap(push, out_axes=1)(jnp.eye(len(struck)))
        closed, speeds, after = here.contacts
        # A contact that no force opens, such as one between two given motions, has no impact.
        is_rigid = jnp.any(struck & ~(jnp.diagonal(accelerations) > 0.0))
        impulses = solve_complementarity(accelerations, speeds, after, struck | closed)
        return answers @ jnp.where(is_rigid, jnp.nan, impulses)

    n = events.layout.n_states - events.system.n_algebraic
    change = jax.lax.cond(jnp.any(struck), jump, lambda: jnp.zeros(n))
    new = jnp.asarray(new)
    return events.layout.with_part(new, slice(0, n), new[:n] + change)


def with_follows(events: RunEvents, triggered: Array, y: Array, values: list[Array]) -> Array:
    """The events of a round: those `triggered`, and each `follow` whose `values` differ from its variables in y.

    Conditions of `ifelse` change first, because values that depend on them are not final before.
    """
    if not np.any(events.follows):
        return triggered
    return triggered | (_differ(events, y, values) & ~jnp.any(triggered & events.held))


def _differ(events: RunEvents, y: Array, values: list[Array]) -> Array:
    """For each event, whether it is a `follow` with a value that differs."""
    number, element, is_own = events.writes
    turns, places = np.nonzero(is_own & events.follows[number])
    numbers, elements = number[turns, places], element[turns, places]
    own = np.unique(numbers)
    rows = [np.flatnonzero(numbers == n) for n in own]
    # One row for each event, with its elements repeated up to the length of the longest.
    table = np.array([np.resize(row, max(map(len, rows))) for row in rows])
    new, old = jnp.concatenate(values)[elements[table]], y[events.layout.discrete][places[table]]
    differs = jnp.any((new != old) & ~jnp.isnan(new), axis=1)
    positions = np.zeros(events.total, int)
    positions[own] = 1 + np.arange(len(own))
    return jnp.concatenate([jnp.zeros(1, bool), differs])[positions]
