"""The record of a run of known numbers, kept on the host, and the solution that it becomes."""

import dataclasses
from typing import Any

import jax
import numpy as np

from .carry import Carry
from .ending import Ending, Kept, read_inputs, solution_of, with_saved
from .event_history import EventHistory
from .field import Given
from .reading import Reading
from .record import Record
from .rows import shared
from .settings import Settings
from .solution import Solution
from .trajectories import first_not_finite


class Recording:
    """The steps and events of a run up to now, in the pieces in which its program has recorded them."""

    def __init__(self, settings: Settings, start: Carry) -> None:
        self.settings, self.last = settings, start
        self.records: list[Record] = []
        self.histories = [start.history]

    def add(self, carry: Carry) -> None:
        """Add the steps of one call of the program."""
        self.last = carry
        self.histories.append(carry.history)
        if self.settings.save != "end":
            assert carry.record is not None
            self.records.append(carry.record)

    def solution(self, given: Given, ending: Ending, times: Any) -> Solution:
        """The solution, with the values at the times asked for, if there are any."""
        record, path = self._record(), None
        if record is None:
            path = float(given.direction) * np.asarray(self.last.t)[None], np.asarray(self.last.y)[None]
        elif times is not None:
            path = self._at(np.asarray(times), record, given)
        kept = Kept(*jax.device_put((path, record, self._history())))
        solution = solution_of(self.settings, given, ending, kept)
        if self.settings.save == "end":
            return solution
        ts, ys = solution._saved(None), solution._saved(self.settings.layout.point)
        place = first_not_finite(self.settings.system, ts, ys, read_inputs(given))
        if place is None:
            return solution
        ending = with_saved(self.settings, ending, True)
        point = jax.device_put((ts[place], ys[place]))
        return dataclasses.replace(solution, result=ending.result, t1=ending.t1, _not_finite=point)

    def _at(self, times: np.ndarray, record: Record, given: Given) -> tuple[np.ndarray, np.ndarray]:
        """The times, infinite where the run has not come to, and the vectors there."""
        forward, settings = float(given.direction), self.settings
        reading = Reading(settings.system, settings.solver, settings.layout)
        found = reading.at(forward * times, record, read_inputs(given), given.direction)
        is_reached = forward * times <= float(self.last.t)
        ys = np.where(is_reached[:, None], np.asarray(found), np.inf)
        return np.where(is_reached, times, np.inf), ys

    def _record(self) -> Record | None:
        """The pieces as one, filled up to a number of rows for which programs are compiled."""
        if len(self.records) <= 1:
            return next(iter(self.records), None)
        counts = [int(record.n) for record in self.records]
        n = sum(counts)
        room = len(shared(n))

        def joined(parts: list[Any], first: int) -> np.ndarray:
            rows = [np.asarray(part)[first : first + count] for part, count in zip(parts, counts, strict=True)]
            filler = np.full((room - n, *rows[0].shape[1:]), np.inf, rows[0].dtype)
            return np.concatenate([*rows, filler])

        def ends(parts: list[Any]) -> np.ndarray:
            return np.concatenate([np.asarray(parts[0])[:1], joined(parts, 1)])

        def rows(name: str) -> list[Any]:
            return [getattr(record, name) for record in self.records]

        infos = jax.tree.map(lambda *parts: joined(list(parts), 0), *rows("infos"))
        moments, befores = joined(rows("moments"), 0), joined(rows("befores"), 0)
        return Record(*jax.device_put((ends(rows("ts")), ends(rows("ys")), moments, befores, infos, np.asarray(n))))

    def _history(self) -> EventHistory | None:
        """The moments of all pieces."""
        parts = [history for history in self.histories if history is not None]
        if not parts:
            return None
        is_there = [np.isfinite(part.times) for part in parts]

        def joined(name: str) -> np.ndarray:
            rows = [np.asarray(getattr(part, name))[there] for part, there in zip(parts, is_there, strict=True)]
            return np.concatenate(rows)

        n, count = (np.asarray(sum(int(getattr(part, name)) for part in parts)) for name in ("n", "count"))
        return EventHistory(*jax.device_put((joined("times"), joined("happened"), n, count)))
