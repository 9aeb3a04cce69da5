"""The recorded steps of a run."""

from typing import Any, NamedTuple

import diffrax
import jax
import jax.numpy as jnp
from jax import Array

from .span import Span
from .state_vector import StateVector


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

    def at(self, t: Array) -> tuple[Any, Array]:
        """What the step is evaluated from in which a time lies, the one before where it is the end of one; and whether
        the run has come there.
        """
        index = jnp.clip(jnp.searchsorted(self.ts, t) - 1, 0, len(self.ts) - 2)
        last = jnp.max(jnp.where(jnp.isfinite(self.ts), self.ts, -jnp.inf))
        return jax.tree.map(lambda x: x[index], self.infos), (t >= self.ts[0]) & (t <= last) & (last > self.ts[0])

    def span(self, t: Array, solver: diffrax.AbstractSolver, layout: StateVector) -> tuple[Span, Array]:
        """The step in which a time lies, and whether the run has come there."""
        info, is_there = self.at(t)
        path = solver.interpolation_cls(t0=info["begin"], t1=info["end"], **info["inner"])
        return Span(path.t0, path.t1, path, info["carried"], layout), is_there

    def spans(self, solver: diffrax.AbstractSolver, layout: StateVector) -> tuple[Span, Array, Array]:
        """All steps, stacked, with the times at which they end, and which of them are there. Those that are not repeat
        the last one.
        """
        i = jnp.arange(len(self.moments))
        is_there, last = i < self.n, jnp.maximum(self.n - 1, 0)
        infos = jax.tree.map(lambda x: x[jnp.minimum(i, last)], self.infos)

        def span(info: Any) -> Span:
            path = solver.interpolation_cls(t0=info["begin"], t1=info["end"], **info["inner"])
            return Span(path.t0, path.t1, path, info["carried"], layout)

        return jax.vmap(span)(infos), self.ts[1 + jnp.minimum(i, last)], is_there
