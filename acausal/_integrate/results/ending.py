"""The end of a run: its outcome and its solution."""

import dataclasses
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import Array

from ..._compiled_once import compiled_once
from ..._evaluate.diagnosis import singular_blocks
from ..._evaluate.groups import ModelParameters
from ..._evaluate.starts import Inputs
from ..._indices import first_true
from ..._numbers import Truth
from ..events.event_history import EventHistory
from ..events.iteration import ACCUMULATED, CONTRADICTED, ENDLESS, FULL, REFUSED, STOPPED
from ..loop.carry import Carry, StepRecord
from ..loop.histories import are_full
from ..setup.field import RunArgs
from ..setup.options import sentences
from ..setup.result import Result
from ..setup.settings import Settings
from ..setup.user_function import NOTHING
from .solution import Solution
from .unresolved import are_unresolved


class Integrated(NamedTuple):
    """The initial state vector, a mask of invalid start values, the final carry of the loop, and the largest event
    indicator of each relation that changed and could not change back (zero for all others).
    """

    start: Array
    bad_starts: Array
    end: Carry
    blurred: Array


class Ending(NamedTuple):
    """The outcome of a run, the index of the demand, parameter, start value or block that caused a failure, and the
    numbers of the solution that need no record.
    """

    result: Any
    culprit: Array
    t1: Array
    start: tuple[Array, Array]
    end: tuple[Array, Array]
    integrals: Array
    losses: Array
    peaks: Array
    errors: Array
    largest: Array
    blurred: Array
    unresolved: Array
    n_steps: Array
    n_accepted: Array


class Kept(NamedTuple):
    """The saved data of a run: the requested times with their state vectors, the recorded steps, and the events."""

    path: tuple[Any, Any] | None
    record: StepRecord | None
    history: EventHistory | None


def end_run(settings: Settings, args: RunArgs, integrated: Integrated, wrong: Array) -> Ending:
    """The ending of a run. `wrong` is the mask of violated demands on its numbers."""
    layout, numbers = settings.layout, args.numbers
    y0, _, end, blurred = integrated
    t, y, control, n = args.forward * end.t, end.y, end.control, layout.n_states
    result, culprit = _outcome(settings, args, integrated, wrong)
    values, times = jnp.split(y[layout.peaks], 2)
    return Ending(
        result=result,
        culprit=culprit,
        t1=t if settings.stop is None else jnp.where(result == Result.stopped, t, jnp.inf),
        start=(jnp.asarray(numbers.t0, float), y0[layout.point]),
        end=(t, y[layout.point]),
        integrals=y[layout.integrals][: settings.n_integrals],
        losses=y[layout.losses],
        peaks=jnp.concatenate([values, args.forward * times]),
        errors=control.error[:n],
        largest=control.largest[:n],
        blurred=blurred,
        unresolved=are_unresolved(settings.system.nominals, numbers.rtol, control.largest[:n], control.total[:n]),
        n_steps=end.n_steps,
        n_accepted=end.n_accepted,
    )


def solution_of(settings: Settings, args: RunArgs, ending: Ending, kept: Kept) -> Solution:
    """The solution, except for the parameters of the model."""
    system, layout, numbers = settings.system, settings.layout, args.numbers
    path, record, history = kept
    return Solution(
        t1=ending.t1,
        result=ending.result,
        stats={
            "max_steps": settings.max_steps,
            "num_accepted_steps": ending.n_accepted,
            "num_rejected_steps": ending.n_steps - ending.n_accepted,
            "num_steps": ending.n_steps,
        },
        _start=ending.start,
        _end=ending.end,
        _path=path,
        _end_integrals=ending.integrals,
        _culprit=ending.culprit,
        _not_finite=ending.end,
        _params={},
        _inputs=read_inputs(args),
        _record=record,
        _losses=ending.losses,
        _peaks=ending.peaks,
        _errors=ending.errors,
        _largest=ending.largest,
        _blurred=ending.blurred,
        _unresolved=ending.unresolved,
        _history=None if system.events is None else history,
        system=system,
        _solver=settings.solver,
        _layout=layout,
        _numbers={name: getattr(numbers, name) for name in ("t0", "t1", "rtol", "dt0", "dtmin", "dtmax")},
        _choices=settings.choices,
        _demands=sentences(system, numbers),
        _peaks_tree=NOTHING if settings.peaks is None else settings.peaks.tree,
        _integrals_tree=NOTHING if settings.integrand is None else settings.integrand.tree,
    )


def read_inputs(args: RunArgs) -> Inputs:
    """The inputs of the equations, without those of functions of the whole model, which the caller adds."""
    return dataclasses.replace(args.inputs, params=ModelParameters(args.inputs.params.slots))


def with_saved(settings: Settings, ending: Ending, exists: Truth) -> Ending:
    """The ending of a run, given whether a saved value that is not finite `exists`. Earlier failures come first."""
    result = ending.result
    is_worse = exists & ((result == Result.stopped) | (result == _at_end(settings)))
    t1 = ending.t1 if settings.stop is None else jnp.where(is_worse, jnp.inf, ending.t1)
    return ending._replace(result=Result.where(is_worse, Result.not_finite, result), t1=t1)


def _at_end(settings: Settings) -> Any:
    """The result of a run that reaches its end time."""
    return Result.reached_end if settings.stop is None else Result.never_stopped


def _outcome(settings: Settings, args: RunArgs, integrated: Integrated, wrong: Array) -> tuple[Result, Array]:
    """The result, and the index of the demand, parameter, start value or block that caused a failure."""
    system, layout, inputs = settings.system, settings.layout, args.inputs
    _, bad_starts, end, _ = integrated
    most = settings.max_steps if args.numbers.most is None else args.numbers.most
    t, y, why = args.forward * end.t, end.y, end.outcome
    bound = system.carried.with_discrete(inputs, y[layout.point])
    everything = system.evaluate_all(t, y[layout.point], bound)
    # A failed search for a start is not caused by a single value.
    no_start = [] if args.numbers.start_failed is None else [args.numbers.start_failed > 0.0]
    rules = [  # the first rule that applies determines the result
        ([wrong], Result.bad_option),
        (system.intake.bad_values(inputs), Result.bad_parameter),
        ([bad_starts], Result.bad_start),
        (no_start, Result.bad_start),
        ([~everything.is_finite()], Result.not_finite),
        (singular_blocks(system, everything, bound), Result.undetermined),
        ([why == REFUSED], Result.refused),
        ([why == CONTRADICTED], Result.bad_reset),
        ([are_full(settings, args, t, y) & (why == FULL)], Result.history_full),
        ([why == ENDLESS], Result.events_endless),
        ([why == ACCUMULATED], Result.events_accumulate),
        ([end.failed & jnp.any(jnp.isnan(end.control.error))], Result.not_finite),
        ([end.failed], Result.step_too_small),
        ([(end.n_steps >= most) & (end.t < args.forward * args.numbers.t1) & (why == 0)], Result.too_many_steps),
        ([why == STOPPED], Result.stopped),
    ]
    index = compiled_once(first_true([mask for masks, _ in rules for mask in masks]), t)
    result = _at_end(settings)
    culprit, ends = jnp.asarray(-1), np.cumsum([sum(mask.size for mask in masks) for masks, _ in rules]).tolist()
    for low, high, (_, outcome) in zip([0, *ends], ends, rules, strict=False):
        is_it = (index >= low) & (index < high)
        result, culprit = Result.where(is_it, outcome, result), jnp.where(is_it, index - low, culprit)
    return result, culprit
