"""Event iteration at one instant, until relations and discrete variables no longer change."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from ..._numbers import Numbers
from ..setup.field import RunArgs
from .event_history import EventHistory
from .event_time import Approach
from .rounds import Iteration, Round, most_rounds, repeated, without_value
from .run_events import RunEvents

# Reasons why a run ends at an instant
STOPPED, ENDLESS, CONTRADICTED, ACCUMULATED, REFUSED, FULL = 1.0, 2.0, 3.0, 4.0, 5.0, 6.0


class Jumps(NamedTuple):
    """The jumps of the recorded signals at an instant, and their `leads`, which are zero with the derivatives of their
    times, relative to that of the instant. If several events make a signal jump, its time is the mean of theirs,
    weighted by the jumps.
    """

    height: Array
    leads: Array

    @classmethod
    def none(cls, n: int) -> "Jumps":
        return cls(jnp.zeros(n), jnp.zeros(n))


class Settled(NamedTuple):
    """Result of an event iteration: the time, the vector, the truths of the relations, and the conditions that hold.
    `outcome` is the reason why the run ends, or 0 if it continues.
    """

    t: Array
    y: Array
    truths: Array
    holds: Array
    history: EventHistory
    before: Array
    outcome: Array
    jumps: Jumps


def settle(
    events: RunEvents,
    t: Array,
    approach: Approach,
    y: Numbers,
    triggered: Array,
    truths: Array,
    holds: Array,
    due: Array,
    history: EventHistory,
    args: RunArgs,
    *,
    earlier: Array | None = None,
    n_before: int = 0,
    order: Array | None = None,
) -> Settled:
    """Executes the events that begin at t, each at its own moment, and then the events that they trigger.

    Events that begin at one instant read the values before all of them, except that impacts happen together in the
    first round without a due event. The events that they trigger follow in the next round, and so on. When no more
    events follow, the events `started` happen, and those that they trigger. Then the clocks of this instant tick: all
    of them read the current values and set their variables together; the events that they trigger follow. Samples do
    not wait for other events, except at the start. If the iteration does not converge within a number of rounds, each
    round executes one event only, the first in the list. Alternatives such as the conduction of diodes then converge
    like the pivots of a linear complementarity problem (Murty, `Linear Complementarity, Linear and Nonlinear
    Programming`, 1988, ch. 4).

    A relation keeps its truth while its event indicator is within its hysteresis band. `earlier` are the truths before
    the instant; `truths` those after the changes that begin there.

    `before` of the result has `n_before` elements: the moment of the first listed event and the vector before it,
    infinite if there is none, and empty if `n_before` is zero.

    At the start of a run, `order` contains the times of the past events. They happen in this order, but at the fixed
    time t. The energy balance triggered after the events at the start, which count as no loss.
    """
    is_start = order is not None
    none, no, zero = jnp.zeros(events.total, bool), jnp.asarray(False), jnp.asarray(0)
    ticks = triggered & (events.clocks | events.starts)
    if not is_start:
        ticks &= ~events.samples
    else:
        ticks &= order >= t - args.tick(t)
    # A start has no derivatives of the times of jumps: it is the time of all of them.
    signals = jnp.zeros(0) if is_start else events.signals_between(approach.before, t, y, args, none)
    start = Round(
        t=jnp.asarray(t, float),
        ys=jnp.stack([y, y]),
        due=triggered & ~ticks,
        ticks=ticks,
        truths=truths,
        holds=holds & ~(triggered & events.impacts),
        by_time=none,
        happened=none,
        first=jnp.asarray(-1),
        stored=jnp.asarray(0.0),
        lost=jnp.asarray(0.0),
        order=jax.lax.stop_gradient(order) if is_start else jnp.zeros(0),
        n_own=zero,
        history=history,
        before=jnp.full(n_before, jnp.inf),
        signals=signals,
        moved=jnp.zeros_like(signals),
        is_bad=no,
        goes_on=jnp.any(triggered) | is_start,
        count=zero,
    )
    iteration, most = (
        Iteration(events, approach, due, args, is_start, truths if earlier is None else earlier),
        events.total + most_rounds(events),
    )
    end = repeated(lambda r: r.goes_on, iteration.next_round, start, most, events.is_reversible)
    outcome = jnp.where(jnp.any(end.happened & events.stops), STOPPED, 0.0)
    outcome = jnp.where(jnp.any(end.happened & events.refused), REFUSED, outcome)
    outcome = jnp.where(end.is_bad, CONTRADICTED, outcome)
    outcome = jnp.where(end.goes_on, ENDLESS, outcome)
    y = end.ys[1] if is_start else _accounted(events, end)
    height = end.signals - signals
    leads = jnp.where(height != 0, end.moved / jnp.where(height != 0, height, 1.0) - without_value(end.t), 0.0)
    return Settled(end.t, y, end.truths, end.holds, end.history, end.before, outcome, Jumps(height, leads))


def _accounted(events: RunEvents, end: Round) -> Array:
    """The vector, with the energy loss assigned to the first event that happened."""
    y, layout = end.ys[1], events.layout
    if not layout.n_losses:
        return y
    losses = y[layout.losses] + jnp.where(jnp.arange(layout.n_losses) == end.first, end.lost, 0.0)
    return layout.with_part(y, layout.losses, losses)
