"""The compiled part of a simulation."""

import dataclasses
import functools as ft
from collections.abc import Callable
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import PyTree

from .._compiled_once import compiled_once
from .._evaluate.initial import initial_state
from .._evaluate.packing import ModelParameters
from .._evaluate.singular import singular_blocks
from .._indices import first_true
from .adjoint import BOTH_MODES, FORWARDS, Kind, kind_of_loop
from .carry import Carry
from .derivative import differentiable
from .field import Given
from .iteration import ACCUMULATED, CONTRADICTED, ENDLESS, REFUSED, STOPPED
from .loop import Run
from .not_finite import NotFinite, first_saved_not_finite
from .options import harmless, sentences, unmet
from .result import Result
from .run_events import RunEvents
from .settings import RunNumbers, Settings
from .solution import Solution
from .starting import begin
from .unresolved import are_blurred, are_unresolved


@ft.partial(jax.jit, static_argnums=0)
def run(settings: Settings, given: Given) -> Solution:
    """Integrate; compiled once for each `settings`. The parameters of the model are left to whoever has them."""
    numbers = given.numbers
    wrong = unmet(settings.system, numbers)
    safe = dataclasses.replace(given, numbers=harmless(numbers, jnp.any(wrong)))
    if settings.adjoint is not None:
        return _solution(settings, safe, _integrated(settings, kind_of_loop(settings.adjoint), safe), wrong)
    leaves, structure = jax.tree.flatten(safe)
    others: list[PyTree] = []  # what is the same for all numbers

    def with_loop(kind: Kind) -> Callable[[list[Array]], PyTree]:
        def arrays(leaves: list[Array]) -> PyTree:
            found, rest = eqx.partition(_integrated(settings, kind, structure.unflatten(leaves)), eqx.is_array)
            others[:] = [rest]
            return found

        return arrays

    integrated = differentiable(with_loop(FORWARDS), with_loop(BOTH_MODES), _saved(settings, numbers))
    found = integrated([jnp.asarray(leaf) for leaf in leaves])
    return _solution(settings, safe, eqx.combine(found, *others), wrong)


class _Integrated(NamedTuple):
    """What the loop over the steps started with, which start values are bad, what it leaves, and how far the crossing
    functions of relations were from zero at most that have changed and could not change back, zero for all others.
    """

    start: Array
    bad_starts: Array
    end: Carry
    blurred: Array


def _packed(settings: Settings, given: Given) -> Given:
    """The numbers of a run as its functions read them."""
    return dataclasses.replace(given, inputs=settings.system.intake.complete(given.inputs))


def _integrated(settings: Settings, kind: Kind, given: Given) -> _Integrated:
    given = _packed(settings, given)
    y0, bad_starts = initial_state(settings.system, given.numbers.t0, given.inputs)
    events = RunEvents(settings, settings.layout, kind.is_reversible) if settings.has_events else None
    given, begun = begin(settings, given, y0, events)
    end = Run(settings, given, events, kind).all_steps(begun)
    blurred = jnp.zeros(0) if events is None else are_blurred(given.band, given.back, end.armed, end.farthest)
    return _Integrated(begun.y, bad_starts, end, blurred)


def _saved(settings: Settings, numbers: RunNumbers) -> int:
    """How many numbers are kept along a run."""
    points = {
        "end": 1,
        "times": 0 if numbers.times is None else numbers.times.size,
        "steps": settings.max_steps,
        "dense": 10 * settings.max_steps,
    }
    return points[settings.save] * settings.layout.size


def _solution(settings: Settings, given: Given, integrated: _Integrated, wrong: Array) -> Solution:
    """The solution; `wrong` are the demands on its numbers that are not met."""
    system, layout, given, numbers = settings.system, settings.layout, _packed(settings, given), given.numbers
    y0, _, end, blurred = integrated
    forward, control, largest = given.direction, end.control, end.control.largest[: layout.n_states]
    t_end, y_end = forward * end.t, end.y
    ts, ys = (t_end[None], y_end[None]) if settings.save in ("end", "dense") else (forward * end.rows.ts, end.rows.ys)
    saved = first_saved_not_finite(settings, given, end)
    result, culprit = _outcome(settings, given, integrated, wrong, saved)
    n_accepted = end.n_accepted
    stats = {
        "max_steps": settings.max_steps,
        "num_accepted_steps": n_accepted,
        "num_rejected_steps": end.n_steps - n_accepted,
        "num_steps": end.n_steps,
    }
    return Solution(
        t1=t_end if settings.stop is None else jnp.where(result == Result.stopped, t_end, jnp.inf),
        result=result,
        stats=stats,
        _start=(jnp.asarray(numbers.t0, float), y0[layout.point]),
        _end=(t_end, y_end[layout.point]),
        _path=(ts, ys[:, layout.point]),
        _end_integrals=y_end[layout.integrals][: settings.n_integrals],
        _path_integrals=ys[:, layout.integrals][:, : settings.n_integrals],
        _culprit=culprit,
        _not_finite=(jnp.asarray(saved.point.t, float), saved.point.y),
        _params={},
        _inputs=dataclasses.replace(given.inputs, params=ModelParameters(given.inputs.params.slots)),
        _dense=end.pieces,
        _losses=y_end[layout.losses],
        _peaks=_peaks(settings, given, y_end),
        _errors=control.error[: layout.n_states],
        _largest=largest,
        _blurred=blurred,
        _unresolved=are_unresolved(system.nominals, numbers.rtol, largest, control.total[: layout.n_states]),
        _history=None if system.events is None else end.history,
        system=system,
        _solver=settings.solver,
        _layout=layout,
        _numbers={name: getattr(numbers, name) for name in ("t0", "t1", "rtol", "dt0", "dtmin", "dtmax")},
        _choices=settings.choices,
        _demands=sentences(system, numbers),
        _peaks_tree=None if settings.peaks is None else settings.peaks.tree,
        _integrals_tree=None if settings.integrand is None else settings.integrand.tree,
    )


def _peaks(settings: Settings, given: Given, y: Array) -> Array:
    """Values, then times, which the solver counts forwards."""
    values, times = jnp.split(y[settings.layout.peaks], 2)
    return jnp.concatenate([values, given.direction * times])


def _outcome(
    settings: Settings, given: Given, integrated: _Integrated, wrong: Array, saved: NotFinite
) -> tuple[Result, Array]:
    """The result, and the index of the demand, parameter, start value or block that is to blame for a bad one."""
    system, layout, inputs = settings.system, settings.layout, given.inputs
    _, bad_starts, end, _ = integrated
    t, y, why = given.direction * end.t, end.y, end.outcome
    bound = system.carried.with_discrete(inputs, y[layout.point])
    everything = system.evaluate_all(t, y[layout.point], bound)
    no_start = [] if given.numbers.unmet is None else [given.numbers.unmet > 0.0]  # of which no value is to blame
    rules = [  # of all that apply the first one counts
        ([wrong], Result.bad_option),
        (system.intake.bad_values(inputs), Result.bad_parameter),
        ([bad_starts], Result.bad_start),
        (no_start, Result.bad_start),
        ([~everything.is_finite()], Result.not_finite),
        (singular_blocks(system, everything, bound), Result.undetermined),
        ([why == REFUSED], Result.refused),
        ([why == CONTRADICTED], Result.bad_reset),
        ([why == ENDLESS], Result.events_endless),
        ([why == ACCUMULATED], Result.events_accumulate),
        ([end.failed & jnp.any(jnp.isnan(end.control.error))], Result.not_finite),
        ([end.failed], Result.step_too_small),
        (
            [(end.n_steps >= settings.max_steps) & (end.t < given.direction * given.numbers.t1) & (why == 0)],
            Result.too_many_steps,
        ),
        ([saved.exists], Result.not_finite),
        ([why == STOPPED], Result.stopped),
    ]
    index = compiled_once(first_true([mask for masks, _ in rules for mask in masks]), t)
    result = Result.reached_end if settings.stop is None else Result.never_stopped
    culprit, ends = jnp.asarray(-1), np.cumsum([sum(mask.size for mask in masks) for masks, _ in rules]).tolist()
    for low, high, (_, outcome) in zip([0, *ends], ends, rules, strict=False):
        is_it = (index >= low) & (index < high)
        result, culprit = Result.where(is_it, outcome, result), jnp.where(is_it, index - low, culprit)
    return result, culprit
