"""All that can happen in a run, as functions of a point."""

import dataclasses
from collections.abc import Iterable
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from .._evaluate.event_set import Schedule
from .._evaluate.groups import Store
from .._evaluate.starts import Inputs
from .._indices import behind_filler
from .._numbers import Numbers, Truth
from .conditions import sign_of
from .event_numbers import EventNumbers
from .field import Given, values_of, vector_field, wanted_pairs
from .schedule import farthest, last_before, next_after


class Here(NamedTuple):
    """What is at a point: which conditions hold at the start of a run, where numbers may be equal, or the margins of
    relations later on; the new values that events would set, the energy stored (after the start), and whether the stop
    condition is exactly zero.
    """

    truths: Array
    margins: Array
    values: list[Array]
    stored: Array
    is_zero: Array


@dataclasses.dataclass(frozen=True, eq=False)
class RunEvents(EventNumbers):
    """The events of a run; their functions take the time, the stepped vector and the numbers of the run, and give one
    number for each event. A run that `is_reversible` can be differentiated in reverse mode, too.
    """

    is_reversible: bool

    # The laws of `carried_to_moment`

    def rates(self, t: Numbers, y: Array, given: Given) -> Numbers:
        """The derivative of the stepped vector; zero for what events change, and for algebraic unknowns."""
        layout, system = self.layout, self.system
        n = layout.n_states - system.n_algebraic
        field = vector_field(dataclasses.replace(self.settings, system=system.solved or system))
        core = jnp.concatenate([y[:n], y[layout.integrals]])
        rates = field(t, core, given.carrying(self._ordinary(y)[n:]))
        return jnp.concatenate([rates[:n], jnp.zeros(len(y) - len(rates)), rates[n:]])

    def margin(self, number: Array, t: Array, y: Array, due: Array, given: Given) -> Numbers:
        """The margin of one event, or how long it is past due."""
        late = (t - due)[number]
        if not self.is_searched:
            return late
        # Algebraic unknowns have no rates of their own; here they are functions of the time and the states.
        margins = self.margins(t, self.with_algebraic(t, y, given), given)
        return jnp.where(jnp.asarray(self.scheduled)[number], late, self.circuit(margins, -margins)[number])

    # What is read at a point

    def margins(self, t: Numbers, y: Array, given: Given) -> Array:
        """How far each relation in a condition is from its limit, positive where it holds."""
        wanted = wanted_pairs(self.system, self.settings.read_by_margins)
        store = self.system.evaluate(t, y[self.layout.point], given.inputs, wanted)
        return self._margins(t, y, given, self._values(t, y, given, store, self.settings.read_by_margins))

    def margins_and_rates(self, t: Numbers, y: Array, given: Given) -> tuple[Array, Array]:
        """The same, and the rates of the states."""
        wanted, point = wanted_pairs(self.system, self.settings.read_by_margins), y[self.layout.point]
        rates, store = self.system.vector_field_and_store(t, point, given.inputs, wanted)
        return self._margins(t, y, given, self._values(t, y, given, store, self.settings.read_by_margins)), rates

    def _margins(self, t: Numbers, y: Array, given: Given, values: dict[int, Numbers]) -> Array:
        events = self.system.events
        found = events.margins([values[leaf] for leaf in events.margins.leaves]) if events else []
        parts = [jnp.zeros(0), *(jnp.ravel(margin) for margin in found)]
        if self.n_curved:
            parts.append(self._curved(t, y, given))
        if self.settings.stop:
            parts.append(self._stop(given, values)[None])
        return jnp.concatenate(parts)

    def _truths(self, t: Numbers, y: Array, given: Given, values: dict[int, Numbers]) -> Array:
        """The conditions as they are written; a margin of equal numbers may have any sign by rounding."""
        events = self.system.events
        found = events.truths([values[leaf] for leaf in events.truths.leaves]) if events else []
        parts = [_spread(found, behind_filler(~self.scheduled[: self.n_model + self.n_instants]), False)]
        if self.n_curved:
            parts.append(self._curved(t, y, given) > 0)
        if self.settings.stop:
            parts.append(self._stop(given, values)[None] > 0)
        return jnp.concatenate(parts)

    def true(self, above: Array) -> Array:
        """Which conditions hold where these relations do."""
        sign = sign_of(above)
        return self.circuit(sign, -sign) > 0

    def here(self, t: Numbers, y: Array, given: Given, *, is_start: bool = True) -> Here:
        """What holds at a point, and what events would change there."""
        system, events, stop = self.system, self.system.events, self.settings.stop
        stored = None if is_start else self.settings.stored
        wanted = {leaf for part in (stop, stored) if part for leaf in part.leaves}
        decides = events and (events.truths if is_start else events.margins)
        wanted |= {*decides.leaves, *events.actions.leaves} if events and decides else set()
        ordinary, point = system.solved or system, self._ordinary(y)
        store = ordinary.evaluate(t, point, given.inputs, wanted_pairs(self.system, wanted), anew=True)
        values = values_of(ordinary, t, point, given, store, wanted)
        none, constants = jnp.zeros(0), jax.lax.stop_gradient((t, y, given, values))
        truths, margins = (self._truths(*constants), none) if is_start else (none, self._margins(*constants))
        actions = events.actions([values[leaf] for leaf in events.actions.leaves]) if events else []
        energy = stored(given.numbers.stored, [values[leaf] for leaf in stored.leaves])[0] if stored else 0.0
        return Here(
            truths,
            margins,
            [jnp.ravel(value) for value in actions],
            jnp.asarray(energy, float),
            self._stop(given, values) == 0 if stop and is_start else jnp.asarray(False),
        )

    def due(self, t: Array, y: Array, given: Given, done: Numbers | None = None) -> Array:
        """The next time of each scheduled event after t, or after it was last `done`; infinite for the others."""
        events, far = self.system.events, given.direction * jnp.inf
        since = t if done is None else jnp.maximum(t, jnp.where(jnp.isfinite(done), done, -jnp.inf))
        since = jnp.broadcast_to(since, self.total)
        own = [next_after(time, every, t, since[places]) for time, every, places in self._times(t, y, given)]
        parts = [_spread(own, self._place_of_time, far)]
        params = self.bound(y, given).params
        parts.append(self.system.instants.following(t, params, given.direction))
        if events and events.instants:
            values = self._values(t, y, given, None, events.read_by_instants)
            known = [values[leaf] for leaf in events.read_by_instants]
            parts.append(events.instants.following(t, known, given.direction)[None])
        return jnp.concatenate([*parts, jnp.full(self.total - sum(len(part) for part in parts), far)])

    def past(self, t: Array, y: Array, given: Given) -> Array:
        """The last time of each scheduled event of the model that is not after t; infinite where there is none."""
        own = [last_before(time, every, t) for time, every, _ in self._times(t, y, given)]
        rest = jnp.full(self.total - self.n_model, jnp.inf)
        return jnp.concatenate([_spread(own, self._place_of_time, jnp.inf), rest])

    def counted_from(self, t0: Numbers, y: Array, given: Given) -> Array | None:
        """The time farthest from zero among the start and the first times of what repeats; None where nothing does."""
        times = self._times(jnp.asarray(t0, float), y, given)
        firsts = [farthest(time, every, t0) for time, every, _ in times if every is not None]
        return jax.lax.stop_gradient(jnp.max(jnp.stack([jnp.abs(t0), *firsts]))) if firsts else None

    def done(self, given: Given) -> Array | np.ndarray:
        """Those that have happened already where they are true at the start, as far as discrete variables go."""
        if given.numbers.past is None:
            return self._done
        return self._done | jnp.pad(given.numbers.past.holds > 0.5, (0, self.total - self.n_model))

    def bound(self, y: Array, given: Given) -> Inputs:
        """The inputs with the discrete variables of a point."""
        return self.system.carried.with_discrete(given.inputs, y[self.layout.point])

    def _curved(self, t: Numbers, y: Array, given: Given) -> Array:
        return self.system.instants.curved(t, self.bound(y, given).params)

    def _stop(self, given: Given, values: dict[int, Numbers]) -> Array:
        stop = self.settings.stop
        assert stop is not None
        value = stop(given.numbers.stop, [values[leaf] for leaf in stop.leaves])[0]
        return -value if self.settings.direction is False else value

    def _times(self, t: Numbers, y: Array, given: Given) -> list[tuple[Array, Array | None, np.ndarray]]:
        """Rows of times, their periods, and their places among the events: of those that happen once, whose period is
        None, and of those that repeat.
        """
        events = self.system.events
        if events is None:
            return []
        values = self._values(t, y, given, None, events.times.leaves)
        found = events.times([values[leaf] for leaf in events.times.leaves])
        return [(*_table(schedule, found[::2], found[1::2]), schedule.numbers) for schedule in self.schedules]

    def _values(
        self, t: Numbers, y: Array, given: Given, store: Store | None, leaves: Iterable[int]
    ) -> dict[int, Numbers]:
        return values_of(self.system, t, y[self.layout.point], given, store, leaves)

    def with_algebraic(self, t: Array, y: Array, given: Given, *, anew: Truth = False) -> Array:
        """The vector with the algebraic unknowns of the mass-matrix form that belong to its states."""
        system = self.system
        if system.solved is None:
            return y
        n = len(system.solved.nominals)
        values = system.solved.collected(t, self._ordinary(y), given.inputs, system.algebraic, anew=anew)
        return self.layout.with_part(y, slice(n, self.layout.n_states), values)

    def _ordinary(self, y: Array) -> Array:
        """The point for the system whose algebraic unknowns are solved for, with those of the vector as guesses."""
        solved = self.system.solved
        if solved is None:
            return y[self.layout.point]
        n = len(solved.nominals)
        first = dict(zip(self.system.algebraic, self.system.plan.starts[len(solved.states) :].tolist(), strict=False))
        places = [first[pair] + np.arange(solved.plan.size(pair[0])) for pair in solved.carried.memory]
        return jnp.concatenate([y[:n], *(y[place] for place in places), y[self.layout.discrete]])


def _table(schedule: Schedule, times: list[Array], periods: list[Array]) -> tuple[Array, Array | None]:
    """A row of times for each event, filled up with what never comes; and a column of periods, None without them."""
    rows = [times[i].reshape(count, -1) for i, count in schedule.entries]
    width = max(row.shape[1] for row in rows)
    rows = [jnp.pad(row, ((0, 0), (0, width - row.shape[1])), constant_values=jnp.inf) for row in rows]
    every = [jnp.broadcast_to(jnp.ravel(periods[i]), count) for i, count in schedule.entries]
    return jnp.concatenate(rows), jnp.concatenate(every)[:, None] if schedule.repeats else None


def _spread(parts: list[Array], index: np.ndarray, filler: Numbers) -> Array:
    """Elements by index of a vector of the filler and, behind it, all `parts`."""
    return jnp.concatenate([jnp.reshape(jnp.asarray(filler), 1), *(jnp.ravel(part) for part in parts)])[index]
