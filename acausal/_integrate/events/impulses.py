"""Impacts: impulses at contacts, which change all speeds of a model together."""

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from ..._evaluate.complementarity import solve_complementarity
from ..._evaluate.constraints import placed
from ..._numbers import Numbers
from ..setup.field import RunArgs
from .changes import with_discrete
from .run_events import Here, RunEvents


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
