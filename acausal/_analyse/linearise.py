"""`linearise`: from a model at an operating point to a linear system."""

import functools as ft
import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from .._declare.component import Component
from .._errors import ModelError, listed
from .._evaluate.building import system_of
from .._evaluate.sampled import samplers
from .._evaluate.system import System
from .._integrate.setup.options import kind_of, names_of
from .._integrate.setup.pattern import pattern_of_rates
from .._integrate.setup.user_function import UserFunction, trace
from .._interpret.in_parts import in_parts
from .._numbers import Numbers
from .._progress import compiling
from .._sparse_matrix import Pattern
from .linear_system import LinearSystem
from .named_signals import (
    Element,
    Output,
    Signals,
    input_places,
    input_signals,
    input_values,
    output_signals,
    state_signals,
    with_inputs,
)
from .opened import continued, opened
from .operating_point import OperatingPoint, invariants_at, operating_point
from .redundant import reduced


def linearise(
    model: Component,
    *,
    at: object = None,
    t: object = None,
    inputs: Sequence[str] = (),
    outputs: Sequence[Output] | Mapping[str, Output] = (),
    open: Sequence[str] | str = (),
    system: System | None = None,
) -> LinearSystem:
    """Linearise a model: d(dx)/dt = A dx + B du, dy = C dx + D du for small deviations from an operating point.

    The derivatives are exact (automatic differentiation of the reduced equations). `jit`, `vmap` and `grad` work over
    the model and the operating point.

    - `at`: a view of the model, such as `sol.final` or `sol.at(t)`, with its states and modes; or a state
      vector in the order of `system.state_names`, with the modes that it implies; or None for the model's own start
      values, made consistent, after the events at the start. Parameters are those of `model`. The point need not be an
      equilibrium. But only there do the poles determine stability, independently of the choice of states; `rates`
      holds the derivatives of the states at the point.
    - `t`: the time in s for models with a clock, by default that of the view, else 0.
    - `inputs`: paths of scalar parameters, such as "supply.V".
    - `outputs`: paths of variables, such as "motor.rotor.w", or functions of the model, `lambda s: s.load.w ** 2`; a
      mapping gives them names.
    - `open`: ports at which loops are opened, such as "controller.y". Each becomes an input and an output of its name:
      the input is the signal after the break, the output the signal that returns to it. With G from this
      input to this output, the loop transfer function of negative feedback is -G, see `margins`. The operating point is
      that of the closed loops.
    - `system`: the result of `choose_states`, which fixes the choice of states.

    Sampled variables are held constant: a `SampledWarning` names them.

    Raises `ModelError` for an unknown name, for an exact delay, for an operating point of another model, and for an
    input whose rate of change the model needs; `ParameterError` for parameters outside their range; and
    `SimulationError` for start values that contradict each other, or that a component refuses.
    """
    system = system_of(model) if system is None else kind_of(system, "system", System, "choose_states(model)")
    _refuse_histories(system)
    warn_of_samples(system)
    if open:
        return _linearised_open(model, at, t, inputs, outputs, names_of(open, "open"))
    return _linearised(model, at, t, inputs, outputs, system)


def _linearised(
    model: Component,
    at: object,
    t: object,
    inputs: Sequence[str],
    outputs: Sequence[Output] | Mapping[str, Output],
    system: System,
) -> LinearSystem:
    """The linear system of a model for a given choice of states."""
    system = system if system.solved is None else system.solved
    places = tuple(input_places(system, inputs))
    output, function = output_signals(system, outputs)
    quantity, constants = trace(function, system.flat, "outputs")
    with compiling("the linearisation", model, _matrices):
        point = operating_point(model, system, at, t)
        rates, A, B, C, D = _matrices(places, quantity, constants, point)
    state, sizes, basis = state_signals(system), system.nominals, None
    independent = np.arange(len(sizes))
    invariants = invariants_at(point)
    if invariants is not None:
        A, B, C, basis, independent = reduced(A, B, C, jax.jacfwd(invariants)(point.y), sizes)
        state = Signals(*(tuple(item[i] for i in independent) for item in (state.names, state.units)))
    source = input_signals(system, places)
    return LinearSystem(
        A=A,
        B=B,
        C=C,
        D=D,
        rates=rates,
        states=state.names,
        inputs=source.names,
        outputs=output.names,
        units=(state.units, source.units, output.units),
        sizes=tuple(sizes[independent].tolist()),
        _point=point,
        _basis=basis,
        _independent=tuple(independent.tolist()),
    )


def _linearised_open(
    model: Component, at: object, t: object, inputs: Sequence[str], outputs: Any, ports: Sequence[str]
) -> LinearSystem:
    """The linear system with loops opened at ports, at the operating point of the closed loops."""
    broken, breaks = opened(model, ports)
    point = operating_point(model, system_of(model), at, t)
    if isinstance(outputs, str) or callable(outputs):
        outputs = (outputs,)
    if not isinstance(outputs, Mapping):
        outputs = {f"outputs[{i}]" if callable(out) else out: out for i, out in enumerate(outputs)}
    broken, view = continued(broken, point, breaks)
    found = _linearised(
        broken,
        view,
        point.t,
        [*names_of(inputs, "inputs"), *(one.parameter for one in breaks)],
        {**outputs, **{one.port: one.signal for one in breaks}},
        system_of(broken),
    )
    return found._replaced(inputs=(*found.inputs[: len(found.inputs) - len(breaks)], *ports))


@ft.partial(in_parts, static_argnums=(0, 1))
def _matrices(
    places: tuple[Element, ...], quantity: UserFunction, constants: list[Numbers], point: OperatingPoint
) -> Any:
    """dx/dt at the point, and A, B, C and D."""
    n, u = point.y.shape[0], input_values(point.params, places)

    def extended(z: Array) -> Array:
        y, params = z[:n], with_inputs(point.params, places, z[n:])
        rates = point.system.vector_field(point.t, y, point.inputs(params))
        return jnp.concatenate(
            [rates, *(value[None] for value in quantity(constants, point.read(quantity.leaves, y, params)))]
        )

    z = jnp.concatenate([point.y, u])
    if (pattern := pattern_of_rates(point.system)) is not None:
        return _sparse_matrices(extended, z, pattern)
    slopes = jax.jacfwd(extended)(z) if len(z) else jnp.zeros((quantity.n_outputs, 0))
    return extended(z)[:n], slopes[:n, :n], slopes[:n, n:], slopes[n:, :n], slopes[n:, n:]


def _sparse_matrices(extended: Callable[[Array], Array], z: Array, pattern: Pattern) -> tuple[Array, ...]:
    """The same for many states: A by one directional derivative for each colour of the pattern, C by reverse mode."""
    n = pattern.n
    directions = np.pad(pattern.seeds, ((0, 0), (0, len(z) - n)))
    value, along = jax.vmap(lambda way: jax.jvp(extended, (z,), (way,)), out_axes=(None, 0))(jnp.asarray(directions))
    A = jnp.zeros((n, n)).at[pattern.rows, pattern.columns].set(along[pattern.colours[pattern.columns], pattern.rows])
    slopes = jax.jacfwd(lambda u: extended(jnp.concatenate([z[:n], u])))(z[n:])
    C = jax.jacrev(lambda y: extended(jnp.concatenate([y, z[n:]]))[n:])(z[:n])
    return value[:n], A, slopes[:n], C, slopes[n:]


def _refuse_histories(system: System) -> None:
    """Raise `ModelError` for delays: their linear systems have infinitely many states."""
    names = system.events.history_names if system.events else []
    if names:
        raise ModelError(
            f"A linear system of finitely many states has no exact delay: {listed(names)}. Remedy: a PadeDelay."
        )


class SampledWarning(UserWarning):
    """A linear system holds the sampled variables of a model constant."""


def warn_of_samples(system: System) -> None:
    """Warn of periodic events that set variables: a linear system holds these constant, as if the loops through them
    were open.
    """
    labels = [label for sampler in samplers(system) for label in sampler.labels]
    if labels:
        warnings.warn(
            f"The linear system holds sampled variables constant, as if the loops through them were open, for "
            f"{listed(labels)}. Remedy: replace a sampled controller by a continuous one.",
            SampledWarning,
            stacklevel=3,
        )
