"""The events of a run as functions of a point."""

import dataclasses
import functools as ft
from collections.abc import Iterable
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from ..._declare.history import ROW, START
from ..._evaluate.event_set import Schedule
from ..._evaluate.groups import Segments
from ..._evaluate.starts import Inputs
from ..._numbers import Numbers, Truth
from ..._reduce.event_indicators import TINY
from ..._reduce.incidence import nominal_size
from ..setup.field import RunArgs, values_of, vector_field, wanted_pairs
from ..setup.schedule import farthest, last_before, next_after
from ..step.interval import PathSample, corrected_sample, sample
from ..step.span import Span
from .crossing import Conditions
from .event_numbers import EventNumbers

RESOLUTION = 4096  # hysteresis of relations in rounding units of the compared terms: about 1e-12 of their size


class Here(NamedTuple):
    """Values at a point: the event indicators of the relations, the new values that events would set, whether each
    contact is closed with its separation speed and the least one after an impact, and the stored energy (after the
    start).
    """

    indicators: Array
    values: list[Array]
    contacts: tuple[Array, Array, Array]
    stored: Array


@dataclasses.dataclass(frozen=True, eq=False)
class RunEvents(EventNumbers):
    """The events of a run. Its functions take the time, the stepped vector and the numbers of the run, and return one
    number for each event. If `is_reversible`, the run supports reverse mode, too.
    """

    is_reversible: bool

    # The protocol `Laws` of `carried_to_moment`

    def rates(self, t: Numbers, y: Array, args: RunArgs, happened: Array, ahead: Numbers) -> Numbers:
        """The time derivative of the stepped vector; zero for its part held in steps and for algebraic unknowns.
        Equations with an instant that has `happened` are `ahead` of t.
        """
        layout, system = self.layout, self.system
        y, args = self._ahead(y, args, happened, ahead)
        n = layout.n_states - system.n_algebraic
        field = vector_field(dataclasses.replace(self.settings, system=system.solved or system))
        core = jnp.concatenate([y[:n], y[layout.integrals]])
        rates = field(t, core, args.carrying(self._ordinary(y)[n:]))
        return jnp.concatenate([rates[:n], jnp.zeros(len(y) - len(rates)), rates[n:]])

    def _ahead(self, y: Array, args: RunArgs, happened: Array, ahead: Numbers) -> tuple[Array, RunArgs]:
        """The vector and the numbers between the events of an instant: equations with an instant that has `happened`
        are `ahead`, and so are histories with a break that has returned.
        """
        if (instants := self.system.instants).rows:
            scheduled, nonlinear = happened[self.n_model :][: instants.total], happened[np.flatnonzero(self.nonlinear)]
            params = dataclasses.replace(args.inputs.params, ahead=instants.ahead(scheduled, nonlinear, ahead))
            args = dataclasses.replace(args, inputs=dataclasses.replace(args.inputs, params=params))
        for place, has_returned in zip(self.histories, happened[np.flatnonzero(self.remembers)], strict=True):
            y = y - jnp.where(has_returned & np.isin(np.arange(len(y)), place[:, START]), ahead, 0.0)
        return y, args

    # Recorded signals

    @ft.cached_property
    def histories(self) -> list[np.ndarray]:
        """The places of each history in the stepped vector, [rows, columns]."""
        events, places = self.system.events, self.system.carried.discrete_places
        return [
            member
            for entry in (events.remembered if events else [])
            if entry.history is not None
            for member in places[entry.history].reshape(entry.count, -1, ROW)
        ]

    def signals(self, t: Numbers, y: Array, args: RunArgs) -> Array:
        """The recorded signals at a point."""
        events = self.system.events
        assert events is not None
        wanted = wanted_pairs(self.system, events.signals.leaves)
        store = self.system.evaluate(t, y[self.layout.point], args.inputs, wanted)
        values = self._values(t, y, args, store, events.signals.leaves)
        return joined_parts(events.signals([values[leaf] for leaf in events.signals.leaves]))

    def signals_between(self, before: Numbers, t: Numbers, y: Numbers, args: RunArgs, happened: Array) -> Array:
        """The recorded signals between the events of an instant t, at a time `before` it, without derivatives.
        Empty if there are none.
        """
        if not self.histories:
            return jnp.zeros(0)
        before, t, y, args = jax.lax.stop_gradient((jnp.asarray(before), t, jnp.asarray(y), args))
        y, args = self._ahead(y, args, happened, t - before)
        return self.signals(before, self.with_algebraic(before, y, args), args)

    def indicator(self, number: Array, t: Array, y: Array, due: Array, args: RunArgs) -> Numbers:
        """The event indicator of one event; for a scheduled event, the time since it was due."""
        late = (t - due)[number]
        if not self.is_searched:
            return late
        # Algebraic unknowns have no rates; here they are functions of the time and the states.
        indicators = self.indicators(t, self.with_algebraic(t, y, args), args)
        return jnp.where(jnp.asarray(self.scheduled)[number], late, self.circuit(indicators, -indicators)[number])

    # Values at a point

    def indicators(self, t: Numbers, y: Array, args: RunArgs) -> Array:
        """The event indicator of each relation in a condition, positive if the relation holds."""
        wanted = wanted_pairs(self.system, self.settings.read_by_indicators)
        store = self.system.evaluate(t, y[self.layout.point], args.inputs, wanted)
        return self._indicators(t, y, args, self._values(t, y, args, store, self.settings.read_by_indicators))

    def indicators_and_rates(self, t: Numbers, y: Array, args: RunArgs) -> tuple[Array, Array]:
        """The event indicators, and the rates of the states."""
        wanted, point = wanted_pairs(self.system, self.settings.read_by_indicators), y[self.layout.point]
        rates, store = self.system.vector_field_and_store(t, point, args.inputs, wanted)
        return self._indicators(t, y, args, self._values(t, y, args, store, self.settings.read_by_indicators)), rates

    def _indicators(self, t: Numbers, y: Array, args: RunArgs, values: dict[int, Numbers]) -> Array:
        events = self.system.events
        found = events.indicators([values[leaf] for leaf in events.indicators.leaves]) if events else []
        parts = [jnp.zeros(0), *(jnp.ravel(indicator) for indicator in found)]
        if self.n_nonlinear:
            parts.append(self.system.instants.nonlinear(t, self.bound(y, args).params))
        if (stop := self.settings.stop) is not None:
            (value,) = stop(args.numbers.stop, [values[leaf] for leaf in stop.leaves])
            parts.append((-value if self.settings.direction is False else value)[None])
        return jnp.concatenate(parts)

    def renewed(self, t: Numbers, truths: Array, changed: Array, indicators: Array, args: RunArgs) -> Array:
        """The truths of the relations at a point. Relations within their hysteresis bands keep their truths, except
        those whose sides have become exactly equal, such as a signal that has become zero. The bands of those that have
        `changed` at this instant are wider, as they are on the path of a step; equal sides are the moment of the change
        there.
        """
        size = jnp.abs(indicators)
        is_clear = (size > self.wider(t, ~changed, args)) | ((size <= TINY) & ~changed)
        return jnp.where(is_clear, indicators > 0, truths)

    def wider(self, t: Numbers, armed: Array, args: RunArgs) -> Array:
        """The hysteresis of each relation; wider for those that are not `armed`."""
        return jnp.where(armed, self.band(t, args), jnp.maximum(self.band(t, args), args.back))

    def truths_at_start(self, t: Numbers, indicators: Array, args: RunArgs) -> Array:
        """The truths of the relations at the start of a run. Within their bands, they are those of equal sides, because
        start values have rounding errors. If the run continues another one, relations within their bands count as not
        yet met, so that an event about to happen falls into this run.
        """
        sign = self.of_equals
        if self.settings.is_resumed:
            positive, negative = self.polarity
            sign = np.where(positive & ~negative, -1, np.where(negative & ~positive, 1, 0))
        is_equal = (jnp.abs(indicators) <= self.band(t, args)) & (sign != 0)
        return jnp.where(is_equal, sign > 0, indicators > 0)

    def sample(self, path: Span, args: RunArgs, t: Numbers) -> PathSample:
        """The event indicators at a time on the path of a step."""
        forward, correction = args.forward, path.correction
        if correction is None:
            return sample(lambda t: self.indicators(forward * t, path.plain(t), args), t)

        def values(t: Numbers, y: Array) -> tuple[Array, Array]:
            indicators, rates = self.indicators_and_rates(forward * t, y, args)
            return indicators, forward * rates

        return corrected_sample(
            values, path.plain, ft.partial(correction.error_at, path.inner), t, self.layout.n_states
        )

    def conditions(self, path: Span, t: Numbers, armed: Array, args: RunArgs) -> Conditions:
        """The conditions on the path of a step, up to a time. Relations that are not `armed` have changed and have
        stayed close to zero since; their hysteresis is wider.
        """
        positive, negative = self.polarity
        see = ft.partial(self.sample, path, args)
        band = self.wider(t, armed, args)
        return Conditions(see, self.circuit, self.either, band, armed, positive & ~negative, negative & ~positive)

    def band(self, t: Numbers, args: RunArgs) -> Array:
        """The hysteresis of each relation at a time; half the time resolution for relations of time alone."""
        return jnp.where(self.of_time_alone, 0.5 * args.tick(t), args.band)

    def bands(self, args: RunArgs) -> tuple[Array, Array]:
        """The hysteresis of each relation, and that of its change back, relative to the size of its terms at nominal
        values of all variables. The first covers rounding. For piecewise laws, the second covers the error of the run:
        otherwise errors would make a state at rest on a breakpoint cross it repeatedly. Both are zero here for
        relations of time alone and for the stop condition.
        """
        events = self.system.events
        if events is None:
            return jnp.zeros(self.n_indicators), jnp.zeros(self.n_indicators)
        sizes = [self.typical(leaf, args) for leaf in events.sizes.leaves]
        found = [jnp.ravel(size) for size in events.sizes(sizes)]
        own = jnp.concatenate([jnp.zeros(0), *found])
        size = jnp.where(jnp.isfinite(own) & ~self.of_time, own, 0.0)
        size = jax.lax.stop_gradient(jnp.concatenate([size, jnp.zeros(self._n_own)]))
        rtol = jax.lax.stop_gradient(args.numbers.rtol)
        least = RESOLUTION * jnp.finfo(size.dtype).eps
        return least * size, jnp.where(self.of_laws, jnp.maximum(rtol, least), least) * size

    def typical(self, leaf: int, args: RunArgs) -> Numbers:
        """A typical value: that of a parameter; a different random number near the nominal size for each variable; zero
        for a discrete variable, whose initial value may be far off until it is set. Times without a nominal size are
        not longer than the run.
        """
        flat = self.system.flat.leaves[leaf]
        if flat.declaration.role == "discrete":
            return jnp.zeros(flat.stack + flat.sizes)
        if not self.system.flat.is_variable(leaf):
            return jnp.asarray(args.inputs.params.leaves[leaf], float)
        shape = flat.stack + flat.sizes
        size: Numbers = nominal_size(flat)
        if flat.declaration.unit == "s" and flat.nominal is None and flat.declaration.nominal is None:
            size = jnp.minimum(size, jnp.abs(args.numbers.t1 - args.numbers.t0))
        return jnp.asarray(size * np.random.default_rng(leaf).uniform(0.5, 1.0, shape))

    def here(self, t: Numbers, y: Array, args: RunArgs, *, is_start: bool = True) -> Here:
        """The event indicators at a point, the new values that events would set there, and the stored energy."""
        system, events, stop = self.system, self.system.events, self.settings.stop
        stored = None if is_start else self.settings.stored
        wanted = {leaf for part in (stop, stored) if part for leaf in part.leaves}
        wanted |= {*events.indicators.leaves, *events.actions.leaves, *events.contacts.leaves} if events else set()
        ordinary, point = system.solved or system, self._ordinary(y)
        store = ordinary.evaluate(t, point, args.inputs, wanted_pairs(self.system, wanted), anew=True)
        values = values_of(ordinary, t, point, args.inputs, store, wanted)
        indicators = self._indicators(*jax.lax.stop_gradient((t, y, args, values)))
        actions = events.actions([values[leaf] for leaf in events.actions.leaves]) if events else []
        contacts = events.contacts([values[leaf] for leaf in events.contacts.leaves]) if events else []
        closed, speeds, after = (joined_parts(contacts[i::3]) for i in range(3))
        energy = stored(args.numbers.stored, [values[leaf] for leaf in stored.leaves])[0] if stored else 0.0
        return Here(
            indicators,
            [jnp.ravel(value) for value in actions],
            (closed > 0.5, speeds, after),
            jnp.asarray(energy, float),
        )

    def contact_rates(self, t: Numbers, y: Array, args: RunArgs) -> tuple[Array, Array]:
        """The rates of the states, except algebraic unknowns, and those of the separation speeds of all contacts."""
        system, events = self.system.solved or self.system, self.system.events
        assert events is not None
        leaves, point = events.accelerations.leaves, self._ordinary(y)
        wanted = [*system.rates, *wanted_pairs(self.system, leaves)]
        store = system.evaluate(t, point, args.inputs, wanted, anew=True)
        values = values_of(system, t, point, args.inputs, store, leaves)
        rates = events.accelerations([values[leaf] for leaf in leaves])
        return system.plan.collect(store, system.rates), joined_parts(rates)

    def due(self, t: Array, y: Array, args: RunArgs, done: Numbers | None = None) -> Array:
        """The next time of each scheduled event after t, or after it was last `done`; infinite for other events."""
        events, far = self.system.events, args.forward * jnp.inf
        since = t
        if done is not None:  # events within the time resolution of the start have happened, too
            since = jnp.maximum(t, jnp.where(jnp.isfinite(done), done, -jnp.inf)) + 0.5 * args.tick(t)
        since = jnp.broadcast_to(since, self.total)
        own = [next_after(time, every, t, since[places]) for time, every, places in self._times(t, y, args)]
        parts = [_spread(own, self._place_of_time, far)]
        params = self.bound(y, args).params
        parts.append(self.system.instants.following(t, params, args.forward))
        if events and events.instants:
            values = self._values(t, y, args, None, events.read_by_instants)
            known = [values[leaf] for leaf in events.read_by_instants]
            parts.append(events.instants.following(t, known, args.forward)[None])
        return jnp.concatenate([*parts, jnp.full(self.total - sum(len(part) for part in parts), far)])

    def past(self, t: Array, y: Array, args: RunArgs) -> Array:
        """The last time not after t of each scheduled event of the model; infinite if there is none."""
        found = self._by_event([last_before(time, every, t) for time, every, _ in self._times(t, y, args)], jnp.inf)
        return jnp.where(self.starts, t, found)

    def set_anew(self, t: Numbers, before: Array, after: Array, args: RunArgs) -> tuple[Array, Array]:
        """The scheduled events of the model whose times differ between two vectors, and the last of these times in the
        second vector that is not after t; infinite if there is none.
        """

        def tables(y: Array) -> list[tuple[Array, Array | None]]:
            return [(times, every) for times, every, _ in self._times(t, y, args)]

        # One batch computes both, so that they do not differ by rounding.
        found = jax.vmap(tables)(jax.lax.stop_gradient(jnp.stack([before, after])))
        is_reset, last = [], []
        for times, every in found:
            differs = times[0] != times[1]
            if every is not None:
                differs |= every[0] != every[1]
            is_reset.append(jnp.any(differs, axis=1))
            period = None if every is None else every[1]
            last.append(last_before(jnp.where(differs, times[1], jnp.inf), period, t))
        return self._by_event(is_reset, False), self._by_event(last, jnp.inf)

    def _by_event(self, parts: list[Array], filler: Numbers) -> Array:
        """Values for all events: `parts` for the scheduled events of the model, the filler for all others."""
        own = _spread(parts, self._place_of_time, filler)
        return jnp.concatenate([own, jnp.full(self.total - self.n_model, filler)])

    def counted_from(self, t0: Numbers, y: Array, args: RunArgs) -> Array | None:
        """The largest absolute time among the start and the first times of repeating events; None without any."""
        times = self._times(jnp.asarray(t0, float), y, args)
        firsts = [farthest(time, every, t0) for time, every, _ in times if every is not None]
        return jax.lax.stop_gradient(jnp.max(jnp.stack([jnp.abs(t0), *firsts]))) if firsts else None

    def done(self, args: RunArgs) -> Array | np.ndarray:
        """Events that, if their conditions hold at the start, have already set their discrete variables."""
        if args.numbers.past is None:
            return self._done
        return self._done | jnp.pad(args.numbers.past.holds > 0.5, (0, self.total - self.n_model))

    def bound(self, y: Array, args: RunArgs) -> Inputs:
        """The inputs with the discrete variables of a point."""
        return self.system.carried.with_discrete(args.inputs, y[self.layout.point])

    def _times(self, t: Numbers, y: Array, args: RunArgs) -> list[tuple[Array, Array | None, np.ndarray]]:
        """Rows of times, their periods, and the numbers of their events, for each schedule: events that happen once
        (the period is None), and events that repeat.
        """
        events = self.system.events
        if events is None:
            return []
        values = self._values(t, y, args, None, events.times.leaves)
        found = events.times([values[leaf] for leaf in events.times.leaves])
        return [(*_table(schedule, found[::2], found[1::2]), schedule.numbers) for schedule in self.schedules]

    def _values(
        self, t: Numbers, y: Array, args: RunArgs, store: Segments | None, leaves: Iterable[int]
    ) -> dict[int, Numbers]:
        return values_of(self.system, t, y[self.layout.point], args.inputs, store, leaves)

    def with_algebraic(self, t: Array, y: Array, args: RunArgs, *, anew: Truth = False) -> Array:
        """The vector with the algebraic unknowns of the mass-matrix form solved for its states."""
        system = self.system
        if system.solved is None:
            return y
        n = len(system.solved.nominals)
        values = system.solved.collected(t, self._ordinary(y), args.inputs, system.algebraic, anew=anew)
        return self.layout.with_part(y, slice(n, self.layout.n_states), values)

    def _ordinary(self, y: Array) -> Array:
        """The point of the system that solves for its algebraic unknowns, with those of the vector as guesses."""
        solved = self.system.solved
        if solved is None:
            return y[self.layout.point]
        n = len(solved.nominals)
        first = dict(zip(self.system.algebraic, self.system.plan.starts[len(solved.states) :].tolist(), strict=False))
        places = [first[pair] + np.arange(solved.plan.size(pair[0])) for pair in solved.carried.memory]
        return jnp.concatenate([y[:n], *(y[place] for place in places), y[self.layout.discrete]])


def _table(schedule: Schedule, times: list[Array], periods: list[Array]) -> tuple[Array, Array | None]:
    """A row of times for each event, padded with infinity; and a column of periods, None without them."""
    rows = [times[i].reshape(count, -1) for i, count in schedule.entries]
    width = max(row.shape[1] for row in rows)
    rows = [jnp.pad(row, ((0, 0), (0, width - row.shape[1])), constant_values=jnp.inf) for row in rows]
    every = [jnp.broadcast_to(jnp.ravel(periods[i]), count) for i, count in schedule.entries]
    return jnp.concatenate(rows), jnp.concatenate(every)[:, None] if schedule.repeats else None


def joined_parts(parts: list[Array]) -> Array:
    """All elements of some arrays as a vector."""
    return jnp.concatenate([jnp.zeros(0), *(jnp.ravel(part) for part in parts)])


def _spread(parts: list[Array], index: np.ndarray, filler: Numbers) -> Array:
    """Elements by index of the vector that consists of the filler followed by all `parts`."""
    return jnp.concatenate([jnp.reshape(jnp.asarray(filler), 1), *(jnp.ravel(part) for part in parts)])[index]
