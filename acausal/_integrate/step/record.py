"""The recorded steps of a run."""

from typing import Any, NamedTuple


class Record(NamedTuple):
    """The steps of a run, of which `n` are there.

    - `ts`, `ys`: the start and the ends of the steps, in the order of time, infinite after the last one, and the
      vectors there, after what happens at the end of a step.
    - `moments`, `befores`: of each step, the time of the first listed event at its end and the vector just before it,
      infinite if there is none.
    - `infos`: what the dense output of each step is evaluated from; None if only the ends are kept.
    """

    ts: Any
    ys: Any
    moments: Any
    befores: Any
    infos: Any
    n: Any
