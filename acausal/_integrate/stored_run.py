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

from .._tracing import are_traced, within_transformation
from . import run as traced
from .loop.carry import Carry
from .programs.made_from import digest_of
from .programs.stored_program import result_of
from .results.ending import Ending, Integrated, end_run
from .results.recording import Recording
from .results.solution import Solution
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
