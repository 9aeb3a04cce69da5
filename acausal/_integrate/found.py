"""What the search for events in a step begins with, and what it finds."""

from typing import NamedTuple

from jax import Array

from .._numbers import Numbers
from .band import Band
from .bend import Bend
from .interval import Seen


class Start(NamedTuple):
    """What is known at the start of a step: what is `seen` there, which but for its time is right only if it
    `is_known`; the conditions that hold, those of them that are `fresh`, how far margins that events have left at
    `zero` may be from it by rounding, negative where a relation does not hold, and their `band`.
    """

    seen: Seen
    is_known: Array
    holds: Array
    fresh: Array
    zero: Array
    band: Band


class Found(NamedTuple):
    """The first events in a step, if there `is_any`.

    - `begins`: which events happen first, at the time `t`; at `before`, just before it, they do not happen yet.
    - `pace`: how fast the margin of each event changes at t.
    - `shift`: see `Seen`; the rate is that at `before`, since it changes where equations bend.
    - `leaps`: those of the events that begin whose margin jumps, instead of passing zero.
    - `sides`: the relations that hold from t on, or from the end of the search.
    - `margins`: how far they are from their limits at t.
    - `zero`: how far the margins of those that are zero there may be from it by rounding, negative where a relation
      does not hold; 0 for all others. Gentle margins within the noise count as such, too.
    - `left`: the same at the end of a step in which nothing happens; only of what was zero at its start, and of noise.
    - `end`, `holds`: the margins at the end of the step, or behind it where a bend was to be expected there, and the
      conditions that hold there.
    - `bend`, `is_bent`: the next bend of the equations at `before`, or at the end; and whether they have bent by there.
    - `reached`: up to where the step was searched; less than its end where that took too many points.
    - `band`: that of the margins from t on, or from the end of the step.
    """

    is_any: Array
    t: Array
    before: Array
    pace: Array
    shift: tuple[Array, ...]
    begins: Array
    leaps: Array
    sides: Array
    margins: Array
    zero: Array
    left: Array
    holds: Array
    end: Seen
    reached: Numbers
    bend: Bend
    is_bent: Array
    band: Band
