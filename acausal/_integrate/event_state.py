"""What is kept of events from step to step, and whether they accumulate."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from .._numbers import Numbers
from .band import Band
from .event_history import EventHistory
from .field import Given
from .interval import Seen
from .look import TOO_SOON
from .run_events import RunEvents

CROWD = 16  # events accumulate where more than so many, and two of each, are close together
INTERVAL = 1e-9  # share of the time span within which events are close together
ACCUMULATED = 4.0  # why a run ends, besides the reasons of `settle`


class EventState(NamedTuple):
    """What is kept of events.

    - `holds`, `fresh`: which conditions hold, and which of them have just become true.
    - `zero`: how far margins that events have left at zero may be from it by rounding, see `look`.
    - `seen`: their margins, which are right unless the vector has `jumped` since.
    - `band`: that of the margins, see `Band`.
    - `due`: when scheduled events happen next.
    - `history`: what happened so far.
    - `mark`, `crowd`: a time, and how many events in a row were close to it.
    """

    holds: Array
    fresh: Array
    zero: Array
    seen: Seen
    band: Band
    due: Array
    history: EventHistory
    mark: Array
    crowd: Array
    jumped: Array


def crowded(
    events: RunEvents, state: EventState, since: Array, t: Numbers, begins: Numbers, given: Given
) -> tuple[Array, Array, Array]:
    """Since when events have been close together, how many, and whether the run ends because they accumulate: many are
    close together, or one at which equations jump happens again at once. `since` is the time since the start of the
    step.
    """
    span, happens = jnp.abs(given.numbers.t1 - given.numbers.t0), jnp.any(begins & ~events.scheduled)
    is_close = jnp.abs(t - state.mark) < INTERVAL * span
    crowd = jnp.where(happens, jnp.where(is_close, state.crowd + 1, 0), state.crowd)
    mark = jnp.where(happens & ~is_close, jax.lax.stop_gradient(t), state.mark)
    again = jnp.any(begins & state.fresh & ~events.scheduled & ~events.continuous) & (since < TOO_SOON * span)
    return mark, crowd, jnp.where(again | (crowd > CROWD + 2 * events.total), ACCUMULATED, 0.0)
