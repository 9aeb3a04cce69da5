"""Impacts: impulses at contacts, which change all speeds of a model together."""

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from ..._evaluate.complementarity import complementary
from ..._evaluate.constraints import placed
from ..._numbers import Numbers
from ..setup.field import RunArgs
from .changes import with_discrete
from .run_events import Here, RunEvents

LOSSLESS = 1.0 - 1e-9  # ratio of the speeds after and before from which an impact loses no energy


def with_impulses(
    events: RunEvents,
    t: Numbers,
    y: Array,
    new: Numbers,
    here: Here,
    fired: Array,
    repeated: Array,
    args: RunArgs,
) -> Numbers:
    """The vector `new` with the states after the impacts among the events that `fired` at y.

    A force that acts for an instant with the impulse p changes each state by the derivative of its rate with respect to
    this force, times p. The rates are those with all closed contacts open and all stuck friction free; see `impact`.

    Contacts `repeated` at this instant strike each other without end, such as those of a body between another one and a
    wall. If a contact that loses energy is struck then, all of them are plastic, as after infinitely many impacts
    (McNamara and Young, `Inelastic collapse and clumping in a one-dimensional granular medium`, 1992).
    """
    if not np.any(events.impacts):
        return new
    struck, again = fired[events.impacts], repeated[events.impacts]

    def jump() -> Array:
        free = with_discrete(events, y, here.values, jnp.asarray(events.yields))
        none = jnp.zeros(len(struck))
        rates = lambda forces: events.contact_rates(t, placed(free, events.forces, forces), args)  # noqa: E731
        push = jax.linearize(rates, none)[1]
        answers, accelerations = jax.vmap(push, out_axes=1)(jnp.eye(len(struck)))
        closed, speeds, after = here.contacts
        is_collapse = jnp.any(again) & jnp.any(struck & (after < -LOSSLESS * speeds))
        least, takes_part = jnp.where(is_collapse, 0.0, after), struck | closed | (again & is_collapse)
        return answers @ complementary(accelerations, speeds, least, takes_part)

    n = events.layout.n_states - events.system.n_algebraic
    change = jax.lax.cond(jnp.any(struck), jump, lambda: jnp.zeros(n))
    new = jnp.asarray(new)
    return events.layout.with_part(new, slice(0, n), new[:n] + change)
