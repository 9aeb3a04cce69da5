"""`simulate`: computes the solution of a model, and can be traced with respect to every number of the model."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Literal, TypeVar

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import ArrayLike, PyTree

from .._declare.annotations import Scalar
from .._declare.component import Component
from .._declare.history import past_of
from .._declare.layout import Layout, layout_of
from .._declare.node import Node, check_is_node
from .._declare.sizes import sized
from .._errors import ModelError, ParameterError
from .._evaluate.building import system_of_leaves
from .._evaluate.system import System
from .._garbage import seldom_collected
from .._jax_settings import check_precision
from .._numbers import Numbers
from .._progress import compiling
from .._units.quantity import has_unit
from .differentiated_run import is_differentiated, run_differentiated
from .results.end_jumps import warn_of_jumps_at_end
from .results.energy import powers, stored
from .results.failure import is_trial, report_failure
from .results.solution import Solution
from .results.unresolved import warn_of_unresolved
from .run import run_args
from .setup.expressions import check_units_of
from .setup.options import (
    check_known,
    count,
    flag,
    instant,
    kind_of,
    number,
    one_of,
    times_of,
)
from .setup.result import Result
from .setup.settings import RunNumbers, Settings
from .setup.user_function import UserFunction, as_function, trace
from .solvers import AbstractRosenbrock, Rodas5P
from .start.initialise import initialised_leaves, needs_search
from .start.start_search import search_start
from .stored_run import run_stored

MAX_STEPS = 4096
MAX_EVENTS = 32
M = TypeVar("M", bound=Component)
_DIRECTIONS: dict[str | None, bool | None] = {"up": True, "down": False, None: None}


@seldom_collected()
def simulate(
    model: M,
    t1: ArrayLike,
    *,
    t0: ArrayLike = 0.0,
    until: Callable[[M], Scalar] | None = None,
    direction: Literal["up", "down"] | None = None,
    save: object = "steps",
    integrals: Callable[[M], PyTree] | None = None,
    peaks: Callable[[M], PyTree] | None = None,
    energy: bool = False,
    rtol: ArrayLike = 1e-6,
    nominal: Mapping[str, object] | None = None,
    solver: diffrax.AbstractSolver | None = None,
    dt0: ArrayLike | None = None,
    dtmin: ArrayLike | None = None,
    dtmax: ArrayLike | None = None,
    max_steps: int = MAX_STEPS,
    max_events: int = MAX_EVENTS,
    adjoint: diffrax.AbstractAdjoint | None = None,
    resume: bool | None = None,
    throw: bool = True,
    progress: bool | None = None,
    system: System | None = None,
) -> Solution[M]:
    """Integrate a model from `t0` to `t1` (in s), or until a condition is met.

    `jit`, `vmap`, `grad` and `jvp` apply to the model, whose pytree leaves are its parameters and start values, and to
    the numbers given here. The structural work is done once for each structure of model and is cached.

    - `t0`: start time in s.
    - `until(s)`: a real function of the variables, where `s` has the shape of the model. The run stops when it crosses
      zero, at a time that is differentiable. None: run to `t1`.
    - `direction`: direction of the crossing, "up" or "down". None: either.
    - `save`: "steps" (every step), "end" (the end only), an array of times, or "dense" (every step, with dense output
      also inside `jit`, `vmap` and `grad`). Outside of these, every run except one with "end" has dense output.
    - `integrals(s)`: a dictionary (any pytree) of scalar rates, integrated with the states into `sol.integrals`.
    - `peaks(s)`: a dictionary (any pytree) of functions. `sol.peaks` holds the largest value of each over the run and
      its time, exact on the dense output and differentiable. For the smallest value, pass the negative function.
    - `energy`: integrate the powers of all components with the states. `sol.energy` is the account.
    - `rtol`: relative tolerance. The absolute tolerance is `rtol` times the nominal size of each variable.
    - `nominal`: nominal sizes of variables by path, such as `{"c.v": 1e-5}`, in place of those of their units.
    - `solver`: `Rodas3P()` or a solver of diffrax. None: `Rodas5P()`.
    - `dt0`: first step in s. None: estimated from the vector field.
    - `dtmin`: smallest step in s, below which the run fails. None: 1e-14 of the time since t0.
    - `dtmax`: largest step in s, for events of signals that vary faster than the steps resolve. None: no limit.
    - `max_steps`: maximum number of steps, including rejected ones.
    - `max_events`: maximum number of events in the log inside `jit`, `vmap` and `grad`. Later events fire too.
    - `adjoint`: method of differentiation, as in diffrax. None: both modes of differentiation work.
    - `resume`: True: continue a run, as in `simulate(sol.final, t1, t0=sol.t1, resume=True)`. Events due before `t0`,
      and those whose conditions are true at `t0`, do not fire again. False: they fire. None: they fire, except those
      that `initialise` has already fired for this start.
    - `throw`: raise an error on failure. False: `sol.result` holds the outcome, and `sol.t1` is infinite if the stop
      condition was never met. In searches and sweeps of `acausal.design`, all numbers of a failed run are NaN instead.
    - `progress`: True: print the progress of the run. None: report only long compilations. False: report nothing.
    - `system`: result of `choose_states`, which fixes the choice of states. None: chosen from the classes.

    Raises `ModelError`, `StructureError` or `ParameterError` if the model is wrong, and `SimulationError` if the run
    fails. Outside of `jit` and `vmap`, it warns with `UnresolvedWarning` of variables that are too small for the error
    tolerance. `sol.unresolved` lists them. It warns with `JumpWarning` of events at the end time whose times depend on
    differentiated parameters, with which the results jump.
    """
    check_precision()
    model = model if nominal is None else sized(model, nominal)
    throw, energy = flag(throw, "throw"), flag(energy, "energy")
    progress = None if progress is None else flag(progress, "progress")
    check_is_node(model)
    given, structure = jax.tree_util.tree_flatten(model)
    given = [_as_number(leaf) for leaf in given]
    if system is None:
        system = system_of_leaves(structure, given)
    kind_of(system, "system", System, "choose_states(model)")
    layout = layout_of(structure)
    _check_same_structure(model, layout, system)
    leaves = layout.numbers(given)
    start_time = instant(t0, "t0")
    past = past_of(model) if resume is None else None
    resume = resume is not None and flag(resume, "resume")
    if not resume:
        leaves = _without_histories(system, leaves)
    is_searched = not resume and needs_search(system, leaves)
    stop, stop_constants = _traced(until, system, "until")
    if stop is not None:
        check_units_of(stop, system.flat, "until")
    integrand, rate_constants = _traced(_rates(integrals, energy), system, "integrals")
    watched, peak_constants = _traced(peaks, system, "peaks")
    stored_energy, stored_constants = _traced(_total_stored if energy and system.events else None, system, "energy")
    settings = Settings(
        system=system,
        stop=stop,
        integrand=integrand,
        peaks=watched if watched is not None and watched.n_outputs else None,
        stored=stored_energy,
        direction=one_of(direction, "direction", _DIRECTIONS),
        save=save if isinstance(save, str) else "times",
        solver=_solver_for(system, solver),
        adjoint=adjoint and kind_of(adjoint, "adjoint", diffrax.AbstractAdjoint, "one of diffrax, or None"),
        max_steps=count(max_steps, "max_steps"),
        max_events=count(max_events, "max_events"),
        progress=diffrax.TextProgressMeter() if progress else diffrax.NoProgressMeter(),
        is_initialised=is_searched,
        is_resumed=resume,
    )
    numbers = RunNumbers(
        t0=start_time,
        t1=number(t1, "t1"),
        dt0=None if dt0 is None else number(dt0, "dt0"),
        dtmin=None if dtmin is None else number(dtmin, "dtmin"),
        dtmax=None if dtmax is None else number(dtmax, "dtmax"),
        rtol=number(rtol, "rtol", "1"),
        times=times_of(save),
        stop=stop_constants,
        rates=rate_constants,
        peaks=peak_constants,
        stored=stored_constants,
        past=past,
    )
    check_known(system, numbers)
    if is_differentiated(settings, leaves, numbers):
        with compiling("a run", model, run_differentiated, progress):
            solution = run_differentiated(settings, leaves, numbers)
        if is_searched and throw and not is_trial() and solution.result == Result.bad_start:
            initialised_leaves(system, jax.lax.stop_gradient(leaves), start_time, past)  # raises with the reason
    else:
        if is_searched:
            with compiling("the start", model, search_start, progress):
                leaves, failed = initialised_leaves(system, leaves, start_time, past, throw=throw and not is_trial())
            numbers = dataclasses.replace(numbers, start_failed=failed)
        params, args = run_args(settings, leaves, numbers)
        with compiling("a run", model, run_stored, progress):
            solution = dataclasses.replace(run_stored(settings, args), _params=params.leaves)
    solution = report_failure(solution, throw)
    warn_of_unresolved(solution)
    warn_of_jumps_at_end(solution, t1)
    return solution


def _as_number(value: Any) -> Any:
    """Converts a number to the default float type, so that an integer does not trigger a new compilation."""
    if isinstance(value, float):
        return value
    if isinstance(value, jax.Array | np.ndarray) and value.dtype == jax.dtypes.canonicalize_dtype(float):
        return value
    if has_unit(value):
        raise ParameterError(f"A number of the model was changed to {value}: use replace(...), which converts units.")
    if isinstance(value, str) or np.iscomplexobj(value):
        raise ParameterError(f"A number of the model was changed to {value!r}, which is not a real number.")
    return float(value) if isinstance(value, int) else jnp.asarray(value, float)


def _without_histories(system: System, leaves: Sequence[Any]) -> list[Any]:
    """The leaves without the signals that another run has recorded."""
    found = list(leaves)
    for entry in system.events.remembered if system.events else ():
        if entry.history is not None and found[entry.history] is not None:
            found[entry.history] = jnp.full_like(jnp.asarray(found[entry.history], float), -jnp.inf)
    return found


def _traced(
    function: Callable[[PyTree], PyTree] | None, system: System, what: str
) -> tuple[UserFunction | None, list[Numbers]]:
    return (None, []) if function is None else trace(function, system.flat, what)


def _rates(integrals: Callable[[PyTree], PyTree] | None, energy: bool) -> Callable[[PyTree], PyTree] | None:
    """The rates to integrate: those of the user and the powers of the components."""
    if integrals is None and not energy:
        return None
    if integrals is not None:
        as_function(integrals, "integrals")
    return lambda s: {"user": {} if integrals is None else integrals(s), "energy": powers(s) if energy else {}}


def _total_stored(s: Node) -> Scalar:
    return sum(stored(s).values(), jnp.asarray(0.0))


def _solver_for(system: System, solver: diffrax.AbstractSolver | None) -> diffrax.AbstractSolver:
    if solver is None:
        solver = Rodas5P()
    kind_of(solver, "solver", diffrax.AbstractSolver, "a solver of diffrax, such as diffrax.Tsit5()")
    if not isinstance(solver, diffrax.AbstractAdaptiveSolver):
        name = type(solver).__name__
        raise ModelError(
            f"solver={name}() does not estimate its error, which step size control needs. Remedy: use one that does, "
            f"such as diffrax.Tsit5(), or diffrax.HalfSolver(diffrax.{name}())."
        )
    if system.solved is not None and not isinstance(solver, AbstractRosenbrock):
        raise ModelError(
            f"The mass-matrix form needs Rodas5P or Rodas3P; {type(solver).__name__} integrates ODEs only."
        )
    return solver


def _check_same_structure(model: Component, layout: Layout, system: System) -> None:
    if layout.structure != system.flat.structure:
        raise ModelError(
            f"The structure or nominal sizes of the {type(model).__name__} differ from those of the model that "
            "`system` was made from. Remedy: make it again with the same sizes: choose_states(sized(model, {...}))."
        )
