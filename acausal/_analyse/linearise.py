"""`linearise`: from a model at an operating point to a linear system."""

import copy
import functools as ft
import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from .._declare.annotations import Param, Scalar
from .._declare.by_name import replace
from .._declare.component import Component, Connection, Connections, eq
from .._declare.node import Port, derived, extended, leaves_of
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
from .operating_point import OperatingPoint, invariants_at, operating_point
from .redundant import reduced

FIELD = "_opened_"


class Break(NamedTuple):
    """An opened loop: the port, and the parameter that replaces its signal."""

    port: str
    signal: str
    parameter: str


def opened(model: Component, ports: Sequence[str]) -> tuple[Component, list[Break]]:
    """The model with loops opened at ports with one variable and no flow."""
    breaks = []
    for number, port in enumerate(ports):
        model, found = _broken(model, port, f"{FIELD}{number}")
        breaks.append(found)
    return model, breaks


def continued(model: Component, point: OperatingPoint, breaks: Sequence[Break]) -> tuple[Component, Component]:
    """The opened model, whose new parameters have the values of the signals at a point of the closed model, and a view
    of the opened model at that point.
    """
    flat, system = point.system.flat, system_of(model)
    values = dict(zip((leaf.path for leaf in flat.leaves), point.read(range(len(flat.leaves)), point.y), strict=True))
    for one in breaks:
        owner = one.parameter.removesuffix("k")
        values |= {
            one.parameter: values[one.signal],
            owner + one.signal.replace(one.port, "port", 1): values[one.signal],
        }
    view = system.flat.structure.unflatten([values[leaf.path] for leaf in system.flat.own_leaves])
    return replace(model, {one.parameter: values[one.signal] for one in breaks}), view


def _broken(model: Component, path: str, field: str) -> tuple[Component, Break]:
    parts = path.split(".")
    owners: list[Any] = [model]
    for part in parts:
        owners.append(getattr(owners[-1], part, None))
    port: Any = owners[-1]
    leaves = list(leaves_of(port)) if isinstance(port, Port) else []
    if len(leaves) != 1 or leaves[0].declaration.role != "var":
        raise ModelError(f"{path!r} is not a signal: to open a loop, name a port of one value, such as 'controller.y'.")
    for depth in range(len(parts) - 2, -1, -1):
        if any(port is other for connection in owners[depth].connections() for other in connection.ports):
            break
    else:
        raise ModelError(f"{path} is not connected, so there is no loop to open.")
    prefix = "".join(f"{part}." for part in parts[:depth])
    kind: Any = type(port)
    cls = _opened_class(type(owners[depth]), ".".join(parts[depth:]), field, kind)
    made: Any = extended(owners[depth], cls, **{field: _source_class(kind)()})
    for owner, part in zip(reversed(owners[:depth]), reversed(parts[:depth]), strict=True):
        made = _changed(owner, part, made)
    return made, Break(path, f"{path}.{leaves[0].path}", f"{prefix}{field}.k")


def _changed(owner: Component, name: str, value: Any) -> Any:
    made = copy.copy(owner)
    object.__setattr__(made, name, value)
    return made


class _Opening(Component, partial=True):
    """A source that drives a port with the value of a parameter."""

    k: Param[Scalar, ""] = 0.0


@ft.cache
def _source_class(port: Any) -> Any:
    (leaf,) = leaves_of(port())

    def equations(self: Any, d: Any) -> Any:
        return dict(opened=eq(getattr(self.port, leaf.path), self.k, check_units=False))

    return derived(_Opening, {"port": port}, {"port": port(), "equations": equations})


@ft.cache
def _opened_class(cls: Any, path: str, field: str, port: Any) -> Any:
    """The class with connections in which another source drives one of its signals."""

    def connections(self: Any) -> Connections:
        signal, source = ft.reduce(getattr, path.split("."), self), getattr(self, field).port
        return tuple(_moved(connection, signal, source) for connection in cls.connections(self))

    return derived(cls, {field: _source_class(port)}, {"connections": connections})


def _moved(connection: Connection, signal: Port, source: Port) -> Connection:
    return Connection(tuple(source if port is signal else port for port in connection.ports))


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
