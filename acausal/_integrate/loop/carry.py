"""State of the loop over the steps."""

from typing import Any, NamedTuple

from jax import Array

from ..events.crossing import Returns
from ..events.event_history import EventHistory
from ..setup.state_vector import Vector
from ..step.controller import Control
from ..step.interval import PathSample


class StepRecord(NamedTuple):
    """The first `n` steps of a run.

    - `ts`, `ys`: the start and the ends of the steps in chronological order, infinite after the last one, and the
      vectors there, after the events at the end of each step.
    - `moments`, `befores`: the time of the first listed event at the end of each step and the vector just before it,
      infinite if there is none.
    - `infos`: the dense output data of each step; None if only the ends are kept.
    """

    ts: Any
    ys: Any
    moments: Any
    befores: Any
    infos: Any
    n: Any


class Rows(NamedTuple):
    """The requested times and the vectors there; `n` of them have been reached."""

    ts: Any
    ys: Any
    n: Array


class Carry(NamedTuple):
    """The loop state between steps; times increase in the loop, except the model times `due`.

    Relations are `armed` at the start. A relation that has changed is armed again once its event indicator has been
    farther from zero than an error of the run; `farthest` is its largest distance at the ends of steps. `end_sample`
    holds the event indicators at the end of the last step, valid unless something has `jumped` since. `before` is the
    moment of the first listed event at the end of the last step and the vector just before it, infinite if there is
    none, and empty if steps are not recorded.
    """

    t: Array
    y: Vector
    truths: Array
    armed: Array
    farthest: Array
    due: Array
    outcome: Array
    jumped: Array
    end_sample: PathSample | None
    returns: Returns
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
