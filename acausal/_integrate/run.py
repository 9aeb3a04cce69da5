"""The compiled part of a simulation, and the search for the first saved point that is not finite."""

import dataclasses
import functools as ft
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import Array
from jaxtyping import PyTree

from .._evaluate.groups import ModelParameters
from .._evaluate.initial import handed_inputs, initial_state
from .._evaluate.observe import pairs_of
from .._numbers import Numbers, Truth
from .events.run_events import RunEvents
from .loop.carry import Carry
from .loop.loop import StepLoop
from .loop.loop_start import loop_start
from .results.ending import Ending, Integrated, Kept, end_run, solution_of, with_saved
from .results.solution import Solution
from .results.unresolved import are_blurred
from .setup.field import RunArgs
from .setup.options import harmless, violated_demands
from .setup.settings import RunNumbers, Settings
from .step.adjoint import BOTH_MODES, FORWARDS, LoopKind, kind_of_loop
from .step.derivative import differentiable


def run_args(settings: Settings, leaves: Sequence[Any], numbers: RunNumbers) -> tuple[ModelParameters, RunArgs]:
    """The parameters of a model, and the numbers of its run."""
    system = settings.system
    params = system.intake.parameters(leaves)
    handed = system.intake.handed(params, _read(settings))
    return params, RunArgs(handed_inputs(system, handed, leaves), numbers)


def _read(settings: Settings) -> set[int]:
    """The leaves that user functions, events and discrete variables read in a run."""
    system = settings.system
    wanted = {*system.carried.discrete_places}
    for quantity in (settings.stop, settings.integrand, settings.peaks, settings.stored):
        wanted.update(quantity.leaves if quantity else ())
    if system.events:
        wanted.update(system.events.leaves)
    return wanted


class WholeRun(NamedTuple):
    """The numbers of a run as its functions read them, those of its solution, and a time and a state vector at which a
    variable is not finite, if there is one.
    """

    args: RunArgs
    ending: Ending
    kept: Kept
    not_finite: tuple[Array, Array]


def whole_run(settings: Settings, args: RunArgs) -> WholeRun:
    """Integrates as one function of the numbers, which can be differentiated."""
    numbers = args.numbers
    wrong = violated_demands(settings.system, numbers)
    safe = dataclasses.replace(args, numbers=harmless(numbers, jnp.any(wrong)))
    integrated = _both_modes(settings, safe)
    packed = _packed(settings, safe)
    saved = first_saved_not_finite(settings, packed, integrated.end)
    ending = with_saved(settings, end_run(settings, packed, integrated, wrong), saved.exists)
    return WholeRun(packed, ending, _kept(packed, integrated.end), (jnp.asarray(saved.point.t, float), saved.point.y))


def solution_of_run(settings: Settings, run: WholeRun) -> Solution:
    """The solution. The caller adds the parameters of the model."""
    return dataclasses.replace(solution_of(settings, *run[:3]), _not_finite=run.not_finite)


@ft.partial(jax.jit, static_argnums=0)
def run_traced(settings: Settings, args: RunArgs) -> Solution:
    """Integrates in one program for each `settings`."""
    return solution_of_run(settings, whole_run(settings, args))


class RunStart(NamedTuple):
    """The numbers of a run as its functions read them, a mask of invalid start values, the initial carry of the loop,
    and whether the run continues after its start.
    """

    args: RunArgs
    bad_starts: Array
    carry: Carry
    goes_on: Array


def start_run(settings: Settings, args: RunArgs, kind: LoopKind = FORWARDS) -> RunStart:
    """Performs the start of a run, up to its first step."""
    args = _packed(settings, args)
    y0, bad_starts = initial_state(settings.system, args.numbers.t0, args.inputs)
    events = _events(settings, kind)
    args, start = loop_start(settings, args, y0, events)
    loop = StepLoop(settings, args, events, kind)
    carry = loop.first(start)._replace(failed=jnp.any(bad_starts))
    return RunStart(args, bad_starts, carry, loop.goes_on(carry))


def advance_run(settings: Settings, args: RunArgs, carry: Carry, kind: LoopKind = FORWARDS) -> tuple[Carry, Array]:
    """Takes steps until the run ends or the record is full. Returns the carry and whether the run continues."""
    run = StepLoop(settings, args, _events(settings, kind), kind)
    end = run.steps(carry)
    return end, run.goes_on(end)


def without_steps(settings: Settings, start: RunStart) -> Carry:
    """The end of a run that does not continue after its start."""
    loop = StepLoop(settings, start.args, _events(settings, FORWARDS), FORWARDS)
    return start.carry._replace(record=loop.no_record(start.carry))


def blurred(settings: Settings, args: RunArgs, end: Carry) -> Array:
    """The largest unresolved event indicator of each relation; see `are_blurred`."""
    return are_blurred(args.band, args.back, end.armed, end.farthest) if settings.has_events else jnp.zeros(0)


def _events(settings: Settings, kind: LoopKind) -> RunEvents | None:
    return RunEvents(settings, settings.layout, kind.is_reversible) if settings.has_events else None


def _packed(settings: Settings, args: RunArgs) -> RunArgs:
    """The numbers of a run as its functions read them."""
    return dataclasses.replace(args, inputs=settings.system.intake.complete(args.inputs))


def _integrated(settings: Settings, kind: LoopKind, args: RunArgs) -> Integrated:
    start = start_run(settings, args, kind)
    end, _ = advance_run(settings, start.args, start.carry, kind)
    return Integrated(start.carry.y, start.bad_starts, end, blurred(settings, start.args, end))


def _both_modes(settings: Settings, args: RunArgs) -> Integrated:
    """Integrates the run so that the requested modes of differentiation apply; by default both."""
    if settings.adjoint is not None:
        return _integrated(settings, kind_of_loop(settings.adjoint), args)
    leaves, structure = jax.tree.flatten(args)
    others: list[PyTree] = []  # the static part, which does not depend on the numbers

    def with_loop(kind: LoopKind) -> Callable[[list[Array]], PyTree]:
        def arrays(leaves: list[Array]) -> PyTree:
            found, rest = eqx.partition(_integrated(settings, kind, structure.unflatten(leaves)), eqx.is_array)
            others[:] = [rest]
            return found

        return arrays

    integrated = differentiable(with_loop(FORWARDS), with_loop(BOTH_MODES), n_saved(settings, args.numbers))
    found = integrated([jnp.asarray(leaf) for leaf in leaves])
    return eqx.combine(found, *others)


def n_saved(settings: Settings, numbers: RunNumbers) -> int:
    """The number of values that a run saves."""
    points = {
        "end": 1,
        "times": 0 if numbers.times is None else numbers.times.size,
        "steps": settings.max_steps,
        "dense": 10 * settings.max_steps,
    }
    return points[settings.save] * settings.layout.size


def _kept(args: RunArgs, end: Carry) -> Kept:
    """The saved values of a run, at model times."""
    ts, ys = (end.t[None], end.y[None]) if end.rows is None else (end.rows.ts, end.rows.ys)
    return Kept((args.forward * ts, ys) if end.record is None else None, end.record, end.history)


class SavedPoint(NamedTuple):
    """A time, the vector for evaluating the equations there, and whether the solution shows the point."""

    t: Numbers
    y: Array
    is_shown: Truth


class NotFinite(NamedTuple):
    """Whether there is a non-finite point, and this point; if there is none, the last point checked."""

    exists: Truth
    point: SavedPoint


def first_saved_not_finite(settings: Settings, args: RunArgs, end: Carry) -> NotFinite:
    """The first saved point at which a variable is not finite, excluding the end of the run.

    Parameters and discrete variables are not checked: an infinite time may mean "never".
    """
    args, end = jax.lax.stop_gradient((args, end))
    system, forward = settings.system, args.forward
    none = NotFinite(jnp.asarray(False), SavedPoint(forward * end.t, end.y[settings.layout.point], jnp.asarray(True)))
    if settings.save == "end":
        return none
    pairs = pairs_of(system, system.flat.variable_leaves)
    n, point_at = (_of_times if end.record is None else _of_steps)(settings, forward, end)

    def goes_on(carry: tuple[Array, NotFinite]) -> Array:
        return (carry[0] < n) & ~carry[1].exists

    def look(carry: tuple[Array, NotFinite]) -> tuple[Array, NotFinite]:
        point = point_at(carry[0])
        values = system.evaluate(point.t, point.y, args.inputs, pairs, anew=True)
        return carry[0] + 1, NotFinite(point.is_shown & ~values.is_finite(), point)

    return jax.lax.while_loop(goes_on, look, (jnp.asarray(0), none))[1]


Points = tuple[Array, Callable[[Array], SavedPoint]]  # number of points, and the point of an index


def _of_times(settings: Settings, forward: Array, end: Carry) -> Points:
    """The points at the requested times."""
    rows, here = end.rows, settings.layout.point
    assert rows is not None

    def row(i: Array) -> SavedPoint:
        return SavedPoint(forward * rows.ts[i], rows.ys[i, here], jnp.asarray(True))

    # The times are padded with the last requested one, up to the number that the program is compiled for.
    return jnp.minimum(rows.n, 1 + jnp.sum(rows.ts < rows.ts[rows.n - 1])), row


def _of_steps(settings: Settings, forward: Array, end: Carry) -> Points:
    """The points at the recorded steps, and just before events."""
    record, here = end.record, settings.layout.point
    assert record is not None

    def row(i: Array) -> SavedPoint:
        return SavedPoint(forward * record.ts[i], record.ys[i, here], jnp.asarray(True))

    n = record.n + 1

    def point(i: Array) -> SavedPoint:
        j = jnp.maximum(i - n, 0)
        is_shown = jnp.isfinite(record.moments[j]) & (record.moments[j] > record.ts[0])
        before = SavedPoint(forward * record.moments[j], record.befores[j, here], is_shown)
        return jax.tree.map(lambda a, b: jnp.where(i < n, a, b), row(i), before)

    return n + record.n, point
