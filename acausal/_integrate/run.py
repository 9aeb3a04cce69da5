"""The compiled part of a simulation."""

import dataclasses
import functools as ft
from collections.abc import Callable, Sequence
from typing import Any

import diffrax
import jax
import jax.numpy as jnp
import numpy as np

from .._evaluate.initial import initial_state
from .._evaluate.observe import observe
from .._evaluate.starts import Inputs
from .._evaluate.system import System
from .crossing import Crossing
from .quantity import Quantity
from .result import Result
from .solution import Solution
from .solvers import Guided, Switching
from .switching import CONTRADICTED, ENDLESS, Switches


@dataclasses.dataclass(frozen=True)
class Settings:
    """What a run is compiled for."""

    system: System
    stop: Quantity | None
    integrand: Quantity | None
    stored: Quantity | None  # the energy in all components, for the account of what events take
    direction: bool | None
    save: str
    solver: diffrax.AbstractSolver
    adjoint: diffrax.AbstractAdjoint
    max_steps: int
    max_events: int
    given: frozenset[int]  # the leaves whose start values are given
    progress: diffrax.AbstractProgressMeter

    @property
    def n_states(self) -> int:
        """The length of the state vector with the memory and the discrete variables that follow it."""
        return self.system.extended_size

    @property
    def n_switched(self) -> int:
        """What events change besides states: the discrete variables, the energies lost, and a flag."""
        system = self.system
        if system.happenings is None:
            return 0
        return 1 + self.n_losses + system.extended_size - len(system.nominals) - system.memory_size

    @property
    def n_losses(self) -> int:
        """Energies lost at events, one for each."""
        happenings = self.system.happenings
        return 0 if self.stored is None or happenings is None else happenings.total

    @property
    def n_integrals(self) -> int:
        """How many integrals follow the states in the vector that is integrated."""
        return 0 if self.integrand is None else self.integrand.n_outputs

    @property
    def n_extra(self) -> int:
        """What follows the states: the integrals, or a constant where there would be nothing to integrate."""
        return max(self.n_integrals, 0 if len(self.system.nominals) else 1)


INSTANT = 1e-13  # of the time span: how long after its start conditions are looked at there
NEAR = 1e-9  # of the time span: an event this short before the step size vanishes is to blame for it


@jax.tree_util.register_dataclass
@dataclasses.dataclass
class Numbers:
    """What a compiled run is called with. `params` has the leaves of the model, None where they are variables."""

    params: list[Any]
    starts: Any
    t0: Any
    t1: Any
    dt0: Any
    dtmin: Any
    rtol: Any
    times: Any
    stop: list[Any]  # numbers in the stop condition
    rates: list[Any]  # numbers in the integrands
    stored: list[Any]  # and in the energy


@ft.partial(jax.jit, static_argnums=0)
def run(settings: Settings, numbers: Numbers) -> Solution:
    """Integrate; compiled once for each `settings`."""
    system = settings.system
    inputs = Inputs(system.pack_params(numbers.params), jnp.asarray(numbers.starts), settings.given)
    y0, bad_starts = initial_state(system, numbers.t0, inputs)
    y0 = system.with_memory(numbers.t0, y0, inputs)
    solver, y0, switched = _through_events(settings, numbers, inputs, _solver(settings), y0)
    raw = diffrax.diffeqsolve(
        diffrax.ODETerm(_vector_field(settings, numbers)),
        solver,
        numbers.t0,
        numbers.t1,
        numbers.dt0,
        jnp.concatenate([y0, switched, jnp.zeros(settings.n_extra)]),
        inputs,
        saveat=_saves(settings, numbers),
        stepsize_controller=_controller(settings, numbers),
        adjoint=settings.adjoint,
        max_steps=settings.max_steps,
        throw=False,
        event=_event(settings, numbers),
        progress_meter=settings.progress,
    )
    return _solution(settings, numbers, inputs, raw, y0, bad_starts)


def _solver(settings: Settings) -> Any:
    system, solver = settings.system, settings.solver
    if system.mass is not None:
        solver = dataclasses.replace(solver, mass=np.concatenate([system.mass, np.ones(settings.n_extra)]))
    if not system.memory and not system.ordered.invariants:
        return solver
    n = len(system.nominals)

    def project(t: Any, y: Any, inputs: Inputs) -> Any:
        return jnp.concatenate([system.projected(t, y[:n], inputs), y[n:]])

    def refresh(t: Any, y: Any, memory: Any, inputs: Inputs) -> Any:
        return system.with_memory(t, jnp.concatenate([y[:n], memory]), inputs)[n:]

    return Guided(solver, n, n + system.memory_size, project, refresh)


def _through_events(settings: Settings, numbers: Numbers, inputs: Inputs, solver: Any, y0: Any) -> tuple[Any, Any, Any]:
    """The solver for a model with events, the extended state vector after those at the start, and a flag."""
    system = settings.system
    if system.happenings is None:
        return solver, y0, jnp.zeros(0)
    read = ft.partial(_read, system, numbers)
    switches = Switches(system, system.happenings, read, _stored(settings, numbers, read))
    discrete = [jnp.ravel(jnp.asarray(numbers.params[leaf], float)) for leaf in system.discrete_places]
    y0 = jnp.concatenate([y0, *discrete])
    start, total = len(system.nominals) + system.memory_size, system.happenings.total
    never = jnp.zeros(total, bool)
    instant = INSTANT * (numbers.t1 - numbers.t0)
    whole = jnp.concatenate([y0, jnp.zeros(settings.n_losses)])
    settled = switches.settle(numbers.t0, whole, never, never, instant, inputs)
    solver = Switching(
        solver, settled.holds, start, start + settings.n_switched, settings.max_events, settings.save == "steps",
        switches.margins, switches.settle, switches.bound,
    )  # fmt: skip
    return solver, settled.y[: len(y0)], jnp.concatenate([settled.y[len(y0) :], settled.flag[None]])


def _stored(settings: Settings, numbers: Numbers, read: Callable[..., list[Any]]) -> Callable[..., Any] | None:
    """The energy stored in all components, as a function of a point."""
    stored = settings.stored
    if stored is None:
        return None
    return lambda t, y, inputs: stored(numbers.stored, read(stored.leaves, t, y, inputs))[0]


def _controller(settings: Settings, numbers: Numbers) -> diffrax.PIDController:
    """Tolerances per variable; the integrals, energies above all, count as of size 1."""
    others = settings.system.memory_size + settings.n_switched + settings.n_extra
    sizes = np.concatenate([settings.system.nominals, np.ones(others)])
    smallest = 1e-14 * jnp.abs(numbers.t1 - numbers.t0) if numbers.dtmin is None else numbers.dtmin
    return diffrax.PIDController(numbers.rtol, numbers.rtol * sizes, dtmin=smallest, force_dtmin=False)


def _vector_field(settings: Settings, numbers: Numbers) -> Callable[[Any, Any, Any], Any]:
    """The rates of states and integrals; a `Guided` solver hands the memory on beside the inputs."""
    system, integrand = settings.system, settings.integrand
    n, bare = len(system.nominals), len(system.nominals) + settings.n_extra

    def rates(t: Any, states: Any, inputs: Inputs) -> Any:
        if integrand is None or settings.n_integrals == 0:
            return jnp.zeros(settings.n_extra)
        return jnp.stack(integrand(numbers.rates, _read(system, numbers, integrand.leaves, t, states, inputs)))

    def field(t: Any, y: Any, args: Any) -> Any:
        inputs, memory = args if isinstance(args, tuple) else (args, jnp.zeros(0))
        is_whole = len(y) > bare
        states = y[: settings.n_states] if is_whole else jnp.concatenate([y[:n], memory])
        # What does not change between events is part of the vector only where no solver has taken it out.
        still = jnp.zeros(system.memory_size + settings.n_switched if is_whole else 0)
        return jnp.concatenate([system.vector_field(t, states, inputs), still, rates(t, states, inputs)])

    return field


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
        return stop(numbers.stop, _read(system, numbers, stop.leaves, t, y[: settings.n_states], args))[0]

    return diffrax.Event(condition, Crossing(), settings.direction)


def _read(system: System, numbers: Numbers, wanted: Sequence[int], t: Any, y: Any, inputs: Inputs) -> list[Any]:
    """Values of leaves by number: parameters as they are given, variables from the state."""
    variables = [leaf for leaf in wanted if leaf in system.variable_leaves]
    values = dict(zip(variables, observe(system, t, y, inputs, variables), strict=True))
    values |= system.discrete_values(y, inputs)
    return [values[leaf] if leaf in values else numbers.params[leaf] for leaf in wanted]


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
    bad_parameters = system.bad_parameters(numbers.params)
    finite = jnp.all(jnp.isfinite(y)) & system.all_finite(t, y, inputs)
    event_rules, event = _event_rules(settings, numbers, inputs, raw, t)
    rules = [
        (raw.result == diffrax.RESULTS.max_steps_reached, Result.too_many_steps),
        (raw.result == diffrax.RESULTS.dt_min_reached, Result.step_too_small),
        *event_rules,
        (~finite, Result.not_finite),
        (jnp.any(bad_starts), Result.bad_start),
        (jnp.any(bad_parameters), Result.bad_parameter),
    ]
    result = Result.reached_end
    if settings.stop is not None:
        result = Result.where(jnp.asarray(raw.event_mask), Result.stopped, Result.never_stopped)
    for condition, outcome in rules:
        result = Result.where(condition, outcome, result)
    culprit = jnp.where(jnp.any(bad_starts), _first(bad_starts), event)
    return result, jnp.where(jnp.any(bad_parameters), _first(bad_parameters), culprit)


def _event_rules(
    settings: Settings, numbers: Numbers, inputs: Inputs, raw: diffrax.Solution, t: Any
) -> tuple[list[tuple[Any, Any]], Any]:
    """What can go wrong at events, and the event that comes next, or else the last one."""
    system = settings.system
    if system.happenings is None:
        return [], jnp.asarray(-1)
    assert raw.ys is not None
    y, record = raw.ys["end"][0], raw.solver_state.record  # pyright: ignore[reportOptionalMemberAccess]
    flag, blink = y[settings.n_states + settings.n_losses], NEAR * jnp.abs(numbers.t1 - numbers.t0)
    switches = Switches(system, system.happenings, ft.partial(_read, system, numbers), None)
    point = y[: settings.n_states]

    def coming() -> Any:
        here = switches.margins(t, point, inputs)
        return (here <= 0) & (switches.soon(t, point, blink, inputs) > 0)

    stands_still = raw.result == diffrax.RESULTS.dt_min_reached
    soon = jax.lax.cond(stands_still, coming, lambda: jnp.zeros(switches.happenings.total, bool))
    is_near = ((t - record.last_time) <= blink) | jnp.any(soon)
    rules = [
        (stands_still & is_near, Result.events_accumulate),
        (flag == ENDLESS, Result.events_endless),
        (flag == CONTRADICTED, Result.bad_reset),
    ]
    return rules, jnp.where(jnp.any(soon), jnp.argmax(soon), record.last_number)


def _first(mask: Any) -> Any:
    return jnp.argmax(mask) if len(mask) else jnp.asarray(0)
