"""The compiled part of a simulation."""

import dataclasses
import functools as ft
from collections.abc import Callable
from typing import NamedTuple

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import PyTree

from .._compiled_once import compiled_once
from .._diffrax_private import solve
from .._evaluate.initial import initial_state
from .._evaluate.packing import ModelParameters
from .._evaluate.singular import singular_blocks
from .._indices import first_true
from .adjoint import BothModes, Forwards
from .derivative import differentiable
from .event_state import ACCUMULATED
from .field import Given
from .options import harmless, sentences, unmet
from .result import Result
from .settings import RunNumbers, Settings
from .settle import CONTRADICTED, ENDLESS, REFUSED, STOPPED
from .solution import Solution
from .stepping import begin_run, controller_of, solver_of, term_of
from .unresolved import are_unresolved


@ft.partial(jax.jit, static_argnums=0)
def run(settings: Settings, given: Given) -> Solution:
    """Integrate; compiled once for each `settings`. The parameters of the model are left to whoever has them."""
    numbers = given.numbers
    wrong = unmet(settings.system, numbers)
    safe = dataclasses.replace(given, numbers=harmless(numbers, jnp.any(wrong)))
    if settings.adjoint is not None:
        return _solution(settings, safe, _integrated(settings, settings.adjoint, safe), wrong)
    leaves, structure = jax.tree.flatten(safe)
    others: list[PyTree] = []  # what is the same for all numbers

    def with_adjoint(adjoint: diffrax.AbstractAdjoint) -> Callable[[list[Array]], PyTree]:
        def arrays(leaves: list[Array]) -> PyTree:
            found, rest = eqx.partition(_integrated(settings, adjoint, structure.unflatten(leaves)), eqx.is_array)
            others[:] = [rest]
            return found

        return arrays

    integrated = differentiable(with_adjoint(Forwards()), with_adjoint(BothModes()), _saved(settings, numbers))
    found = integrated([jnp.asarray(leaf) for leaf in leaves])
    return _solution(settings, safe, eqx.combine(found, *others), wrong)


class _Integrated(NamedTuple):
    """What the loop over the steps started with, which start values are bad, and what it leaves."""

    start: Array
    bad_starts: Array
    raw: diffrax.Solution


def _packed(settings: Settings, given: Given) -> Given:
    """The numbers of a run as its functions read them."""
    return dataclasses.replace(given, inputs=settings.system.intake.complete(given.inputs))


def _integrated(settings: Settings, adjoint: diffrax.AbstractAdjoint, given: Given) -> _Integrated:
    given, numbers = _packed(settings, given), given.numbers
    y0, bad_starts = initial_state(settings.system, numbers.t0, given.inputs)
    is_reversible = not isinstance(adjoint, diffrax.ForwardMode)
    given, y0, events, memory = begin_run(settings, given, y0, is_reversible=is_reversible)
    raw = solve(
        diffrax.ODETerm(term_of(settings)),
        solver_of(settings, events, memory, is_reversible=is_reversible),
        numbers.t0,
        numbers.t1,
        numbers.dt0,
        y0,
        given,
        saveat=_saves(settings, numbers),
        stepsize_controller=controller_of(settings, given),
        adjoint=adjoint,
        max_steps=settings.max_steps,
        throw=False,
        progress_meter=settings.progress,
    )
    return _Integrated(y0, bad_starts, raw)


def _saved(settings: Settings, numbers: RunNumbers) -> int:
    """How many numbers are kept along a run."""
    points = {
        "end": 1,
        "times": 0 if numbers.times is None else numbers.times.size,
        "steps": settings.max_steps,
        "dense": 10 * settings.max_steps,
    }
    return points[settings.save] * settings.layout.size


def _saves(settings: Settings, numbers: RunNumbers) -> diffrax.SaveAt:
    saves = {"end": diffrax.SubSaveAt(t1=True)}
    if settings.save == "steps":
        saves["path"] = diffrax.SubSaveAt(t0=True, steps=True)
    elif settings.save == "times":
        saves["path"] = diffrax.SubSaveAt(ts=numbers.times)
    return diffrax.SaveAt(
        subs=saves, dense=settings.save == "dense", solver_state=settings.has_events, controller_state=True
    )


def _solution(settings: Settings, given: Given, integrated: _Integrated, wrong: Array) -> Solution:
    """The solution; `wrong` are the demands on its numbers that are not met."""
    system, layout, given, numbers = settings.system, settings.layout, _packed(settings, given), given.numbers
    y0, _, raw = integrated
    assert raw.ts is not None
    assert raw.ys is not None
    assert raw.controller_state is not None
    control, largest = raw.controller_state, raw.controller_state.largest[layout.states]
    path = "path" if "path" in raw.ts else "end"
    t_end, y_end = raw.ts["end"][0], raw.ys["end"][0]
    result, culprit = _outcome(settings, given, integrated, wrong)
    return Solution(
        t1=t_end if settings.stop is None else jnp.where(result == Result.stopped, t_end, jnp.inf),
        result=result,
        stats=raw.stats,
        _start=(jnp.asarray(numbers.t0, float), y0[layout.point]),
        _end=(t_end, y_end[layout.point]),
        _path=(raw.ts[path], raw.ys[path][:, layout.point]),
        _end_integrals=y_end[layout.integrals][: settings.n_integrals],
        _path_integrals=raw.ys[path][:, layout.integrals][:, : settings.n_integrals],
        _culprit=culprit,
        _params={},
        _inputs=dataclasses.replace(given.inputs, params=ModelParameters(given.inputs.params.slots)),
        _dense=raw.interpolation,
        _losses=y_end[layout.losses],
        _peaks=_peaks(settings, given, y_end),
        _errors=control.error[layout.states],
        _largest=largest,
        _unresolved=are_unresolved(system.nominals, numbers.rtol, largest, control.total[layout.states]),
        _history=None if system.events is None else raw.solver_state.events.history,  # pyright: ignore[reportOptionalMemberAccess]
        system=system,
        _solver=settings.solver,
        _layout=layout,
        _numbers={name: getattr(numbers, name) for name in ("t0", "t1", "rtol", "dt0", "dtmin")},
        _choices=settings.choices,
        _demands=sentences(system, numbers),
        _peaks_tree=None if settings.peaks is None else settings.peaks.tree,
        _integrals_tree=None if settings.integrand is None else settings.integrand.tree,
    )


def _peaks(settings: Settings, given: Given, y: Array) -> Array:
    """Values, then times, which the solver counts forwards."""
    values, times = jnp.split(y[settings.layout.peaks], 2)
    return jnp.concatenate([values, given.direction * times])


def _outcome(settings: Settings, given: Given, integrated: _Integrated, wrong: Array) -> tuple[Result, Array]:
    """The result, and the index of the demand, parameter, start value or block that is to blame for a bad one."""
    system, layout, inputs = settings.system, settings.layout, given.inputs
    _, bad_starts, raw = integrated
    assert raw.ts is not None
    assert raw.ys is not None
    t, y = raw.ts["end"][0], raw.ys["end"][0]
    bound = system.carried.with_discrete(inputs, y[layout.point])
    everything = system.evaluate_all(t, y[layout.point], bound)
    why = y[layout.outcome] if settings.has_events else jnp.asarray(0.0)
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
        ([raw.result == diffrax.RESULTS.dt_min_reached], Result.step_too_small),
        ([raw.result == diffrax.RESULTS.max_steps_reached], Result.too_many_steps),
        ([why == STOPPED], Result.stopped),
    ]
    index = compiled_once(first_true([mask for masks, _ in rules for mask in masks]), t)
    result = Result.reached_end if settings.stop is None else Result.never_stopped
    culprit, ends = jnp.asarray(-1), np.cumsum([sum(mask.size for mask in masks) for masks, _ in rules]).tolist()
    for begin, end, (_, outcome) in zip([0, *ends], ends, rules, strict=False):
        is_it = (index >= begin) & (index < end)
        result, culprit = Result.where(is_it, outcome, result), jnp.where(is_it, index - begin, culprit)
    return result, culprit
