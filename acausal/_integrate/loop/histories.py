"""Histories of signals: a row for each step, and the times at which jumps and kinks return."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from ..._declare.history import (
    BETWEEN,
    NODES,
    ORDER,
    ROW,
    START,
    WIDTH,
    coefficients,
    horner,
    polynomial,
    returns,
)
from ..events.run_events import RunEvents, joined_parts
from ..setup.field import RunArgs, values_of
from ..setup.settings import Settings
from ..setup.state_vector import Vector
from ..step.span import Span

_POSITIONS = np.append(NODES, BETWEEN)


class StepRow(NamedTuple):
    """The carried part of the vector with the row of a step, and the largest interpolation error over its tolerance."""

    carried: Vector
    misfit: Array


class Histories:
    """The histories of a model, one for each member of each `remember`."""

    def __init__(self, events: RunEvents, args: RunArgs) -> None:
        assert events.system.events is not None
        self.events, self.args, self.set = events, args, events.system.events
        self.places = events.histories
        self.sizes = jax.lax.stop_gradient(self._sizes())

    def at_start(self, t0: Array, y: Vector) -> Vector:
        """The vector with empty histories that begin at t0, where signals may jump."""
        for place in self.places:
            y = y.at[place].set(-jnp.inf)
        none = jnp.zeros(len(self.places))
        return self.begun(t0, y, none, none)

    def completed(self, path: Span) -> StepRow:
        """Records the signals on the path of a step in the last rows of the histories."""
        layout, forward = path.layout, self.args.forward
        t0, t1 = path.inner.t0, path.inner.t1
        held = jax.lax.stop_gradient((t0, t1))

        def read(share: Array) -> Array:
            time, y = path.moving_point(held[0] + share * (held[1] - held[0]))
            return self.events.signals(forward * time, y, self.args)

        values = jax.vmap(read)(jnp.asarray(0.5 * (_POSITIONS + 1.0)))
        found = coefficients(values[:-1])
        error = jnp.abs(horner(found.T, BETWEEN) - values[-1])
        misfit = jnp.max(jax.lax.stop_gradient(error / self._tolerance(values)))
        carried = path.carried
        for place, row in zip(self.places, found.T, strict=True):
            last = place[-1] - layout.carried.start
            carried = carried.at[last[WIDTH:]].set(jnp.append(t1 - carried[last[START]], row))
        return StepRow(carried, jnp.where(jnp.isnan(misfit), jnp.inf, misfit))

    def begun(self, t: Array, y: Vector, order: Array, leads: Array) -> Vector:
        """The vector with rows for the next step, which starts at t with breaks of these orders, infinite for none.
        `leads` has the derivatives of the times of jumps relative to t.
        """
        rest = self._rest(t, y)
        for place, own, lead in zip(self.places, order, leads, strict=True):
            order_here = jnp.where(jnp.isfinite(own), own, -jnp.inf)
            rest_here = rest + jnp.where(own == 0, lead, 0.0)
            first = jnp.stack([t, rest_here, order_here, *[jnp.asarray(-jnp.inf)] * (ROW - WIDTH)])
            y = y.at[place].set(jnp.concatenate([y[place[1:]], first[None]]))
        return y

    def order(self, t: Array, y: Vector, triggered: Array, heights: Array, highest: int) -> Array:
        """The order of the break of each signal at the end of a step: 0 for a jump, 1 for a kink at another event, and
        one more than the lowest order of the breaks that return. It is infinite without a break or above `highest`.
        """
        last = jnp.stack([y[place[-1]] for place in self.places])
        before = polynomial(last, t)
        jump = jnp.abs(heights) > 2.0 * self._tolerance(jnp.stack([before, before + heights]))
        remembers = self.events.remembers
        returned = jnp.where(jnp.any(triggered & remembers), 1.0 + self._returned(t, y), jnp.inf)
        common = jnp.where(jnp.any(triggered & ~remembers), 1.0, returned)
        order = jnp.where(jump, 0.0, common)
        return jax.lax.stop_gradient(jnp.where(order <= highest, order, jnp.inf))

    def longest_step(self, y: Vector) -> Array:
        """The shortest delay."""
        return jax.lax.stop_gradient(jnp.min(self._delays(y)))

    def are_full(self, t: Array, y: Vector) -> Array:
        """The histories that do not reach back by their delays."""
        oldest = jnp.stack([y[place[0, START]] for place in self.places])
        return oldest > t - self._delays(y) + 4.0 * self.args.tick(t)

    def _rest(self, t: Array, y: Vector) -> Array:
        """The rounding error of the time t of a break that returns; zero for other times."""
        rest = jnp.asarray(0.0)
        for place, delay in zip(self.places, self._delays(y), strict=True):
            times, errors = returns(y[place], delay)
            is_here = times == t
            rest = jnp.where(jnp.any(is_here), errors[jnp.argmax(is_here)], rest)
        return jax.lax.stop_gradient(rest)

    def _returned(self, t: Array, y: Vector) -> Array:
        """The lowest order of the breaks that return at t."""
        found = [jnp.asarray(jnp.inf)]
        for place, delay in zip(self.places, self._delays(y), strict=True):
            rows = y[place]
            is_here = jnp.abs(rows[:, START] + delay - t) <= 4.0 * self.args.tick(t)
            found.append(jnp.min(jnp.where(is_here & (rows[:, ORDER] >= 0.0), rows[:, ORDER], jnp.inf)))
        return jnp.min(jnp.stack(found))

    def _delays(self, y: Vector) -> Array:
        system, leaves = self.events.system, self.set.delays.leaves
        values = values_of(system, 0.0, y[self.events.layout.point], self.args.inputs, None, leaves)
        return joined_parts(self.set.delays([values[leaf] for leaf in leaves]))

    def _sizes(self) -> Array:
        """The size of each signal at nominal values of the variables."""
        return jnp.abs(
            joined_parts(self.set.signals([self.events.typical(leaf, self.args) for leaf in self.set.signals.leaves]))
        )

    def _tolerance(self, values: Array) -> Array:
        """The error tolerance of each signal."""
        return self.args.numbers.rtol * (self.sizes + jnp.max(jnp.abs(values), axis=0))


def are_full(settings: Settings, args: RunArgs, t: Array, y: Vector) -> Array:
    """The histories of a model that do not reach back by their delays."""
    events = settings.system.events
    if events is None or not events.remembered:
        return jnp.zeros(0, bool)
    return Histories(RunEvents(settings, settings.layout, is_reversible=True), args).are_full(t, y)
