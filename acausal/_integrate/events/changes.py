"""Changes by events at one point: discrete variables, states, and the variables that constraints tie to them."""

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from ..._evaluate.constraints import GIVEN, STATE, TOLERANCE, placed
from ..._evaluate.invariants import discrete_in_invariants
from ..._evaluate.observe import constrained_places
from ..._numbers import Numbers
from ..setup.field import RunArgs
from .run_events import RunEvents


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
