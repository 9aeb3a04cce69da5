"""The vector that is stepped, its rates, tolerances and solver.

It holds the states, the memory of iterations, the discrete variables, the energies lost at events, a flag, and the
integrals.
"""

import dataclasses
import functools as ft
from collections.abc import Callable, Sequence
from typing import Any

import jax.numpy as jnp
import numpy as np

from .._evaluate.observe import observe
from .._evaluate.starts import Inputs
from .._evaluate.system import System
from .controller import GriddedSteps
from .settings import Numbers, Settings
from .solvers import Guided, Switching
from .switching import Switches

INSTANT = 1e-13  # of the time span: how long after its start conditions are looked at there


def solver_of(settings: Settings) -> Any:
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


def through_events(settings: Settings, numbers: Numbers, inputs: Inputs, solver: Any, y0: Any) -> tuple[Any, Any, Any]:
    """The solver for a model with events, the extended state vector after those at the start, and a flag."""
    system = settings.system
    if system.happenings is None:
        return solver, y0, jnp.zeros(0)
    read = ft.partial(read_leaves, system, numbers.params)
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


def controller_of(settings: Settings, numbers: Numbers) -> GriddedSteps:
    """Tolerances per variable; the integrals, energies above all, count as of size 1."""
    others = settings.system.memory_size + settings.n_switched + settings.n_extra
    sizes = np.concatenate([settings.system.nominals, np.ones(others)])
    smallest = 1e-14 * jnp.abs(numbers.t1 - numbers.t0) if numbers.dtmin is None else numbers.dtmin
    return GriddedSteps(numbers.rtol, numbers.rtol * sizes, dtmin=smallest, force_dtmin=False)


def vector_field_of(settings: Settings, numbers: Numbers) -> Callable[[Any, Any, Any], Any]:
    """The rates of states and integrals; a `Guided` solver hands the memory on beside the inputs."""
    system, integrand = settings.system, settings.integrand
    n, bare = len(system.nominals), len(system.nominals) + settings.n_extra

    def rates(t: Any, states: Any, inputs: Inputs) -> Any:
        if integrand is None or settings.n_integrals == 0:
            return jnp.zeros(settings.n_extra)
        return jnp.stack(
            integrand(numbers.rates, read_leaves(system, numbers.params, integrand.leaves, t, states, inputs))
        )

    def field(t: Any, y: Any, args: Any) -> Any:
        inputs, memory = args if isinstance(args, tuple) else (args, jnp.zeros(0))
        is_whole = len(y) > bare
        states = y[: settings.n_states] if is_whole else jnp.concatenate([y[:n], memory])
        # What does not change between events is part of the vector only where no solver has taken it out.
        still = jnp.zeros(system.memory_size + settings.n_switched if is_whole else 0)
        return jnp.concatenate([system.vector_field(t, states, inputs), still, rates(t, states, inputs)])

    return field


def read_leaves(
    system: System, params: Sequence[Any], wanted: Sequence[int], t: Any, y: Any, inputs: Inputs
) -> list[Any]:
    """Values of leaves by number: parameters as they are given, variables from the state."""
    variables = [leaf for leaf in wanted if leaf in system.variable_leaves]
    values = dict(zip(variables, observe(system, t, y, inputs, variables), strict=True))
    values |= system.discrete_values(y, inputs)
    return [values[leaf] if leaf in values else params[leaf] for leaf in wanted]
