"""The recorded steps of a run."""

from typing import Any, NamedTuple


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
