"""What the loop over the steps carries from step to step."""

from typing import Any, NamedTuple

from jax import Array

from ..events.event_history import EventHistory
from ..setup.state_vector import Vector
from ..step.controller import Control
from ..step.interval import Seen
from ..step.record import Record


class Rows(NamedTuple):
    """Times asked for and the vectors there, of which `n` have been reached."""

    ts: Any
    ys: Any
    n: Array


class Carry(NamedTuple):
    """What is carried from step to step; times count forwards, but for those `due`.

    A relation is `armed` at the start, and one that has changed is so again once its crossing function was farther from
    zero than an error of the run; `farthest` is how far it was at most at the ends of steps. `seen` is what was looked
    at at the end of the last step, unless something has `jumped` since. `before` is the moment of the first listed
    event at the end of the last step and the vector just before it, infinite if there is none; it is empty if steps are
    not recorded. A number of events in a row, the `crowd`, were close to the time `mark`.
    """

    t: Array
    y: Vector
    truths: Array
    armed: Array
    farthest: Array
    due: Array
    outcome: Array
    jumped: Array
    seen: Seen | None
    mark: Array
    crowd: Array
    inner: Any
    control: Control
    failed: Array
    n_steps: Array
    n_accepted: Array
    history: EventHistory | None
    before: Vector
    rows: Rows | None
    record: Record | None
    meter: Any
