"""The operating point of a linearisation."""

import dataclasses
import functools as ft
from collections.abc import Callable, Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, PyTree

from .._declare.component import Component
from .._declare.history import Past, past_of
from .._declare.layout import complete_leaves
from .._errors import ModelError, SimulationError
from .._evaluate.building import check_structure
from .._evaluate.groups import ModelParameters
from .._evaluate.initial import checked_names, initial_state
from .._evaluate.invariants import missed_invariants
from .._evaluate.observe import observe
from .._evaluate.starts import Inputs
from .._evaluate.system import System
from .._integrate.loop.loop_start import event_start, why_ended
from .._integrate.setup.options import check_starts_after_past, instant, starts_after_past
from .._integrate.start.initialise import initialised_leaves, needs_search
from .._interpret.in_parts import in_parts
from .._numbers import Numbers
from .._reduce.aliases import TIME
from .._tracing import is_traced

ITERATIONS = 20  # Gauss-Newton iterations for states that a view does not contain


class OperatingPoint(eqx.Module):
    """Time, state vector and parameters of a model."""

    t: Array
    y: Float[Array, " n"]
    params: ModelParameters
    starts: Numbers
    given: frozenset[int] = eqx.field(static=True)
    system: System = eqx.field(static=True)
    is_initialised: bool = eqx.field(static=True, default=False)  # whether the events at the start were processed
    past: Past | None = None  # event history

    def inputs(self, params: ModelParameters | None = None) -> Inputs:
        """The inputs of the compiled functions, with other parameters if they are given."""
        return Inputs(self.system.intake.packed(self.params if params is None else params), self.starts, self.given)

    def read(self, leaves: Sequence[int], y: Array, params: ModelParameters | None = None) -> list[Numbers]:
        """The values of leaves by number, in the state `y`."""
        params = self.params if params is None else params
        variables = [leaf for leaf in leaves if self.system.flat.is_variable(leaf)]
        observed = observe(self.system, self.t, y, self.inputs(params), variables)
        values = dict(zip(variables, observed, strict=True))
        return [values[leaf] if leaf in values else params.leaves[leaf] for leaf in leaves]


def invariants_at(point: OperatingPoint) -> Callable[[Array], Array] | None:
    """The invariants as a function of the state vector, if there are more states than degrees of freedom."""
    if not point.system.ordered.invariants:
        return None
    return lambda y: missed_invariants(point.system, point.t, y, point.inputs())


def operating_point(model: Component, system: System, at: object, t: object) -> OperatingPoint:
    """The operating point for the arguments of `linearise`."""
    check_structure(model, system, f"The {type(model).__name__} to linearise")
    leaves, _ = complete_leaves(model)
    start_failed = None
    if not isinstance(at, Component):
        check_starts_after_past(system, past_of(model), 0.0 if t is None else instant(t, "t"), "t")
    if at is None and needs_search(system, leaves):
        leaves, start_failed = initialised_leaves(system, leaves, 0.0 if t is None else instant(t, "t"), past_of(model))
    if at is None:
        system.intake.check(leaves)
    params = jax.tree.map(lambda value: jnp.asarray(value, float), system.intake.parameters(leaves))
    params = system.intake.enforced(params)
    starts = jnp.asarray(system.intake.starts.pack(leaves))
    if isinstance(at, Component):
        check_structure(at, system, "The operating point")
        _check_one_instant(system, at)
        t = _time_of(system, at) if t is None else t
        values = complete_leaves(at)[0]
        own = [i for i in system.carried.discrete_places if i < len(values)]
        params = params.changed({i: jnp.asarray(values[i], float) for i in own})
        if system.events is not None:
            params = params.changed(system.events.truths_of([jnp.asarray(leaf, float) for leaf in values]))
    t, given = jnp.asarray(0.0 if t is None else instant(t, "t")), system.intake.given(leaves)
    point = OperatingPoint(t, jnp.zeros(0), params, starts, given, system, start_failed is not None, past_of(model))
    y = _state(point, at)
    y = y if start_failed is None else jnp.where(start_failed > 0.0, jnp.nan, y)
    point = dataclasses.replace(point, y=y)
    return point if system.events is None or isinstance(at, Component) else _after_events(point, at)


def _after_events(point: OperatingPoint, at: object) -> OperatingPoint:
    """The point in the modes that it implies; for start values, after the events at the start."""
    y, params, outcome, holds = _event_start(point)
    if not is_traced(outcome) and outcome != 0:
        why = why_ended(point.system, float(outcome), holds)
        raise SimulationError(
            f"{point.system.name} has no operating point at its start values. {why} Remedy: give other start values, "
            "or a point such as at=sol.final."
        )
    is_late = point.past is None or starts_after_past(point.system, point.past, point.t).holds
    y = jnp.where((outcome == 0) & is_late, y if at is None else point.y, jnp.nan)
    return dataclasses.replace(point, y=y, params=params)


@in_parts
def _event_start(point: OperatingPoint) -> tuple[Any, ModelParameters, Any, Any]:
    """States and parameters after the events at the start, the outcome of the start, and the true conditions."""
    system, inputs = point.system, point.inputs()
    start = event_start(system, point.t, point.y, inputs, point.past, is_initialised=point.is_initialised)
    held = system.carried.discrete_values(start.y[start.events.layout.point], inputs)
    return start.states, point.params.changed(held), start.outcome, start.holds


def _state(point: OperatingPoint, at: Any) -> Array:
    system = point.system
    if at is None:
        return _start(point)
    if isinstance(at, Component):
        return _state_of_view(point, at)
    if not isinstance(at, jax.Array | np.ndarray | list | tuple):
        raise ModelError(
            f"at={type(at).__name__} is not an operating point: give a view of the model such as sol.final or "
            "sol.at(t), a state vector, or None for the start values."
        )
    y = jnp.asarray(at, float)
    if y.shape != system.nominals.shape:
        raise ModelError(
            f"The operating point has shape {y.shape}, but the system has {len(system.nominals)} states: "
            f"{', '.join(system.state_names) or 'none'}."
        )
    return y


def _check_one_instant(system: System, view: PyTree) -> None:
    for leaf, value in zip(system.flat.own_leaves, complete_leaves(view)[0], strict=True):
        if value is None:
            raise ModelError(
                f"The operating point gives no value for {leaf.path}: it must be a view of all variables, such as "
                "sol.final or sol.at(t). Without at=, the point is that of the start values of the model."
            )
        if leaf.declaration.is_variable and np.shape(value) not in ((), leaf.stack + leaf.sizes):
            raise ModelError(
                f"The operating point is not one instant: {leaf.path} has shape {np.shape(value)}. Give sol.final or "
                "sol.at(t) with one time, and use jax.vmap for several."
            )


def _start(point: OperatingPoint) -> Array:
    """The consistent start values. Contradictory ones give NaN, or an error if the numbers are known."""
    y, bad = _initial_state(point)
    if not is_traced(bad) and np.any(bad):
        name = checked_names(point.system, point.inputs().given)[int(np.argmax(np.asarray(bad)))]
        raise SimulationError(
            f"The start values contradict the constraints: {name} cannot have the value it is given. Leave it out, or "
            "the value of a variable with a rigid connection to it."
        )
    return jnp.where(jnp.any(bad), jnp.nan, y)


@in_parts
def _initial_state(point: OperatingPoint) -> tuple[Array, Array]:
    return initial_state(point.system, point.t, point.inputs())


def _time_of(system: System, view: PyTree) -> Array | None:
    """The time of a view; None if the model has no leaf for it."""
    times = np.flatnonzero(system.merged.representative == TIME)
    return _value_of_node(system, complete_leaves(view)[0], int(times[0])).reshape(()) if len(times) else None


def _value_of_node(system: System, leaves: Sequence[Array], node: int) -> Array:
    """The value of a node in a view, as a flat vector."""
    index = int(system.flat.leaf_of_node[node])
    leaf = system.flat.leaves[index]
    whole = jnp.broadcast_to(jnp.asarray(leaves[index], float), leaf.stack + leaf.sizes)
    return whole.reshape(leaf.count, -1)[node - leaf.first]


def _state_of_view(point: OperatingPoint, view: PyTree) -> Array:
    """The states from the leaves of a view; a state that is a derivative follows from other variables."""
    system = point.system
    leaves, _ = complete_leaves(view)
    table, size = system.ordered.table, system.plan.size
    parts = [
        jnp.zeros(size(v)) if order else _value_of_node(system, leaves, int(table.variables[v]))
        for v, order in system.states
    ]
    y = jnp.concatenate(parts) if parts else jnp.zeros(0)
    hidden = np.repeat([order > 0 for _, order in system.states], [size(v) for v, _ in system.states])
    return _completed(point, leaves, y, tuple(np.flatnonzero(hidden).tolist())) if hidden.any() else y


@ft.partial(in_parts, static_argnums=(3,))
def _completed(point: OperatingPoint, leaves: Sequence[Array], y: Array, elements: tuple[int, ...]) -> Array:
    """The state whose `elements` reproduce all variables of a view, by the Gauss-Newton method."""
    system, hidden = point.system, np.array(elements)
    wanted = system.flat.variable_leaves
    target = jnp.concatenate([jnp.ravel(jnp.asarray(leaves[i], float)) for i in wanted])

    def misfit(x: Array) -> Array:
        values = point.read(wanted, y.at[hidden].set(x * system.nominals[hidden]))
        return jnp.concatenate([jnp.ravel(value) for value in values]) - target

    def step(x: Array, _: None) -> tuple[Array, None]:
        slopes = jax.jacfwd(misfit)(x)
        rows = 1.0 / jnp.maximum(jnp.max(jnp.abs(slopes), axis=1), 1e-300)
        return x - jnp.linalg.lstsq(slopes * rows[:, None], misfit(x) * rows)[0], None

    x, _ = jax.lax.scan(step, jnp.zeros(len(hidden)), None, length=ITERATIONS)
    return y.at[hidden].set(x * system.nominals[hidden])
