"""How a run is stepped: its first vector, its solver and its step sizes."""

import dataclasses
import functools as ft
from collections.abc import Callable

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import PyTree

from .._evaluate.invariants import onto_invariants
from .._numbers import Numbers, Truth
from .._reduce.instants import first
from .band import Band
from .controller import Steps, core_norm, sizes_of
from .event_history import EventHistory
from .event_state import EventState
from .field import Given, vector_field
from .interval import seen
from .moment import Approach
from .peaks import Peaks
from .rejected import Rejectable
from .run_events import RunEvents
from .settings import Settings
from .settle import settle
from .solvers import AbstractRosenbrock
from .stepper import Stepper


def term_of(settings: Settings) -> Callable[[PyTree, PyTree, PyTree], PyTree]:
    """The vector field for a solver: of the core where it is told what is carried along, else of the whole vector."""
    field, layout = vector_field(settings), settings.layout

    def rates(t: Array, y: Array, given: Given) -> Numbers:
        if given.carried is not None:
            return field(t, y, given)
        carried = y[layout.carried]
        return layout.joined(field(t, layout.core(y), given.carrying(carried)), jnp.zeros_like(carried))

    return rates


def solver_of(
    settings: Settings, events: RunEvents | None, begin: EventState | None, *, is_reversible: bool
) -> diffrax.AbstractSolver:
    """The solver, with what the model asks for after each of its steps."""
    system, solver = settings.system, settings.solver
    if isinstance(solver, AbstractRosenbrock):
        solver = dataclasses.replace(solver, n_integrals=settings.n_extra)
    if system.mass is not None:
        solver = dataclasses.replace(solver, mass=np.concatenate([system.mass, np.ones(settings.n_extra)]))
    is_plain = not system.carried.memory and not system.ordered.invariants and events is None and not settings.peaks
    if is_plain and not settings.follows_course:
        return Rejectable(solver, settings) if is_reversible else solver

    def project(t: Numbers, y: Array, given: Given) -> Array:
        return onto_invariants(system, t, y[settings.layout.point], given.inputs)

    def remember(t: Numbers, y: Array, given: Given, anew: Truth) -> Array:
        return system.with_memory(t, y[settings.layout.point], given.inputs, anew=anew)[settings.layout.memory]

    return Stepper(
        solver,
        settings,
        project if system.ordered.invariants else None,
        remember if system.carried.memory else None,
        Peaks(settings) if settings.peaks else None,
        events,
        is_reversible,
        begin,
    )


def begin_run(
    settings: Settings, given: Given, y0: Array, *, is_reversible: bool = True
) -> tuple[Given, Array, RunEvents | None, EventState | None]:
    """The numbers of a run, from when it counts among them; the vector that it starts with, from its states, after what
    happens at the start; its events, and what is carried from step to step.
    """
    system, layout, numbers = settings.system, settings.layout, given.numbers
    values = given.inputs.params.leaves
    discrete = [jnp.ravel(jnp.asarray(values[leaf], float)) for leaf in system.carried.discrete_places]
    guess = system.starts.values(given.inputs, system.carried.memory)
    rest = jnp.zeros(layout.size - layout.discrete.stop)
    y = jnp.concatenate([y0, guess, *discrete, rest])
    if not settings.has_events:
        return given, _with_peaks(settings, given, _remembered(settings, given, y)), None, None
    events, t0 = RunEvents(settings, layout, is_reversible), numbers.t0
    given = dataclasses.replace(given, counted_from=events.counted_from(t0, y, given))
    past = events.past(t0, y, given)
    none = jnp.zeros(events.total, bool)
    history = EventHistory.empty(settings.max_events, layout.size if settings.save == "steps" else 0, events.n_model)
    due = jnp.zeros(events.total)
    begins = none if settings.is_started else jnp.isfinite(past)
    if settings.is_resumed:
        begins &= past >= t0
    if numbers.past is not None:
        begins &= past > numbers.past.time + given.tick(numbers.past.time)
    zero = jnp.zeros(events.n_margins)
    approach = Approach(t0, jnp.zeros(events.total), zero > 0, zero)  # tells nothing: nothing has been searched
    settled = settle(events, t0, approach, y, begins, none, due, history, given, order=past)
    y = _remembered(settings, given, events.with_algebraic(t0, settled.y, given))
    due = events.due(t0, y, given, events.past(t0, y, given))
    instant = given.direction * first(due, given.direction)
    status = jnp.stack([settled.outcome, given.direction * t0, jnp.asarray(jnp.inf), instant])
    reading = events.margins_and_rates if settings.follows_course else events.margins
    unknown = jax.eval_shape(ft.partial(seen, lambda t: reading(t, y, given)), jnp.asarray(t0, float))
    if settings.follows_course:
        unknown = unknown._replace(g=unknown.g[0], rate=unknown.rate[0], shift=(unknown.g[1], unknown.rate[1]))
    memory = EventState(
        settled.holds, settled.fresh, zero, jax.tree.map(jnp.zeros_like, unknown), Band.at_start(events.n_margins),
        due, settled.history, jnp.asarray(-jnp.inf), jnp.asarray(0), jnp.asarray(True),
    )  # fmt: skip
    return given, _with_peaks(settings, given, layout.with_part(y, layout.status, status)), events, memory


def _remembered(settings: Settings, given: Given, y: Array) -> Array:
    system, layout = settings.system, settings.layout
    if not system.carried.memory:
        return y
    new = system.with_memory(given.numbers.t0, y[layout.point], given.inputs)[layout.memory]
    return layout.with_part(y, layout.memory, new)


def _with_peaks(settings: Settings, given: Given, y: Array) -> Array:
    if settings.peaks is None:
        return y
    t0 = given.direction * given.numbers.t0
    return settings.layout.with_part(y, settings.layout.peaks, Peaks(settings).begun(t0, y, given))


def controller_of(settings: Settings, given: Given) -> Steps:
    """Tolerances per variable; the integrals, energies above all, count as of size 1."""
    layout, numbers = settings.layout, given.numbers
    span = jnp.abs(numbers.t1 - numbers.t0)
    return Steps(
        numbers.rtol,
        numbers.rtol * sizes_of(settings),
        norm=core_norm(layout),
        layout=layout,
        shortest=1e-14 * span if numbers.dtmin is None else numbers.dtmin,
    )
