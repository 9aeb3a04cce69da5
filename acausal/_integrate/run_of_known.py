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
from .results.ending import Ending, Integrated, ended
from .results.recording import Recording
from .results.solution import Solution
from .setup.field import Given
from .setup.options import harmless
from .setup.settings import Settings
from .step.adjoint import kind_of_loop


def run(settings: Settings, given: Given) -> Solution:
    """Integrate as `run.run` does. If all numbers are known, the programs are shared by all runs of a model."""
    if within_transformation() or are_traced(given):
        return traced.run(settings, given)
    return _run(settings, given)


def _run(settings: Settings, given: Given) -> Solution:
    if settings.adjoint is not None:
        kind_of_loop(settings.adjoint)  # raises for an unsupported adjoint
    program, times = settings.in_chunks, given.numbers.times
    numbers = dataclasses.replace(given.numbers, times=None, most=np.asarray(settings.max_steps))
    begun: traced.Started = result_of(_Start(program), dataclasses.replace(given, numbers=numbers))
    carry, recording = begun.carry, Recording(settings, begun.carry)
    if begun.goes_on:
        carry = _advanced(settings, program, begun, recording)
    else:
        recording.add(traced.without_steps(program, begun)._replace(history=None))
    parts = (begun.given, begun.carry.y, begun.bad_starts, carry._replace(record=None, history=None))
    ending: Ending = result_of(_End(program), parts)
    return recording.solution(begun.given, ending, times)


def _advanced(settings: Settings, program: Settings, begun: traced.Started, recording: Recording) -> Carry:
    """The carry of the loop at the end of the run, whose steps are added to the recording."""
    carry, goes_on, further = begun.carry, True, program_for(_Steps(program), (begun.given, begun.carry))
    is_shown = not isinstance(settings.progress, diffrax.NoProgressMeter)
    while goes_on:
        carry, goes_on = further((begun.given, carry._replace(record=None)))
        recording.add(carry)
        if is_shown:
            print(f"{100.0 * _share(begun.given, carry):.2f}%")
    return carry


def _share(given: Given, carry: Carry) -> float:
    """The completed fraction of the run."""
    t0, t1, t = float(given.numbers.t0), float(given.numbers.t1), float(given.direction * carry.t)
    return 1.0 if t1 == t0 else (t - t0) / (t1 - t0)


@dataclasses.dataclass(frozen=True)
class _Part:
    """A part of a run, as a function of numbers only."""

    settings: Settings

    def __call__(self, given: Any) -> PyTree:
        return _called(type(self), self.settings, given)

    def contents(self, given: Any) -> list[object]:
        settings = self.settings
        functions = (settings.stop, settings.integrand, settings.peaks, settings.stored)
        seen = ("system", "stop", "integrand", "peaks", "stored", "adjoint", "progress")
        inputs = (given if isinstance(given, Given) else given[0]).inputs
        return [
            inputs.given,  # leaves with given start values
            digest_of(settings.system),
            *(None if f is None else (f.closed, f.leaves) for f in functions),
            *(getattr(settings, field.name) for field in dataclasses.fields(settings) if field.name not in seen),
        ]

    def followers(self, given: Any) -> list[tuple[Storable, Any]]:
        return []


class _Start(_Part):
    name = "start"

    def followers(self, given: Any) -> list[tuple[Storable, Any]]:
        begun: traced.Started = jax.eval_shape(self, given)
        carry = begun.carry._replace(record=None)
        end = begun.given, carry.y, begun.bad_starts, carry._replace(history=None)
        return [(_Steps(self.settings), (begun.given, carry)), (_End(self.settings), end)]

    @staticmethod
    def of(settings: Settings, given: Given) -> traced.Started:
        numbers = harmless(given.numbers, jnp.asarray(False))  # gives the first step the sign of the run
        return traced.started(settings, dataclasses.replace(given, numbers=numbers))


class _Steps(_Part):
    name = "steps"

    @staticmethod
    def of(settings: Settings, given: tuple[Given, Carry]) -> tuple[Carry, Any]:
        return traced.advanced(settings, *given)


class _End(_Part):
    name = "end"

    @staticmethod
    def of(settings: Settings, given: tuple[Given, Any, Any, Carry]) -> Ending:
        numbers, y0, bad_starts, end = given
        integrated = Integrated(y0, bad_starts, end, traced.blurred(settings, numbers, end))
        wrong = jnp.zeros(1, bool)  # invalid known options have already raised
        return ended(settings, numbers, integrated, wrong)


@ft.partial(jax.jit, static_argnums=(0, 1))
def _called(part: type[Any], settings: Settings, given: Any) -> PyTree:
    return _strong(part.of(settings, given))


def _strong(outputs: PyTree) -> PyTree:
    """Casts weakly typed numbers to strong types, as required by the programs that receive them."""
    return jax.tree.map(lambda x: jnp.asarray(x, jnp.result_type(x)), outputs)
