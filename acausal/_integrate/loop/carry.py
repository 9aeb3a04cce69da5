"""State of the loop over the steps."""

from typing import Any, NamedTuple

from jax import Array

from ..events.event_history import EventHistory
from ..setup.state_vector import Vector
from ..step.controller import Control
from ..step.interval import Seen
from ..step.record import StepRecord


class Rows(NamedTuple):
    """The requested times and the vectors there; `n` of them have been reached."""

    ts: Any
    ys: Any
    n: Array


class Carry(NamedTuple):
    """The loop state between steps; times increase in the loop, except the model times `due`.

    Relations are `armed` at the start. A relation that has changed is armed again once its crossing function has been
    farther from zero than an error of the run; `farthest` is its largest distance at the ends of steps. `seen` holds
    the crossing functions at the end of the last step, valid unless something has `jumped` since. `before` is the
    moment of the first listed event at the end of the last step and the vector just before it, infinite if there is
    none, and empty if steps are not recorded. The last `crowd` events in a row were close to the time `mark`.
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
    record: StepRecord | None
    meter: Any
