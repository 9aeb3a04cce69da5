"""How near to zero a margin at which equations only bend has to come, so that its sign means nothing."""

from typing import NamedTuple, Self

import jax.numpy as jnp
import numpy as np
from jax import Array

from .._numbers import Numbers

ROUNDING = 1e-12  # share of the largest that a margin has been, below which rounding makes it pass zero again and again
ERROR = 1e-6  # the least error of a run, as such a share; `rtol` where that is larger
# A kink may be noticed this late: as a share of `rtol`, and at least, of the largest that its margin has been.
LATE, LEAST = 0.1, 1e-9
MORE = 10.0  # how many times wider a band becomes than what made its margin pass zero to and fro
NEVER = 1e300  # the reach of what has not passed zero


class Band(NamedTuple):
    """The band around zero in which each margin keeps its side. It begins anew when an event gives the margin another
    limit.

    Its half width is first that of rounding, a share of the largest that the margin was. It widens where the margin
    goes to and fro by more: by the rounding of larger numbers whose difference it is, or by the error of a step that
    begins at zero.

    - `widened`: how far it has widened, 0 if not.
    - `largest`: the largest size of the margin at the ends of steps and at events.
    - `reach`: the same since it last passed zero, `NEVER` before that.
    """

    widened: Array
    largest: Array
    reach: Array

    @classmethod
    def at_start(cls, n: int) -> Self:
        return cls(jnp.zeros(n), jnp.zeros(n), jnp.full(n, NEVER))

    def half_width(self, bends: np.ndarray, rtol: Numbers) -> Array:
        """At `bends`, which change no law, it is that of the error: steps may end late there."""
        share = jnp.where(bends, jnp.maximum(LATE * rtol, LEAST), ROUNDING)
        return jnp.maximum(share * self.largest, self.widened)

    def after(self, margins: Array, passed: Array, swing: Array, ahead: Array, rtol: Numbers) -> Self:
        """The band after a step or at an event, where the margins are these and some have `passed` zero.

        `swing` is the rate of each margin there times the time since the start of the step. A margin that passes back
        after it went no farther than the error of the run has not really passed. This error is a share of its largest
        size, or of that which it would have at the end of the step, `ahead`.
        """
        size = jnp.where(jnp.isfinite(margins), jnp.abs(margins), 0.0)
        largest, error = jnp.maximum(self.largest, size), jnp.maximum(rtol, ERROR)
        dip = error * jnp.where(jnp.isfinite(ahead), jnp.abs(ahead), 0.0)
        wider = MORE * jnp.maximum(ROUNDING * largest, self.widened)
        widened = jnp.where(passed & (self.reach == 0) & (swing < error * largest), wider, self.widened)
        excursion = jnp.maximum(self.reach, swing)
        is_dip = passed & (excursion < dip)
        widened = jnp.where(is_dip, jnp.maximum(widened, jnp.minimum(MORE * excursion, dip)), widened)
        reach = jnp.maximum(self.reach, size)
        widened = jnp.where(reach < jnp.maximum(error * largest, dip), widened, 0.0)
        return type(self)(widened, largest, jnp.where(passed, 0.0, reach))

    def shared(self, margins: Array, mates: np.ndarray) -> Self:
        """The same, where margins of equal size among `mates` share the widest of their bands: of two relations on one
        number, neither may keep a side that contradicts the other's.
        """
        size = jnp.abs(margins)
        widths = jnp.where(size[mates] == size[:, None], self.widened[mates], 0.0)
        return self._replace(widened=jnp.max(widths, axis=1, initial=0.0))

    def without(self, changes: Array) -> Self:
        """The same after events have changed the margins by so much: more than errors do is another limit."""
        none, others = type(self).at_start(len(changes)), changes > ERROR * self.largest
        return type(self)(*(jnp.where(others, new, old) for new, old in zip(none, self, strict=True)))
