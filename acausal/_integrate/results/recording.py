"""The record of a run with known numbers, kept on the host, and its solution."""

import dataclasses
from typing import Any

import jax
import numpy as np

from ..._evaluate.starts import Inputs
from ..events.event_history import EventHistory
from ..loop.carry import Carry, StepRecord
from ..setup.field import RunArgs
from ..setup.settings import Settings
from .ending import Ending, Kept, read_inputs, solution_of, with_saved
from .reading import Reading
from .solution import Solution
from .trajectories import both_sides, first_bad_row, shared


class Recording:
    """The steps and events of a run so far, in the chunks recorded by its program."""

    def __init__(self, settings: Settings, start: Carry) -> None:
        self.settings, self.last = settings, start
        self.records: list[StepRecord] = []
        self.histories = [start.history]

    def add(self, carry: Carry) -> None:
        """Add the chunk of one call of the program."""
        self.last = carry
        self.histories.append(carry.history)
        if self.settings.save != "end":
            assert carry.record is not None
            self.records.append(carry.record)

    def solution(self, args: RunArgs, ending: Ending, times: Any) -> Solution:
        """The solution, with the values at the requested times, if any."""
        args, ending = jax.tree.map(np.asarray, (args, ending))  # what NumPy computes needs no program of XLA
        settings, record, inputs = self.settings, self._record(), read_inputs(args)
        forward = np.where(args.numbers.t1 < args.numbers.t0, -1.0, 1.0)
        path = None
        if record is None:
            path = forward * np.asarray(self.last.t)[None], np.asarray(self.last.y)[None]
        elif times is not None:
            path = self._at(forward * np.asarray(times), record, inputs, forward)
        bad = None if record is None else self._not_finite(path or _rows(record, forward), inputs)
        if bad is not None:
            ending = with_saved(settings, ending, True)
        solution = solution_of(settings, args, ending, Kept(path, record, self._history()))
        solution = solution if bad is None else dataclasses.replace(solution, _not_finite=bad)
        return jax.tree.map(lambda x: jax.device_put(x) if isinstance(x, np.ndarray | np.generic) else x, solution)

    def _not_finite(self, path: tuple[np.ndarray, np.ndarray], inputs: Inputs) -> tuple[Any, Any] | None:
        """The first saved time and point at which a variable is not finite, if there is one."""
        reached = np.isfinite(path[0])
        ts, points = path[0][reached], path[1][reached, self.settings.layout.point]
        place = first_bad_row(self.settings.system, ts, points, inputs)
        return None if place is None else jax.device_put((ts[place], points[place]))

    def _at(self, times: np.ndarray, record: StepRecord, inputs: Inputs, forward: Any) -> tuple[np.ndarray, np.ndarray]:
        """The times and state vectors, both infinite at times that the run did not reach."""
        settings = self.settings
        found = Reading(settings.system, settings.solver, settings.layout).at(times, record, inputs, forward)
        is_reached = times <= float(self.last.t)
        return np.where(is_reached, forward * times, np.inf), np.where(is_reached[:, None], found, np.inf)

    def _record(self) -> StepRecord | None:
        """The chunks joined into one record, padded to a number of rows for which programs are compiled."""
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
        return StepRecord(*jax.device_put((ends(rows("ts")), ends(rows("ys")), moments, befores, infos, np.asarray(n))))

    def _history(self) -> EventHistory | None:
        """The event history, joined from all chunks."""
        parts = [history for history in self.histories if history is not None]
        if not parts:
            return None
        is_there = [np.isfinite(part.times) for part in parts]

        def joined(name: str) -> np.ndarray:
            rows = [np.asarray(getattr(part, name))[there] for part, there in zip(parts, is_there, strict=True)]
            return np.concatenate(rows)

        n, count = (np.asarray(sum(int(getattr(part, name)) for part in parts)) for name in ("n", "count"))
        return EventHistory(joined("times"), joined("happened"), n, count)


def _rows(record: StepRecord, forward: Any) -> tuple[np.ndarray, np.ndarray]:
    """The times and state vectors at the ends of the steps and before events."""
    ts, ys, moments, befores = map(np.asarray, (record.ts, record.ys, record.moments, record.befores))
    return forward * both_sides(ts, moments, ts, moments), both_sides(ys, befores, ts, moments)
