"""`simulate`: from a model to its solution, traceable in every number of the model."""

import dataclasses
import functools as ft
from collections.abc import Callable
from typing import Any, Literal

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx

from .._declare.component import Component
from .._errors import ModelError
from .._evaluate.initial import initial_state
from .._evaluate.observe import observe
from .._evaluate.system import Inputs, System, build
from .energy import powers
from .quantity import Quantity, trace
from .result import Result
from .solution import Solution, report_failure
from .solvers import AbstractRosenbrock, Rodas5P

Save = Literal["end", "steps", "dense"]
MAX_STEPS = 4096


@dataclasses.dataclass(frozen=True)
class _Settings:
    """What a run is compiled for."""

    system: System
    stop: Quantity | None
    integrand: Quantity | None
    direction: bool | None
    save: str
    solver: diffrax.AbstractSolver
    adjoint: diffrax.AbstractAdjoint
    max_steps: int
    progress: diffrax.AbstractProgressMeter


def simulate(
    model: Component,
    t1: Any,
    *,
    t0: Any = 0.0,
    until: Callable[[Any], Any] | None = None,
    direction: Literal["up", "down"] | None = None,
    save: Any = "steps",
    integrals: Callable[[Any], Any] | None = None,
    energy: bool = False,
    rtol: Any = 1e-6,
    solver: diffrax.AbstractSolver | None = None,
    dt0: Any = None,
    dtmin: Any = None,
    max_steps: int = MAX_STEPS,
    adjoint: diffrax.AbstractAdjoint | None = None,
    throw: bool = True,
    progress: bool = False,
    system: System | None = None,
) -> Solution:
    """Integrate a model from `t0` to `t1`, or until a condition is met.

    `jit`, `vmap`, `grad` and `jvp` work over the model, whose pytree leaves are its parameters and start values, and
    over the numbers given here. The structural work is done once for each structure of model and is cached.

    - `until(s)`: a real function of the variables, `s` having the shape of the model; the run stops where it crosses
      zero, in the given `direction` or in either. The time found is differentiable.
    - `save`: "steps" (every step), "end", "dense" (`sol.evaluate(t)`), or an array of times.
    - `integrals(s)`: a dictionary (any pytree) of scalar rates, integrated with the states into `sol.integrals`.
    - `energy`: integrate the powers of all components; `sol.energy` is the account.
    - `rtol`: relative tolerance; the absolute one is `rtol` times the nominal size of each variable.
    - `dt0`: first step, by default guessed from the vector field. `dtmin`: the smallest step before the run is given
      up, by default 1e-14 of the time span. `max_steps`: 4096 by default.
    - `adjoint`: by default `diffrax.DirectAdjoint()`, which allows both modes of differentiation.
    - `throw`: raise on failure. With False, look at `sol.result`; a condition never met gives `sol.t1 = inf`.
    - `system`: the outcome of `compile`, whose choice of states is then used.

    Raises `ModelError`, `StructureError` or `ParameterError` for what is wrong with the model and `SimulationError` for
    what goes wrong in the run.
    """
    leaves = jax.tree_util.tree_leaves(model)
    system = system_of(model) if system is None else system
    stop, constants = (None, []) if until is None else trace(until, system.flat, "until")
    rates = _rates(integrals, energy)
    integrand, numbers_in_rates = (None, []) if rates is None else trace(rates, system.flat, "integrals")
    saving = save if isinstance(save, str) else "times"
    settings = _Settings(
        system, stop, integrand, {"up": True, "down": False, None: None}[direction], saving, _solver_for(system, solver),
        adjoint or diffrax.DirectAdjoint(), max_steps,
        diffrax.TextProgressMeter() if progress else diffrax.NoProgressMeter(),
    )  # fmt: skip
    numbers = {
        "leaves": [None if i in system.variable_leaves else leaf for i, leaf in enumerate(leaves)],
        "starts": system.starts.pack(leaves), "t0": t0, "t1": t1, "rtol": rtol, "dt0": dt0, "dtmin": dtmin,
        "times": None if isinstance(save, str) else save, "constants": constants, "rates": numbers_in_rates,
    }  # fmt: skip
    solution = _run(settings, numbers)
    return report_failure(solution, leaves) if throw else solution


def _solver_for(system: System, solver: diffrax.AbstractSolver | None) -> diffrax.AbstractSolver:
    solver = Rodas5P() if solver is None else solver
    if system.solved is not None and not isinstance(solver, AbstractRosenbrock):
        raise ModelError(
            f"The mass-matrix form needs Rodas5P or Rodas3P; {type(solver).__name__} integrates ODEs only."
        )
    return solver


def _rates(integrals: Callable[[Any], Any] | None, energy: bool) -> Callable[[Any], Any] | None:
    """The rates to integrate: the user's, then the powers of the components."""
    if integrals is None and not energy:
        return None
    return lambda s: {"user": {} if integrals is None else integrals(s), "energy": powers(s) if energy else {}}


def system_of(model: Component) -> System:
    """The reduced system of a model, from its structure alone; cached."""
    leaves, structure = jax.tree_util.tree_flatten(model)
    return _system(structure, tuple(np.shape(leaf) for leaf in leaves))


@ft.lru_cache(maxsize=256)
def _system(structure: Any, shapes: tuple[tuple[int, ...], ...]) -> System:
    return build(structure.unflatten([jax.ShapeDtypeStruct(shape, float) for shape in shapes]))


@ft.partial(jax.jit, static_argnums=0)
def _run(settings: _Settings, numbers: dict[str, Any]) -> Solution:
    system = settings.system
    inputs = Inputs(system.pack_params(numbers["leaves"]), jnp.asarray(numbers["starts"]))
    y0, bad_start = initial_state(system, numbers["t0"], inputs)
    span = numbers["t1"] - numbers["t0"]
    controller = diffrax.PIDController(
        rtol=numbers["rtol"],
        atol=numbers["rtol"] * np.concatenate([system.nominals, np.ones(_extra(settings))]),
        dtmin=1e-14 * span if numbers["dtmin"] is None else numbers["dtmin"],
        force_dtmin=False,
    )
    raw = diffrax.diffeqsolve(
        diffrax.ODETerm(_vector_field(settings, numbers)), _with_mass(settings), numbers["t0"], numbers["t1"], numbers["dt0"],
        jnp.concatenate([y0, jnp.zeros(_extra(settings))]), inputs,
        saveat=diffrax.SaveAt(subs=_saves(settings.save, numbers["times"]), dense=settings.save == "dense"),
        stepsize_controller=controller, adjoint=settings.adjoint, max_steps=settings.max_steps, throw=False,
        event=_event(settings, numbers), progress_meter=settings.progress,
    )  # fmt: skip
    return _solution(settings, numbers, inputs, raw, y0, bad_start)


def _with_mass(settings: _Settings) -> diffrax.AbstractSolver:
    mass = settings.system.mass
    if mass is None:
        return settings.solver
    return dataclasses.replace(settings.solver, mass=np.concatenate([mass, np.ones(_extra(settings))]))


def _extra(settings: _Settings) -> int:
    """How many integrals are appended to the state vector."""
    return 0 if settings.integrand is None else settings.integrand.n_outputs


def _vector_field(settings: _Settings, numbers: dict[str, Any]) -> Callable[[Any, Any, Inputs], Any]:
    system, integrand = settings.system, settings.integrand
    if integrand is None:
        return system.vector_field

    def extended(t: Any, y: Any, inputs: Inputs) -> Any:
        y = y[: len(system.nominals)]
        values = read_leaves(system, integrand.leaves, numbers["leaves"], t, y, inputs)
        return jnp.concatenate([system.vector_field(t, y, inputs), jnp.stack(integrand(numbers["rates"], values))])

    return extended


def _saves(save: str, times: Any) -> dict[str, diffrax.SubSaveAt]:
    saves = {"end": diffrax.SubSaveAt(t1=True)}
    if save == "steps":
        saves["path"] = diffrax.SubSaveAt(t0=True, steps=True)
    elif save == "times":
        saves["path"] = diffrax.SubSaveAt(ts=times)
    return saves


def _event(settings: _Settings, numbers: dict[str, Any]) -> diffrax.Event | None:
    stop = settings.stop
    if stop is None:
        return None

    def condition(t: Any, y: Any, args: Inputs, **kwargs: Any) -> Any:
        states = y[: len(settings.system.nominals)]
        return stop(
            numbers["constants"], read_leaves(settings.system, stop.leaves, numbers["leaves"], t, states, args)
        )[0]

    return diffrax.Event(condition, optx.Newton(rtol=1e-13, atol=1e-15), settings.direction)


def read_leaves(system: System, wanted: Any, leaves: list[Any], t: Any, y: Any, inputs: Inputs) -> list[Any]:
    """Values of leaves by number: parameters as they are given, variables from the state."""
    variables = [leaf for leaf in wanted if leaf in system.variable_leaves]
    values = dict(zip(variables, observe(system, t, y, inputs, variables), strict=True))
    return [values[leaf] if leaf in values else leaves[leaf] for leaf in wanted]


def _solution(
    settings: _Settings, numbers: dict[str, Any], inputs: Inputs, raw: diffrax.Solution, y0: Any, bad_start: Any
) -> Solution:
    system = settings.system
    assert raw.ts is not None and raw.ys is not None
    end, path = "end", "path" if "path" in raw.ts else "end"
    n = len(system.nominals)
    t_end, y_end = raw.ts[end][0], raw.ys[end][0, :n]
    result, culprit = _outcome(settings, numbers, inputs, raw, t_end, y_end, bad_start)
    t1 = t_end if settings.stop is None else jnp.where(result == Result.stopped, t_end, jnp.inf)
    return Solution(
        t1=t1, t_start=jnp.asarray(numbers["t0"], float), y_start=y0, t_end=t_end, y_end=y_end, saved_ts=raw.ts[path], saved_ys=raw.ys[path][:, :n], end_integrals=raw.ys[end][0, n:],
        saved_integrals=raw.ys[path][:, n:], tree=None if settings.integrand is None else settings.integrand.tree, result=result, culprit=culprit,
        stats=raw.stats, leaves=numbers["leaves"], inputs=inputs, dense=raw.interpolation, system=system,
    )  # fmt: skip


def _outcome(
    settings: _Settings,
    numbers: dict[str, Any],
    inputs: Inputs,
    raw: diffrax.Solution,
    t_end: Any,
    y_end: Any,
    bad_start: Any,
) -> tuple[Any, Any]:
    """The result, and the number of the leaf that is to blame for a bad parameter."""
    system = settings.system
    stopped = jnp.asarray(False) if raw.event_mask is None else raw.event_mask
    result = Result.where(
        stopped, Result.stopped, Result.reached_end if settings.stop is None else Result.never_stopped
    )
    result = Result.where(raw.result == diffrax.RESULTS.max_steps_reached, Result.too_many_steps, result)
    failed = raw.result == diffrax.RESULTS.dt_min_reached
    result = Result.where(failed, Result.step_too_small, result)
    rates = system.vector_field(t_end, y_end, inputs)
    result = Result.where(jnp.all(jnp.isfinite(rates)) & jnp.all(jnp.isfinite(y_end)), result, Result.not_finite)
    bad = system.bad_parameters(numbers["leaves"])
    result = Result.where(jnp.any(bad_start), Result.bad_start, result)
    result = Result.where(jnp.any(bad), Result.bad_parameter, result)
    culprit = _first(bad) if len(bad) else jnp.asarray(0)
    return result, jnp.where(jnp.any(bad), culprit, _first(bad_start) if len(bad_start) else 0)


def _first(mask: Any) -> Any:
    return jnp.argmax(mask)
