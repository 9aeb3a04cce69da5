"""Dense output of a step that may end before the solver's own."""

import dataclasses
from collections.abc import Callable

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
from jax import Array
from jaxtyping import PyTree

from .._numbers import Numbers
from .state_vector import StateVector, Vector


class Span(diffrax.AbstractLocalInterpolation):
    """Dense output of a step as if there were no events, between its own ends."""

    t0: Numbers  # pyright: ignore[reportIncompatibleVariableOverride]
    t1: Numbers  # pyright: ignore[reportIncompatibleVariableOverride]
    inner: diffrax.AbstractLocalInterpolation
    carried: Vector
    memory: Vector  # at the end
    layout: StateVector = eqx.field(static=True)

    def evaluate(self, t0: Numbers, t1: Numbers | None = None, left: bool = True) -> Vector:
        """State at `t0`; with `t1`, the increment from `t0` to `t1`."""
        if t1 is not None:
            return self.evaluate(t1, left=left) - self.evaluate(t0, left=left)
        layout, width = self.layout, self.inner.t1 - self.inner.t0
        theta = (t0 - self.inner.t0) / jnp.where(width == 0, 1, width)
        y = layout.joined(self.inner.evaluate(t0, left=left), self.carried)
        return layout.with_part(y, layout.memory, (1 - theta) * y[layout.memory] + theta * self.memory)

    def moving(self, t: Numbers) -> tuple[Numbers, Vector]:
        """The time t, as it moves where the ends of the step do, and the vector there. Derivatives of a vector at a
        fixed time would be divided by the length of the step, which may be tiny.
        """
        hold, inner = jax.lax.stop_gradient, self.inner
        ends = hold((inner.t0, inner.t1))
        width = ends[1] - ends[0]
        theta = (t - ends[0]) / jnp.where(width == 0, 1, width)
        moved = t + (1 - theta) * (inner.t0 - ends[0]) + theta * (inner.t1 - ends[1])
        held = eqx.tree_at(lambda span: (span.inner.t0, span.inner.t1), self, ends)
        return moved, held.evaluate(t)


@dataclasses.dataclass(frozen=True)
class SpanOf:
    """Makes spans; equal for one kind of inner interpolation, since jax compiles anew for another one."""

    inner: Callable[..., diffrax.AbstractLocalInterpolation]
    layout: StateVector

    def __call__(
        self, *, t0: Numbers, t1: Numbers, begin: Array, end: Array, carried: Vector, memory: Vector, **info: PyTree
    ) -> Span:
        return Span(t0, t1, self.inner(t0=begin, t1=end, **info["inner"]), carried, memory, self.layout)
