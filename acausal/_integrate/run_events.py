"""All that can happen in a run, in one numbering."""

import dataclasses
import functools as ft
from collections.abc import Iterable
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np

from .._evaluate.events import Kind
from .._evaluate.plan import Store
from .._evaluate.starts import Inputs
from .._evaluate.system import System
from .field import Given, values_of, vector_field, wanted_pairs
from .schedule import last_before, next_after
from .settings import Settings
from .state_vector import StateVector


class Here(NamedTuple):
    """What is at a point: which conditions hold, the new values that events would set, the energy stored, and whether
    the stop condition is exactly zero.
    """

    truths: Any
    values: list[Any]
    stored: Any
    is_zero: Any


@dataclasses.dataclass(frozen=True, eq=False)
class RunEvents:
    """The events of a model, then the times at which its equations or conditions change, and last the stop condition.

    Their functions take the time, the stepped vector and the numbers of the run, and give one number for each event.
    """

    settings: Settings
    layout: StateVector

    @property
    def system(self) -> System:
        return self.settings.system

    @ft.cached_property
    def n_model(self) -> int:
        return 0 if self.system.events is None else self.system.events.total

    @ft.cached_property
    def n_curved(self) -> int:
        """Zeros of functions of time that have to be searched for, because these are not affine."""
        return self.system.instants.n_curved

    @ft.cached_property
    def n_instants(self) -> int:
        """Times at which an equation changes, and the next at which a condition does that time alone tells."""
        events = self.system.events
        return self.system.instants.total + (events is not None and events.instants is not None)

    @ft.cached_property
    def total(self) -> int:
        return self.n_model + self.n_instants + self.n_curved + (self.settings.stop is not None)

    def _mask(self, model: Any, instants: bool, curved: bool, stop: bool) -> np.ndarray:
        model = np.broadcast_to(np.asarray(model, bool), self.n_model)
        others = [instants] * self.n_instants + [curved] * self.n_curved
        return np.concatenate([model, others, [stop] * (self.settings.stop is not None)]).astype(bool)

    def _of_model(self, *kinds: Kind) -> np.ndarray:
        """Which of the events of the model are of one of some kinds."""
        events = self.system.events
        return np.zeros(0, bool) if events is None else np.any([events.mask(kind) for kind in kinds], axis=0)

    @ft.cached_property
    def scheduled(self) -> np.ndarray:
        """Those whose time is known ahead."""
        return self._mask(self._of_model("at"), True, False, False)

    @ft.cached_property
    def bends(self) -> np.ndarray:
        """Those at which equations bend, in either direction: no accepted step goes over them."""
        return self._mask(self._of_model("kink"), False, True, False)

    @ft.cached_property
    def either(self) -> np.ndarray:
        """Those that happen when their condition becomes true and when it becomes false."""
        return self.bends | self._mask(False, False, False, self.settings.direction is None)

    @ft.cached_property
    def stops(self) -> np.ndarray:
        return self._mask(False, False, False, True)

    @ft.cached_property
    def refused(self) -> np.ndarray:
        """Those that must not happen."""
        return self._mask(self._of_model("refuse"), False, False, False)

    @ft.cached_property
    def acts(self) -> np.ndarray:
        """Those that change variables."""
        return self._mask(False if self.system.events is None else self.system.events.acts, False, False, False)

    @ft.cached_property
    def is_listed(self) -> np.ndarray:
        """Those that are listed in the log."""
        events = self.system.events
        named = np.zeros(0, bool) if events is None else ~events.is_internal
        return self._mask(self._of_model("when", "at", "refuse") & named, False, False, False)

    @property
    def is_searched(self) -> bool:
        """Whether there are any whose time is not known ahead."""
        return not np.all(self.scheduled)

    # The laws of `carried_to_moment`

    def rates(self, t: Any, y: Any, given: Given) -> Any:
        """The derivative of the stepped vector; zero for what events change, and for algebraic unknowns."""
        layout, system = self.layout, self.system
        n = layout.n_states - system.plan_size(system.algebraic)
        field = vector_field(dataclasses.replace(self.settings, system=system.solved or system))
        core = jnp.concatenate([y[:n], y[layout.integrals]])
        rates = field(t, core, (given, self._ordinary(y)[n:]))
        return jnp.concatenate([rates[:n], jnp.zeros(len(y) - len(rates)), rates[n:]])

    def margin(self, number: Any, t: Any, y: Any, due: Any, given: Given) -> Any:
        """The margin of one event, or how long it is past due."""
        late = (t - due)[number]
        if not self.is_searched:
            return late
        margins = self.margins(t, y, given)
        return jnp.where(jnp.asarray(self.scheduled)[number], late, self.combined(margins, margins)[0][number])

    # What is read at a point

    def margins(self, t: Any, y: Any, given: Given) -> Any:
        """How far each relation in a condition is from its limit, positive where it holds."""
        events, stop = self.system.events, self.settings.stop
        wanted = {leaf for part in (events and events.margins, stop) if part for leaf in part.leaves}
        values = self._values(
            t,
            y,
            given,
            self.system.evaluate(t, y[self.layout.point], given.inputs, wanted_pairs(self.system, wanted)),
            wanted,
        )
        found = events.margins([values[leaf] for leaf in events.margins.leaves]) if events else []
        parts = [jnp.zeros(0), *(jnp.ravel(margin) for margin in found)]
        if self.n_curved:
            parts.append(self._curved(t, y, given))
        if stop:
            parts.append(self._stop(given, values)[None])
        return jnp.concatenate(parts)

    @ft.cached_property
    def n_margins(self) -> int:
        events = self.system.events
        return (sum(events.relation_sizes) if events else 0) + self.n_curved + (self.settings.stop is not None)

    @ft.cached_property
    def reads(self) -> np.ndarray:
        """[events, margins], which events are decided by which margins."""
        events, n_own = self.system.events, self.n_curved + (self.settings.stop is not None)
        found = np.zeros((self.total, self.n_margins), bool)
        found[self.total - n_own :, self.n_margins - n_own :] = np.eye(n_own, dtype=bool)
        if events:
            found[: self.n_model, : self.n_margins - n_own] = events.reads
        return found

    def combined(self, low: Any, high: Any) -> tuple[Any, Any]:
        """Bounds of how far the condition of each event is above zero, from those of `margins`; -1 for what is
        scheduled.
        """
        events = self.system.events
        n = self.n_margins - self.n_curved - (self.settings.stop is not None)
        pairs = events.combined(low[:n], high[:n]) if events else []
        bounds = [
            jnp.concatenate([*self._in_order([pair[k] for pair in pairs], -1.0), bound[n:]])
            for k, bound in enumerate((low, high))
        ]
        return bounds[0], bounds[1]

    def here(self, t: Any, y: Any, given: Given) -> Here:
        """What holds at a point, and what events would change there."""
        system, (events, stop, stored) = self.system, (self.system.events, self.settings.stop, self.settings.stored)
        wanted = {leaf for part in (stop, stored) if part for leaf in part.leaves}
        wanted |= {*events.truths.leaves, *events.actions.leaves} if events else set()
        ordinary, point = system.solved or system, self._ordinary(y)
        store = ordinary.evaluate(t, point, given.inputs, wanted_pairs(self.system, wanted))
        values = self._values(t, y, given, store, wanted)
        parts = self._in_order(events.truths([values[leaf] for leaf in events.truths.leaves]) if events else [], False)
        if self.n_curved:
            parts.append(self._curved(t, y, given) > 0)
        margin = self._stop(given, values) if stop else jnp.asarray(-1.0)
        if stop:
            parts.append(margin[None] > 0)
        actions = events.actions([values[leaf] for leaf in events.actions.leaves]) if events else []
        energy = stored(given.numbers.stored, [values[leaf] for leaf in stored.leaves])[0] if stored else 0.0
        return Here(
            jnp.concatenate(parts),
            [jnp.ravel(value) for value in actions],
            jnp.asarray(energy, float),
            margin == 0,
        )

    def due(self, t: Any, y: Any, given: Given, done: Any = None) -> Any:
        """The next time of each scheduled event after t, or after it was last `done`; infinite for the others."""
        events, far = self.system.events, given.direction * jnp.inf
        done = jnp.full(self.total, -jnp.inf) if done is None else jnp.where(jnp.isfinite(done), done, -jnp.inf)
        found, parts, start = iter(self._times(t, y, given)), [jnp.zeros(0)], 0
        for entry in events.entries if events else ():
            after = jnp.maximum(t, done[start : start + entry.count])
            parts.append(next_after(*next(found), t, after) if entry.kind == "at" else jnp.full(entry.count, far))
            start += entry.count
        params = self.bound(y, given).params
        parts.append(self.system.instants.following(t, params, given.direction))
        if events and events.instants:
            values = self._values(t, y, given, None, events.read_by_instants)
            known = [values[leaf] for leaf in events.read_by_instants]
            parts.append(events.instants.following(t, known, given.direction)[None])
        return jnp.concatenate([*parts, jnp.full(self.total - sum(len(part) for part in parts), far)])

    def past(self, t: Any, y: Any, given: Given) -> Any:
        """The last time of each scheduled event of the model that is not after t; infinite where there is none."""
        events = self.system.events
        found = iter([last_before(time, every, t) for time, every in self._times(t, y, given)])
        parts = [
            next(found) if entry.kind == "at" else jnp.full(entry.count, jnp.inf)
            for entry in (events.entries if events else ())
        ]
        return jnp.concatenate([*parts, jnp.full(self.total - self.n_model, jnp.inf)])

    def bound(self, y: Any, given: Given) -> Inputs:
        """The inputs with the discrete variables of a point."""
        return self.system.with_discrete(given.inputs, y[self.layout.point])

    def _curved(self, t: Any, y: Any, given: Given) -> Any:
        return self.system.instants.curved(t, self.bound(y, given).params)

    def _stop(self, given: Given, values: dict[int, Any]) -> Any:
        stop = self.settings.stop
        assert stop is not None
        value = stop(given.numbers.stop, [values[leaf] for leaf in stop.leaves])[0]
        return -value if self.settings.direction is False else value

    def _times(self, t: Any, y: Any, given: Given) -> list[tuple[Any, Any]]:
        """Time or times, and period, of each entry that is scheduled."""
        events = self.system.events
        if events is None:
            return []
        values = self._values(t, y, given, None, events.times.leaves)
        found = events.times([values[leaf] for leaf in events.times.leaves])
        counts = [entry.count for entry in events.entries if entry.kind == "at"]
        return [
            (time.reshape(count, -1), jnp.broadcast_to(jnp.ravel(every), (count,))[:, None])
            for time, every, count in zip(found[::2], found[1::2], counts, strict=True)
        ]

    def _in_order(self, found: list[Any], filler: Any) -> list[Any]:
        """What is found of conditions as flat vectors, with a filler for what is scheduled."""
        remaining, events, parts = iter(found), self.system.events, []
        for entry in events.entries if events else ():
            value = jnp.full(entry.count, filler) if entry.kind == "at" else jnp.ravel(next(remaining))
            parts.append(value)
        return [jnp.full(0, filler), *parts, jnp.full(self.n_instants, filler)]

    def _values(self, t: Any, y: Any, given: Given, store: Store | None, leaves: Iterable[int]) -> dict[int, Any]:
        return values_of(self.system, t, y[self.layout.point], given, store, leaves)

    def with_algebraic(self, t: Any, y: Any, given: Given) -> Any:
        """The vector with the algebraic unknowns of the mass-matrix form that belong to its states."""
        system = self.system
        if system.solved is None:
            return y
        n = len(system.solved.nominals)
        values = system.solved.collected(t, self._ordinary(y), given.inputs, system.algebraic)
        return self.layout.with_part(y, slice(n, self.layout.n_states), values)

    def _ordinary(self, y: Any) -> Any:
        """The point for the system whose algebraic unknowns are solved for, with those of the vector as guesses."""
        solved = self.system.solved
        if solved is None:
            return y[self.layout.point]
        n = len(solved.nominals)
        first = dict(zip(self.system.algebraic, self.system.plan.starts[len(solved.states) :].tolist(), strict=False))
        places = [first[pair] + np.arange(solved.plan.size(pair[0])) for pair in solved.memory]
        return jnp.concatenate([y[:n], *(y[place] for place in places), y[self.layout.discrete]])
