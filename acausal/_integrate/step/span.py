"""Dense output of a step that may end before the solver's step."""

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp

from ..._numbers import Numbers
from ..setup.state_vector import StateVector, Vector
from .correction import Correction, corrected, share, within


class Span(diffrax.AbstractLocalInterpolation):
    """Dense output of a step without its events, between the ends of the step; corrected if there is a `correction`.

    Iterations within the step start from the same guess as those of its stages, since an event may have led far away.
    """

    t0: Numbers  # pyright: ignore[reportIncompatibleVariableOverride]
    t1: Numbers  # pyright: ignore[reportIncompatibleVariableOverride]
    inner: diffrax.AbstractLocalInterpolation
    carried: Vector
    layout: StateVector = eqx.field(static=True)
    correction: Correction | None = None

    def evaluate(self, t0: Numbers, t1: Numbers | None = None, left: bool = True) -> Vector:
        """State at `t0`; with `t1`, the increment from `t0` to `t1`."""
        if t1 is not None:
            return self.evaluate(t1, left=left) - self.evaluate(t0, left=left)
        y = self.plain(t0, left)
        if self.correction is None:
            return y
        # The equations may change at an instant just after the end of the step.
        t = within(self.inner, t0)
        shift = self.correction.shift(*jax.lax.stop_gradient((self.inner, t, y)))
        return corrected(self.correction, self.inner, y, shift, share(self.inner, t), t, y)

    def plain(self, t: Numbers, left: bool = True) -> Vector:
        """State at a time by the solver's own dense output, without correction."""
        return self.layout.joined(self.inner.evaluate(t, left=left), self.carried)

    def moving_point(self, t: Numbers) -> tuple[Numbers, Vector]:
        """The time t, which moves with the ends of the step, and the vector there. Derivatives of a vector at a fixed
        time would contain a division by the length of the step, which may be tiny.
        """
        ends = jax.lax.stop_gradient((self.inner.t0, self.inner.t1))
        held = eqx.tree_at(lambda span: (span.inner.t0, span.inner.t1), self, ends)
        return self.moving_time(t), held.plain(t)

    def moving_time(self, t: Numbers) -> Numbers:
        """The time t, with the derivatives of a point that moves with the ends of the step."""
        inner = self.inner
        start, end = jax.lax.stop_gradient((inner.t0, inner.t1))
        theta = share(jax.lax.stop_gradient(inner), t)
        return t + (1 - theta) * (inner.t0 - start) + theta * (inner.t1 - end)

    def fixed_time(self, t: Numbers) -> Numbers:
        """The inverse of `moved`."""
        inner = self.inner
        start, end = jax.lax.stop_gradient((inner.t0, inner.t1))
        stretch = jnp.where(end == start, 1, end - start) / jnp.where(end == start, 1, inner.t1 - inner.t0)
        return t + ((t - inner.t0) * stretch - (t - start))
