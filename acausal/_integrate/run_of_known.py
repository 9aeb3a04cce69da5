"""Runs with known numbers, as three small programs: the start, a chunk of steps, and the end.

The programs depend only on the model, its events and the method. The choice of saved values and the limits on steps and
events are handled outside them.
"""

import dataclasses
import functools as ft
from typing import Any

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import PyTree

from .._tracing import are_traced, within_transformation
from . import run as traced
from .loop.carry import Carry
from .programs.made_from import digest_of
from .programs.stored_program import Storable, program_for, result_of
from .results.ending import Ending, Integrated, end_run
from .results.recording import Recording
from .results.solution import Solution
from .setup.field import RunArgs
from .setup.options import harmless
from .setup.settings import Settings
from .step.adjoint import kind_of_loop


def run_stored(settings: Settings, args: RunArgs) -> Solution:
    """Integrate as `run.run_traced` does. If all numbers are known, the programs are shared by all runs of a model."""
    if within_transformation() or are_traced(args):
        return traced.run_traced(settings, args)
    return _run(settings, args)


def _run(settings: Settings, args: RunArgs) -> Solution:
    if settings.adjoint is not None:
        kind_of_loop(settings.adjoint)  # raises for an unsupported adjoint
    program, times = settings.in_chunks, args.numbers.times
    numbers = dataclasses.replace(args.numbers, times=None, most=np.asarray(settings.max_steps))
    start: traced.RunStart = result_of(_Start(program), dataclasses.replace(args, numbers=numbers))
    carry, recording = start.carry, Recording(settings, start.carry)
    if start.goes_on:
        carry = _advanced(settings, program, start, recording)
    else:
        recording.add(traced.without_steps(program, start)._replace(history=None))
    parts = (start.args, start.carry.y, start.bad_starts, carry._replace(record=None, history=None))
    ending: Ending = result_of(_End(program), parts)
    return recording.solution(start.args, ending, times)


def _advanced(settings: Settings, program: Settings, start: traced.RunStart, recording: Recording) -> Carry:
    """The carry of the loop at the end of the run, whose steps are added to the recording."""
    carry, goes_on, further = start.carry, True, program_for(_Steps(program), (start.args, start.carry))
    is_shown = not isinstance(settings.progress, diffrax.NoProgressMeter)
    while goes_on:
        carry, goes_on = further((start.args, carry._replace(record=None)))
        recording.add(carry)
        if is_shown:
            print(f"{100.0 * _share(start.args, carry):.2f}%")
    return carry


def _share(args: RunArgs, carry: Carry) -> float:
    """The completed fraction of the run."""
    t0, t1, t = float(args.numbers.t0), float(args.numbers.t1), float(args.forward * carry.t)
    return 1.0 if t1 == t0 else (t - t0) / (t1 - t0)


@dataclasses.dataclass(frozen=True)
class _Part:
    """A part of a run, as a function of numbers only."""

    settings: Settings

    def __call__(self, arguments: Any) -> PyTree:
        return _called(type(self), self.settings, arguments)

    def contents(self, arguments: Any) -> list[object]:
        settings = self.settings
        functions = (settings.stop, settings.integrand, settings.peaks, settings.stored)
        handled = ("system", "stop", "integrand", "peaks", "stored", "adjoint", "progress")
        inputs = (arguments if isinstance(arguments, RunArgs) else arguments[0]).inputs
        return [
            inputs.given,  # leaves with given start values
            digest_of(settings.system),
            *(None if f is None else (f.closed, f.leaves) for f in functions),
            *(getattr(settings, field.name) for field in dataclasses.fields(settings) if field.name not in handled),
        ]

    def followers(self, arguments: Any) -> list[tuple[Storable, Any]]:
        return []


class _Start(_Part):
    name = "start"

    def followers(self, arguments: Any) -> list[tuple[Storable, Any]]:
        start: traced.RunStart = jax.eval_shape(self, arguments)
        carry = start.carry._replace(record=None)
        end = start.args, carry.y, start.bad_starts, carry._replace(history=None)
        return [(_Steps(self.settings), (start.args, carry)), (_End(self.settings), end)]

    @staticmethod
    def of(settings: Settings, args: RunArgs) -> traced.RunStart:
        numbers = harmless(args.numbers, jnp.asarray(False))  # gives the first step the sign of the run
        return traced.start_run(settings, dataclasses.replace(args, numbers=numbers))


class _Steps(_Part):
    name = "steps"

    @staticmethod
    def of(settings: Settings, args: tuple[RunArgs, Carry]) -> tuple[Carry, Any]:
        return traced.advance_run(settings, *args)


class _End(_Part):
    name = "end"

    @staticmethod
    def of(settings: Settings, args: tuple[RunArgs, Any, Any, Carry]) -> Ending:
        numbers, y0, bad_starts, end = args
        integrated = Integrated(y0, bad_starts, end, traced.blurred(settings, numbers, end))
        wrong = jnp.zeros(1, bool)  # invalid known options have already raised
        return end_run(settings, numbers, integrated, wrong)


@ft.partial(jax.jit, static_argnums=(0, 1))
def _called(part: type[Any], settings: Settings, arguments: Any) -> PyTree:
    return _strong(part.of(settings, arguments))


def _strong(outputs: PyTree) -> PyTree:
    """Casts weakly typed numbers to strong types, as required by the programs that receive them."""
    return jax.tree.map(lambda x: jnp.asarray(x, jnp.result_type(x)), outputs)
