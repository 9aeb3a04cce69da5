"""Runs with known numbers, as three small programs: the start, a chunk of steps, and the end.

The programs depend only on the model, its events and the method. The choice of saved values and the limits on steps and
events are handled outside them.
"""

import dataclasses
import functools as ft
from collections.abc import Callable
from typing import Any

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import PyTree

from .._evaluate.starts import Inputs
from .._tracing import are_traced, within_transformation
from . import run as traced
from .events.event_history import EventHistory
from .loop.carry import Carry, StepRecord
from .programs.program_digest import digest_of
from .programs.stored_program import result_of
from .results.ending import Ending, Integrated, Kept, end_run, read_inputs, solution_of, with_saved
from .results.reading import Reading
from .results.solution import Solution
from .results.trajectories import both_sides, first_bad_row, shared
from .setup.field import RunArgs
from .setup.settings import Settings
from .step.adjoint import kind_of_loop


def run_stored(settings: Settings, args: RunArgs) -> Solution:
    """Integrate as `run_traced` does. If all numbers are known, the programs are shared by all runs of a model."""
    if within_transformation() or are_traced(args):
        return traced.run_traced(settings, args)
    if settings.adjoint is not None:
        kind_of_loop(settings.adjoint)  # raises for an unsupported adjoint
    chunk, times = settings.in_chunks, args.numbers.times
    numbers = dataclasses.replace(args.numbers, times=None, most=np.asarray(settings.max_steps))
    first: traced.RunStart = result_of(_start_of(chunk), (dataclasses.replace(args, numbers=numbers),))
    args, carry, goes_on, recording = first.args, first.carry, first.goes_on, Recording(settings, first.carry)
    if not goes_on:
        recording.add(traced.without_steps(chunk, first)._replace(history=None))
    is_shown = not isinstance(settings.progress, diffrax.NoProgressMeter)
    while goes_on:
        carry, goes_on = result_of(_steps_of(chunk), (args, carry._replace(record=None)))
        recording.add(carry)
        if is_shown:
            print(f"{100.0 * _share(args, carry):.2f}%")
    parts = (args, first.carry.y, first.bad_starts, carry._replace(record=None, history=None))
    ending: Ending = result_of(_end_of(chunk), parts)
    return recording.solution(args, ending, times)


def _share(args: RunArgs, carry: Carry) -> float:
    """The completed fraction of the run."""
    t0, t1, t = float(args.numbers.t0), float(args.numbers.t1), float(args.forward * carry.t)
    return 1.0 if t1 == t0 else (t - t0) / (t1 - t0)


@dataclasses.dataclass(frozen=True)
class _RunPart:
    """A part of a run, as a function of numbers only."""

    name: str
    part: Callable[..., PyTree]
    settings: Settings

    @ft.partial(jax.jit, static_argnums=0)
    def __call__(self, arguments: Any) -> PyTree:
        # Programs that receive weakly typed numbers require strong types.
        return jax.tree.map(lambda x: jnp.asarray(x, jnp.result_type(x)), self.part(self.settings, *arguments))

    def steps(self, arguments: Any) -> int:
        return self.settings.max_steps if self.name == "steps" else 1

    def contents(self, arguments: Any) -> list[object]:
        return [arguments[0].inputs.given, *contents_of(self.settings)]  # leaves with given start values


def contents_of(settings: Settings) -> list[object]:
    """Everything in the settings that determines the trace of a run."""
    functions = (settings.stop, settings.integrand, settings.peaks, settings.stored)
    handled = ("system", "stop", "integrand", "peaks", "stored", "adjoint", "progress")
    return [
        digest_of(settings.system),
        *(None if f is None else (f.closed, f.leaves) for f in functions),
        *(getattr(settings, field.name) for field in dataclasses.fields(settings) if field.name not in handled),
    ]


def _start_of(settings: Settings) -> _RunPart:
    return _RunPart("start", traced.start_run, settings)


def _steps_of(settings: Settings) -> _RunPart:
    return _RunPart("steps", traced.advance_run, settings)


def _end_of(settings: Settings) -> _RunPart:
    return _RunPart("end", _ended, settings)


def _ended(settings: Settings, args: RunArgs, y0: Array, bad_starts: Array, end: Carry) -> Ending:
    integrated = Integrated(y0, bad_starts, end, traced.blurred(settings, args, end))
    wrong = jnp.zeros(1, bool)  # invalid known options have already raised
    return end_run(settings, args, integrated, wrong)


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
