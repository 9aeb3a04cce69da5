"""How near to zero a margin at which equations only bend has to come, so that its sign means nothing."""

from typing import NamedTuple, Self

import jax.numpy as jnp
import numpy as np
from jax import Array

from .._numbers import Numbers

ROUNDING = 1e-12  # share of what a margin has been, below which rounding makes it pass zero again and again
ERROR = 1e-6  # the same of errors of the run, unless its tolerance is larger
# How late a step may end at a bend, as a share of the error of a run; and at least, as a share of what a margin was.
LATE, LEAST = 0.1, 1e-9
MORE = 10.0  # a band is so much wider than what made a margin pass to and fro
NEVER = 1e300  # the reach of what has not passed zero


class Band(NamedTuple):
    """The band around zero in which margins keep their side, counted from the limits that they have now.

    Rounding is told by how large a margin was. Where more than that makes it go to and fro, such as the rounding of
    larger numbers of which it is the difference, or the error of a step that begins at its limit, the band widens.

    - `width`: how wide it has become.
    - `largest`: how far the margins have been from zero at the ends of steps, and at events.
    - `reach`: the same since they passed zero.
    """

    width: Array
    largest: Array
    reach: Array

    @classmethod
    def at_start(cls, n: int) -> Self:
        return cls(jnp.zeros(n), jnp.zeros(n), jnp.full(n, NEVER))

    def noise(self, bends: np.ndarray, rtol: Numbers) -> Array:
        """The size below which the sign of a margin means nothing; the `bends` change no law, which may be late."""
        share = jnp.where(bends, jnp.maximum(LATE * rtol, LEAST), ROUNDING)
        return jnp.maximum(share * self.largest, self.width)

    def after(self, margins: Array, passed: Array, swing: Array, farthest: Array, rtol: Numbers) -> Self:
        """What is known at the end of a step, or at an event: how large `margins` are there, and which of them have
        `passed` zero, after they went so far as by their `swing` in this step.

        One that comes back from less than the error of a run has not really passed. That error is a share of how large
        the margin was, or of the size `farthest` that it has at the end of the step if that goes on.
        """
        size = jnp.where(jnp.isfinite(margins), jnp.abs(margins), 0.0)
        largest, error = jnp.maximum(self.largest, size), jnp.maximum(rtol, ERROR)
        dip = error * jnp.where(jnp.isfinite(farthest), farthest, 0.0)
        wider = MORE * jnp.maximum(ROUNDING * largest, self.width)
        width = jnp.where(passed & (self.reach == 0) & (swing < error * largest), wider, self.width)
        swing = jnp.maximum(self.reach, swing)
        width = jnp.where(passed & (swing < dip), jnp.maximum(width, jnp.minimum(MORE * swing, dip)), width)
        reach = jnp.maximum(self.reach, size)
        width = jnp.where(reach < jnp.maximum(error * largest, dip), width, 0.0)
        return type(self)(width, largest, jnp.where(passed, 0.0, reach))

    def shared(self, margins: Array, mates: np.ndarray) -> Self:
        """The same where of each margin and its `mates` those that are equal but for the sign have the widest band."""
        size = jnp.abs(margins)
        widths = jnp.where(size[mates] == size[:, None], self.width[mates], 0.0)
        return self._replace(width=jnp.max(widths, axis=1, initial=0.0))

    def without(self, others: Array) -> Self:
        """The same after events that have given these margins other limits."""
        none = type(self).at_start(len(self.width))
        return type(self)(*(jnp.where(others, new, old) for new, old in zip(none, self, strict=True)))
