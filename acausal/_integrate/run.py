"""The compiled part of a simulation."""

import functools as ft
from typing import Any

import diffrax
import jax
import jax.numpy as jnp

from .._evaluate.initial import initial_state
from .._evaluate.singular import singular_blocks
from .._evaluate.starts import Inputs
from .crossing import Crossing
from .result import Result
from .settings import Numbers, Settings
from .solution import Solution
from .stepping import controller_of, read_leaves, solver_of, through_events, vector_field_of
from .switching import CONTRADICTED, ENDLESS, Switches

NEAR = 1e-9  # of the time span: an event this short before the step size vanishes is to blame for it


@ft.partial(jax.jit, static_argnums=0)
def run(settings: Settings, numbers: Numbers) -> Solution:
    """Integrate; compiled once for each `settings`."""
    system = settings.system
    packed = system.pack_params(numbers.params) if numbers.packed is None else numbers.packed
    inputs = Inputs(packed, jnp.asarray(numbers.starts), settings.given)
    y0, bad_starts = initial_state(system, numbers.t0, inputs)
    y0 = system.with_memory(numbers.t0, y0, inputs)
    solver, y0, switched = through_events(settings, numbers, inputs, solver_of(settings), y0)
    raw = diffrax.diffeqsolve(
        diffrax.ODETerm(vector_field_of(settings, numbers)),
        solver,
        numbers.t0,
        numbers.t1,
        numbers.dt0,
        jnp.concatenate([y0, switched, jnp.zeros(settings.n_extra)]),
        inputs,
        saveat=_saves(settings, numbers),
        stepsize_controller=controller_of(settings, numbers),
        adjoint=settings.adjoint,
        max_steps=settings.max_steps,
        throw=False,
        event=_event(settings, numbers),
        progress_meter=settings.progress,
    )
    return _solution(settings, numbers, inputs, raw, y0, bad_starts)


def _saves(settings: Settings, numbers: Numbers) -> diffrax.SaveAt:
    saves = {"end": diffrax.SubSaveAt(t1=True)}
    if settings.save == "steps":
        saves["path"] = diffrax.SubSaveAt(t0=True, steps=True)
    elif settings.save == "times":
        saves["path"] = diffrax.SubSaveAt(ts=numbers.times)
    return diffrax.SaveAt(
        subs=saves, dense=settings.save == "dense", solver_state=settings.system.happenings is not None
    )


def _event(settings: Settings, numbers: Numbers) -> diffrax.Event | None:
    system, stop = settings.system, settings.stop
    if stop is None:
        return None

    def condition(t: Any, y: Any, args: Inputs, **kwargs: Any) -> Any:
        # A run that has become infinite does not stop here, and reverse mode must not meet its NaN.
        y = jnp.where(jnp.all(jnp.isfinite(y)), y, jnp.zeros_like(y))
        return stop(numbers.stop, read_leaves(system, numbers.params, stop.leaves, t, y[: settings.n_states], args))[0]

    return diffrax.Event(condition, Crossing(), settings.direction)


def _solution(
    settings: Settings, numbers: Numbers, inputs: Inputs, raw: diffrax.Solution, y0: Any, bad_starts: Any
) -> Solution:
    system, n = settings.system, settings.n_states
    losses = n + settings.n_losses
    first = losses + min(settings.n_switched, 1)  # of the integrals, after the flag
    assert raw.ts is not None
    assert raw.ys is not None
    path = "path" if "path" in raw.ts else "end"
    t_end, y_end = raw.ts["end"][0], raw.ys["end"][0, :n]
    result, culprit = _outcome(settings, numbers, inputs, raw, t_end, y_end, bad_starts)
    return Solution(
        t1=t_end if settings.stop is None else jnp.where(result == Result.stopped, t_end, jnp.inf),
        result=result,
        stats=raw.stats,
        _start=(jnp.asarray(numbers.t0, float), y0),
        _end=(t_end, y_end),
        _path=(raw.ts[path], raw.ys[path][:, :n]),
        _end_integrals=raw.ys["end"][0, first : first + settings.n_integrals],
        _path_integrals=raw.ys[path][:, first : first + settings.n_integrals],
        _culprit=culprit,
        _params=numbers.params,
        _inputs=inputs,
        _dense=raw.interpolation,
        _losses=raw.ys["end"][0, n:losses],
        _record=None if system.happenings is None else raw.solver_state.record,  # pyright: ignore[reportOptionalMemberAccess]
        system=system,
        _integrals_tree=None if settings.integrand is None else settings.integrand.tree,
    )


def _outcome(
    settings: Settings, numbers: Numbers, inputs: Inputs, raw: diffrax.Solution, t: Any, y: Any, bad_starts: Any
) -> tuple[Any, Any]:
    """The result, and which parameter or start value is to blame for a bad one; later rules win."""
    system = settings.system
    bad_parameters = system.bad_parameters(numbers.params, inputs.params)
    everything = system.evaluate_all(t, y, inputs)
    singular = singular_blocks(system, everything, inputs)
    event_rules, event = _event_rules(settings, numbers, inputs, raw, t)
    rules = [
        (raw.result == diffrax.RESULTS.max_steps_reached, Result.too_many_steps),
        (raw.result == diffrax.RESULTS.dt_min_reached, Result.step_too_small),
        *event_rules,
        (jnp.any(singular), Result.undetermined),
        (~everything.is_finite(), Result.not_finite),
        (jnp.any(bad_starts), Result.bad_start),
        (jnp.any(bad_parameters), Result.bad_parameter),
    ]
    result = Result.reached_end
    if settings.stop is not None:
        result = Result.where(jnp.asarray(raw.event_mask), Result.stopped, Result.never_stopped)
    for condition, outcome in rules:
        result = Result.where(condition, outcome, result)
    culprit = jnp.where(result == Result.undetermined, _first(singular), event)
    culprit = jnp.where(jnp.any(bad_starts), _first(bad_starts), culprit)
    return result, jnp.where(jnp.any(bad_parameters), _first(bad_parameters), culprit)


def _event_rules(
    settings: Settings, numbers: Numbers, inputs: Inputs, raw: diffrax.Solution, t: Any
) -> tuple[list[tuple[Any, Any]], Any]:
    """What can go wrong at events, and the event that comes next, or else the last one."""
    system = settings.system
    if system.happenings is None:
        return [], jnp.asarray(-1)
    assert raw.ys is not None
    assert raw.solver_state is not None
    y, holds, record = raw.ys["end"][0], raw.solver_state.holds, raw.solver_state.record
    flag, blink = y[settings.n_states + settings.n_losses], NEAR * jnp.abs(numbers.t1 - numbers.t0)
    stands_still = raw.result == diffrax.RESULTS.dt_min_reached
    switches = Switches(system, system.happenings, ft.partial(read_leaves, system, numbers.params), None)
    coming = lambda: ~holds & (switches.soon(t, y[: settings.n_states], blink, inputs) > 0)  # noqa: E731
    soon = jax.lax.cond(stands_still, coming, lambda: jnp.zeros_like(holds))
    is_near = ((t - record.last_time) <= blink) | jnp.any(soon)
    rules = [
        (stands_still & is_near, Result.events_accumulate),
        (flag == ENDLESS, Result.events_endless),
        (flag == CONTRADICTED, Result.bad_reset),
    ]
    return rules, jnp.where(jnp.any(soon), jnp.argmax(soon), record.last_number)


def _first(mask: Any) -> Any:
    return jnp.argmax(mask) if len(mask) else jnp.asarray(0)
