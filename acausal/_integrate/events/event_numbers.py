"""Numbering of the events of a run."""

import dataclasses
import functools as ft
import math
from collections.abc import Callable

import numpy as np

from ..._evaluate.event_set import EventEntry, Schedule
from ..._evaluate.events import time_leaves
from ..._evaluate.system import System
from ..._indices import unsigned
from ..._reduce.event_indicators import NEVER, Circuit, Expression, circuit, literals_of
from ..._reduce.jaxpr import slice_output
from ..._reduce.jaxpr_instants import degrees_of
from ..setup.settings import AT_ONCE, Settings
from ..setup.state_vector import StateVector


@dataclasses.dataclass(frozen=True, eq=False)
class EventNumbers:
    """One numbering of the events of a model, then the times at which its equations or conditions change, and last the
    stop condition; with the kind of each event, its logic in terms of relations, and the variables that it writes.
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
    def n_nonlinear(self) -> int:
        """Number of nonlinear functions of time with zeros that a search must locate."""
        return self.system.instants.n_nonlinear

    @ft.cached_property
    def n_instants(self) -> int:
        """Number of times at which an equation changes, plus one for the next change of conditions of time alone."""
        events = self.system.events
        return self.system.instants.total + (events is not None and events.instants is not None)

    @ft.cached_property
    def total(self) -> int:
        return self.n_model + self.n_instants + self.n_nonlinear + (self.settings.stop is not None)

    @property
    def _members(self) -> list[EventEntry]:
        """The entry of each event of the model."""
        return self.system.events.members if self.system.events else []

    @ft.cached_property
    def _kinds(self) -> np.ndarray:
        """The kind of each event: that of its entry, or "instant", "nonlinear" or "stop"."""
        own = [entry.kind for entry in self._members]
        others = ["instant"] * self.n_instants + ["nonlinear"] * self.n_nonlinear
        return np.array([*own, *others, *["stop"] * (self.settings.stop is not None)], "U9")

    def _of_kinds(self, *kinds: str) -> np.ndarray:
        return np.isin(self._kinds, kinds)

    def _of_entries(self, has: Callable[[EventEntry], bool]) -> np.ndarray:
        """The events of the model whose entries satisfy `has`."""
        own = [has(entry) for entry in self._members]
        return np.array(own + [False] * (self.total - self.n_model), bool)

    @ft.cached_property
    def scheduled(self) -> np.ndarray:
        """Time events: their times are known in advance."""
        return self._of_kinds("at", "sample", "remember", "instant", "started")

    @ft.cached_property
    def remembers(self) -> np.ndarray:
        """Jumps and kinks of recorded signals that return after a delay."""
        return self._of_kinds("remember")

    @ft.cached_property
    def nonlinear(self) -> np.ndarray:
        """Zeros of nonlinear functions of time at which equations change. Once found, they are known times."""
        return self._of_kinds("nonlinear")

    @ft.cached_property
    def either(self) -> np.ndarray:
        """Events that happen both when their condition becomes true and when it becomes false."""
        return self._of_kinds("nonlinear", "hold", *(["stop"] if self.settings.direction is None else []))

    @ft.cached_property
    def held(self) -> np.ndarray:
        """The conditions of `ifelse`."""
        return self._of_kinds("hold")

    @ft.cached_property
    def follows(self) -> np.ndarray:
        """Events that make discrete variables equal to values, as long as these differ."""
        return self._of_kinds("follow")

    @ft.cached_property
    def starts(self) -> np.ndarray:
        """Events that happen once, at the start of a run that neither continues another one nor is a start search."""
        is_new = not (self.settings.is_resumed or self.settings.is_search)
        return self._of_kinds("started") & is_new

    @property
    def has_start(self) -> bool:
        """Whether the model has an event at the start of a run."""
        return bool(np.any(self._of_kinds("started")))

    @ft.cached_property
    def stops(self) -> np.ndarray:
        return self._of_kinds("stop")

    @ft.cached_property
    def refused(self) -> np.ndarray:
        """Events that must not happen."""
        return self._of_kinds("refuse")

    @ft.cached_property
    def clocks(self) -> np.ndarray:
        """Repeating events, which read the values after all other events of their instant, except samples."""
        return self._of_entries(lambda entry: entry.repeats)

    @ft.cached_property
    def samples(self) -> np.ndarray:
        """Repeating events that happen together with the other events of their instant, except at the start."""
        return self._of_kinds("sample")

    @ft.cached_property
    def acts(self) -> np.ndarray:
        """Events that change variables."""
        return self._of_entries(lambda entry: bool(entry.targets) and entry.kind != "yields") | self.impacts

    @ft.cached_property
    def impacts(self) -> np.ndarray:
        """Events with an impulse. Those of one instant happen together, after all others that are due."""
        return self._of_kinds("impact")

    @ft.cached_property
    def yields(self) -> np.ndarray:
        """The values that discrete variables have during an impulse: no events, but changes on trial."""
        return self._of_kinds("yields")

    @ft.cached_property
    def forces(self) -> np.ndarray:
        """The position in the stepped vector of the force of each impact."""
        places = self.system.carried.discrete_places
        numbered = self.system.events.numbered if self.system.events else []
        own = [places[entry.force] for _, entry in numbered if entry.force is not None]
        return np.concatenate([np.zeros(0, int), *own])

    @ft.cached_property
    def determines_rates(self) -> np.ndarray:
        """The positions in the stepped vector of the states and of the discrete variables that equations read."""
        system, carried = self.system, self.system.carried
        states = np.arange(len((system.solved or system).nominals))  # without the unknowns of the mass-matrix form
        leaves = {leaf for key in filter(carried.is_discrete, system.intake.used) for leaf in carried.leaves_of(key)}
        return np.concatenate([states, *(carried.discrete_places[leaf] for leaf in sorted(leaves))])

    @ft.cached_property
    def responds(self) -> np.ndarray:
        """State events that change variables; in a start search, only discrete ones."""
        return self.acts & ~self.scheduled

    @ft.cached_property
    def _done(self) -> np.ndarray:
        return self.responds & ~self.held & (self.settings.is_resumed or self.settings.is_initialised)

    @ft.cached_property
    def waits(self) -> np.ndarray:
        """Events that a start search leaves to its modes and to the subsequent run."""
        return self.responds & self.settings.is_search

    @ft.cached_property
    def sets_others(self) -> np.ndarray:
        """Events that set variables other than discrete ones."""
        discrete = self.system.carried.discrete_places
        return self._of_entries(lambda entry: any(leaf not in discrete for leaf in entry.targets))

    @ft.cached_property
    def remains(self) -> np.ndarray:
        """Events that set variables other than discrete ones, which a start search leaves to the run."""
        return self.sets_others & (not (self.settings.is_resumed or self.settings.is_search))

    @ft.cached_property
    def is_listed(self) -> np.ndarray:
        """Events with a name for users."""
        return self._of_entries(lambda entry: entry.is_listed)

    @ft.cached_property
    def is_logged(self) -> np.ndarray:
        """Events that are rows of the event log: all listed ones except those that are periodic."""
        return self._of_entries(lambda entry: entry.is_logged)

    @ft.cached_property
    def room(self) -> int:
        """Number of moments that a run can record at one instant. All times known in advance may coincide."""
        reads_time = [
            any(self.of_time_alone[i] for i in found["holds"] | found["fails"])
            for found in map(literals_of, self.logic)
        ]
        return AT_ONCE + int(np.sum(reads_time) + np.sum(self._of_kinds("at", "sample")))

    @property
    def resets_times(self) -> bool:
        """Whether events may change the times of scheduled events, because these depend on discrete variables."""
        events = self.system.events
        return events is not None and not set(self.system.carried.discrete_places).isdisjoint(events.times.leaves)

    @ft.cached_property
    def targets(self) -> list[tuple[int, int, int]]:
        """The first event number, the number of events, and the leaf of each new value that the model's events set."""
        numbered = self.system.events.numbered if self.system.events else []
        return [(first, entry.count, leaf) for first, entry in numbered for leaf in entry.targets]

    @property
    def schedules(self) -> list[Schedule]:
        return self.system.events.schedules if self.system.events else []

    @ft.cached_property
    def _place_of_time(self) -> np.ndarray:
        """Position of each event's time among the times of all schedules, counted from 1; 0 if it has none."""
        numbers = np.concatenate([np.zeros(0, int), *(schedule.numbers for schedule in self.schedules)]).astype(int)
        places = np.zeros(self.n_model, int)
        places[numbers] = 1 + np.arange(len(numbers))
        return unsigned(places)

    @property
    def _sizes_written(self) -> list[int]:
        events = self.system.events
        return [math.prod(aval.shape) for aval in events.actions.closed.out_avals] if events else []

    @ft.cached_property
    def writes(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Writes of events to the discrete variables, in turns: if several events write to one, the last turn wins.

        For each turn and discrete variable: the number of the event that writes it, the index of its new value among
        all new values, and whether any event writes it in this turn.
        """
        places, start = self.system.carried.discrete_places, 0
        found: dict[int, list[tuple[int, int]]] = {}
        for (first, count, leaf), size in zip(self.targets, self._sizes_written, strict=True):
            own, width = places.get(leaf, np.zeros(0, int)), size // count
            for i, place in enumerate((own - self.layout.discrete.start).tolist()):
                member, element = divmod(i, len(own) // count)
                # As in any assignment, a single number is broadcast to all elements.
                found.setdefault(place, []).append((first + member, start + member * width + element % width))
            start += size
        n, turns = self.layout.n_discrete, max(map(len, found.values()), default=0)
        number, element = unsigned(np.zeros((turns, n))), unsigned(np.zeros((turns, n)))
        is_own = np.zeros((turns, n), bool)
        for place, items in found.items():
            for turn, (event, index) in enumerate(items):
                number[turn, place], element[turn, place], is_own[turn, place] = event, index, True
        return number, element, is_own

    @property
    def is_searched(self) -> bool:
        """Whether there are events at times not known in advance."""
        return not np.all(self.scheduled | self.follows)

    @ft.cached_property
    def n_indicators(self) -> int:
        return (self.system.events.n_relations if self.system.events else 0) + self._n_own

    @property
    def _n_own(self) -> int:
        """Number of events with their own event indicator: nonlinear functions of time, and the stop condition."""
        return self.n_nonlinear + (self.settings.stop is not None)

    @ft.cached_property
    def logic(self) -> list[Expression]:
        """Logical expression of each event in terms of relations; never true for scheduled events."""
        own: list[Expression] = [("holds", self.n_indicators - self._n_own + i) for i in range(self._n_own)]
        model = self.system.events.logic if self.system.events else ()
        return [*(expression or NEVER for expression in model), *[NEVER] * self.n_instants, *own]

    @ft.cached_property
    def of_time(self) -> np.ndarray:
        """Relations of components that depend on no variable except time, and are affine in it."""
        events, system = self.system.events, self.system
        times = time_leaves(system.flat, system.merged)
        found: list[bool] = []
        if events:
            for i, aval in enumerate(events.indicators.closed.out_avals):
                part = slice_output(events.indicators.closed, i)
                read = [events.indicators.leaves[place] for place in part.used]
                moves = any(system.flat.is_variable(leaf) and leaf not in times for leaf in read)
                (degree,) = degrees_of(part.jaxpr, [int(leaf in times) for leaf in read])
                found += [not moves and degree < 2] * math.prod(aval.shape)
        return np.array(found, bool)

    @property
    def of_time_alone(self) -> np.ndarray:
        """The relations `of_time`, among all event indicators."""
        return np.append(self.of_time, np.zeros(self._n_own, bool))

    @ft.cached_property
    def of_equals(self) -> np.ndarray:
        """The sign of each event indicator for equal sides; 0 if the indicator is not a difference."""
        own = self.system.events.of_equals if self.system.events else np.zeros(0, int)
        return np.append(own, np.zeros(self._n_own, int))

    @ft.cached_property
    def polarity(self) -> tuple[np.ndarray, np.ndarray]:
        """The relations that occur in conditions unnegated, and those that occur negated. If a condition also triggers
        an event when it becomes false, its relations count as both.
        """
        positive, negative = np.zeros((2, self.n_indicators), bool)
        for i, expression in enumerate(self.logic):
            own = literals_of(expression)
            positive[list(own["holds"] | (own["fails"] if self.either[i] else frozenset()))] = True
            negative[list(own["fails"] | (own["holds"] if self.either[i] else frozenset()))] = True
        return positive, negative

    @ft.cached_property
    def relations_of(self) -> np.ndarray:
        """The relations in the condition of each event, [events, relations]."""
        found = np.zeros((self.total, self.n_indicators), bool)
        for i, expression in enumerate(self.logic):
            own = literals_of(expression)
            found[i, list(own["holds"] | own["fails"])] = True
        return found

    @ft.cached_property
    def of_laws(self) -> np.ndarray:
        """The relations that occur only in conditions of `ifelse`."""
        of_held, of_others = self.relations_of[self.held], self.relations_of[~self.held]
        return np.any(of_held, axis=0) & ~np.any(of_others, axis=0)

    @ft.cached_property
    def circuit(self) -> Circuit:
        """Event indicator of each event's condition from those of the relations and their negatives; or bounds of it
        from bounds of these.
        """
        return circuit(self.logic, self.n_indicators)
