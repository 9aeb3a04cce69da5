"""The equations of a component with open ports, as residuals at a point."""

import functools as ft
import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import PyTree

from .._declare.array import Array, deepened
from .._declare.component import Component, Energy
from .._declare.fields import join
from .._declare.layout import complete_leaves
from .._declare.node import Port
from .._evaluate.event_set import EventEntry
from .._evaluate.events import events_of
from .._integrate.results.energy import accounts
from .._numbers import Numbers
from .._reduce.flat_model import FlatModel
from .._reduce.flatten import children, flatten
from .._reduce.incidence import nominal_size

Params = Sequence[jax.Array | np.ndarray]  # in the order of the leaves of a component, like the modes
Modes = Sequence[jax.Array | np.ndarray]


def quick(function: Callable[..., PyTree]) -> Callable[..., PyTree]:
    """A function of stacked arguments, with fast compilation at the expense of run time, since it is called only a few
    times.
    """
    return jax.jit(jax.vmap(function), compiler_options={"xla_backend_optimization_level": 0})


class Balance(NamedTuple):
    """Power through the ports and the three terms of the energy account, in W."""

    ports: Numbers
    supplied: Numbers
    stored: Numbers
    dissipated: Numbers


class OpenEquations:
    """The equations and inner connections of a component, and their derivatives in time.

    A point z of shape [3, variables] contains all variables with their first and second time derivatives. The
    modes, the discrete variables that events change, are separate.
    """

    def __init__(self, component: Component, sizes: float | None = None) -> None:
        self.component = component
        self.flat: FlatModel = flatten(component, split=True)
        self.n: int = self.flat.n_nodes
        self.variables = [leaf for leaf in self.flat.leaves if leaf.declaration.is_variable]
        self.names: list[str] = [self.flat.node_name(node) for node in range(self.n)]
        # The size of each variable: one for all, otherwise its nominal size.
        pieces = [np.full(leaf.count, sizes or nominal_size(leaf)) for leaf in self.variables]
        self.size: np.ndarray = _joined(pieces)
        self._events = events_of(self.flat, ())
        # Any flow may enter an open port; a model of the component alone would set it to zero.
        own = self._own_flows()
        self._flow_sets = [joint for joint in self.flat.flow_sets if len(joint[0]) > 1 or not own.issuperset(joint[0])]

    def _own_flows(self) -> set[int]:
        leaves = [leaf for leaf in self.variables if leaf.declaration.role == "flow" and leaf.path.count(".") == 1]
        return {node for leaf in leaves for node in leaf.nodes}

    def given(self, component: Component) -> tuple[Params, Modes]:
        """The parameters and modes of a component of the same structure."""
        leaves, _ = complete_leaves(component)
        pairs = list(zip(self.flat.own_leaves, leaves, strict=True))
        params = [np.asarray(value, float) for leaf, value in pairs if leaf.declaration.role == "param"]
        modes = [
            np.broadcast_to(leaf.declaration.guess if value is None else value, leaf.stack + leaf.sizes)
            for leaf, value in pairs
            if leaf.declaration.role == "discrete"
        ]
        return params, modes

    def starts(self) -> np.ndarray:
        """The point of the start values with zero derivatives except that of the time."""
        leaves, _ = complete_leaves(self.component)
        x = [
            np.broadcast_to(leaf.declaration.guess if value is None else value, leaf.stack).ravel()
            for leaf, value in zip(self.flat.own_leaves, leaves, strict=True)
            if leaf.declaration.is_variable
        ]
        runs = [np.full(leaf.count, float(leaf.declaration.role == "time")) for leaf in self.variables]
        return np.stack([_joined(x), _joined(runs), np.zeros(self.n)])

    def _leaves(self, x: jax.Array, params: Params, modes: Modes) -> list[jax.Array | np.ndarray]:
        param, mode = iter(params), iter(modes)
        return [
            jnp.reshape(x[leaf.first : leaf.first + leaf.count], leaf.stack) if leaf.declaration.is_variable
            else next(mode if leaf.declaration.role == "discrete" else param)
            for leaf in self.flat.own_leaves
        ]  # fmt: skip

    def _view(self, x: jax.Array, params: Params, modes: Modes) -> Component:
        return self.flat.structure.unflatten(self._leaves(x, params, modes))

    @ft.cached_property
    def rows(self) -> list[str]:
        """The name of the equation of each residual."""
        names: list[str] = []

        def values(x: jax.Array, params: Params, modes: Modes) -> list[jax.Array]:
            found = self._residuals(x, x, params, modes)
            names[:] = found
            return list(found.values())  # jax would sort a dictionary

        shapes = jax.eval_shape(values, np.zeros(self.n), *self.given(self.component))
        return [
            f"{name}[{i}]" if shape.shape else name
            for name, shape in zip(names, shapes, strict=True)
            for i in range(math.prod(shape.shape))
        ]

    def _residuals(self, x: jax.Array, dx: jax.Array, params: Params, modes: Modes) -> dict[str, jax.Array]:
        here, slope = self._view(x, params, modes), self._view(dx, params, modes)
        found = {name: jnp.asarray(value, float) for name, value in _stated(here, slope, "").items()}
        for i, (a, b) in enumerate(self.flat.across):
            found[f"connection {i}"] = x[a] - x[b]
        for i, (nodes, signs) in enumerate(self._flow_sets):
            found[f"flows {i}"] = jnp.dot(np.array(signs, float), x[np.array(nodes)])
        for leaf in self.variables:
            if leaf.declaration.role == "time":
                found[f"{leaf.path} as the time"] = dx[leaf.first : leaf.first + leaf.count] - 1.0
        return found

    def residual(self, x: jax.Array, dx: jax.Array, params: Params, modes: Modes) -> jax.Array:
        """The residuals of the equations; zero at a solution."""
        found = self._residuals(x, dx, params, modes)
        return jnp.concatenate([jnp.zeros(0), *map(jnp.ravel, found.values())])

    @ft.cached_property
    def linearised(self) -> Callable[..., PyTree]:
        """For stacks of points, parameters and modes: the residuals of the equations and of their time derivatives, and
        the Jacobian.
        """

        def both(z: jax.Array, params: Params, modes: Modes) -> tuple[jax.Array, jax.Array]:
            def residuals(z: jax.Array) -> tuple[jax.Array, jax.Array]:
                value = lambda x, dx: self.residual(x, dx, params, modes)  # noqa: E731
                found = jnp.concatenate(jax.jvp(value, (z[0], z[1]), (z[1], z[2])))
                return found, found

            slope, found = jax.jacfwd(residuals, has_aux=True)(z)
            return found, jnp.reshape(slope, (-1, 3 * self.n))

        return quick(both)

    def energy(self, x: jax.Array, params: Params, modes: Modes) -> Energy:
        """The sum of the energy accounts of the component and its parts."""
        found = [account for _, account in accounts(self._view(x, params, modes))]
        sums = [sum(terms) for terms in zip(*found, strict=True)] or [0.0] * 3
        return Energy(*(jnp.asarray(term, float) for term in sums))

    @ft.cached_property
    def balance(self) -> Callable[..., PyTree]:
        """The power balance at stacks of points, parameters and modes."""

        def at(z: jax.Array, params: Params, modes: Modes) -> Balance:
            account = lambda x: self.energy(x, params, modes)  # noqa: E731
            now, rate = jax.jvp(account, (z[0],), (z[1],))
            here, slope = (children(self._view(x, params, modes), "") for x in (z[0], z[1]))
            ports = [(port, d) for (_, port), (_, d) in zip(here, slope, strict=True) if isinstance(port, Port)]
            power = jnp.asarray(sum(port.power(d) for port, d in ports), float)
            return Balance(power, now.supplied, rate.stored, now.dissipated)

        return quick(at)

    @ft.cached_property
    def happens(self) -> Callable[..., PyTree]:
        """For stacks of points: the true conditions of events, the modes after the events that became true, and whether
        the component refuses the point.
        """
        return quick(self._happens)

    def _happens(
        self, x: jax.Array, params: Params, modes: Modes, before: Sequence[jax.Array]
    ) -> tuple[Sequence[jax.Array], Modes, jax.Array]:
        if self._events is None:
            return before, modes, jnp.asarray(False)
        leaves = self._leaves(x, params, modes)
        everything = [*leaves, *(np.zeros(leaf.stack + leaf.sizes) for leaf in self.flat.leaves[len(leaves) :])]
        truths = self._events.hold(everything)
        values = iter(self._events.actions([everything[i] for i in self._events.actions.leaves]))
        new, now, refused, earlier = list(leaves), [], jnp.asarray(False), iter(before)
        for entry, truth in zip(self._entries, truths, strict=False):
            refused |= jnp.any(truth) if entry.kind == "refuse" else False
            now.append(jnp.broadcast_to(truth, entry.stack))
            fires = now[-1] & ~next(earlier)
            for target, value in zip(entry.targets, values, strict=False):
                shape = np.shape(leaves[target])
                fired = jnp.reshape(fires, fires.shape + (1,) * (len(shape) - fires.ndim))
                new[target] = jnp.where(fired, jnp.broadcast_to(value, shape), new[target])
        is_mode = [leaf.declaration.role == "discrete" for leaf in self.flat.own_leaves]
        return now, [value for value, kept in zip(new, is_mode, strict=True) if kept], refused

    @property
    def _entries(self) -> list[EventEntry]:
        """The events of components; those of `ifelse`, which come last, follow from the equations."""
        entries = self._events.entries if self._events is not None else ()
        return [entry for entry in entries if entry.kind != "hold"]

    def quiet(self, k: int) -> list[np.ndarray]:
        """Conditions of events at k points, all false."""
        return [np.zeros((k, *entry.stack), bool) for entry in self._entries]


def _stated(node: Any, d: Any, path: str) -> dict[str, Numbers]:
    """The residuals of the equations of a node and its parts, by path."""
    found: dict[str, Numbers] = {}
    if isinstance(node, Component):
        stated = node.equations(d) | node.shared_equations(d)
        found = {join(path, name): equation.residual for name, equation in stated.items()}
    for (where, part), (_, slope) in zip(children(node, path), children(d, path), strict=True):
        if isinstance(node, Array):
            found |= jax.vmap(lambda one, rate, where=where: _stated(deepened(one, -1), deepened(rate, -1), where))(
                part, slope
            )
        elif isinstance(part, Component):
            found |= _stated(part, slope, where)
    return found


def _joined(pieces: Sequence[np.ndarray]) -> np.ndarray:
    return np.concatenate([np.zeros(0), *pieces])
