"""The equations of a component with open ports, as residuals at a point."""

import functools as ft
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax.tree_util import PyTreeDef
from jaxtyping import PyTree

from .._declare.array import Array, deepened
from .._declare.component import Component
from .._declare.fields import join
from .._declare.layout import complete, complete_leaves
from .._declare.node import Port
from .._evaluate.event_set import EventEntry
from .._evaluate.events import events_of
from .._integrate.results.energy import accounts
from .._interpret.in_parts import in_parts
from .._made_once import made_once
from .._numbers import Numbers
from .._reduce.flat_model import FlatModel
from .._reduce.flatten import children, flatten
from .._reduce.incidence import nominal_size

Params = Sequence[jax.Array | np.ndarray]  # in the order of the leaves of a component, like the modes
Modes = Sequence[jax.Array | np.ndarray]

TERMS = ("stored energy", "dissipated power", "supplied power", "power through the ports")
BLOCK = 256  # size of a stack: the derivatives along all directions at 8 points of a component with 10 variables


def stacked(function: Callable[..., PyTree]) -> Callable[..., PyTree]:
    """A function of stacks of arguments. It is traced once, for stacks of one size, and interpreted, since it is called
    only a few times.
    """
    program = in_parts(function)

    def call(*arguments: PyTree) -> PyTree:
        leaves, structure = jax.tree.flatten(arguments)
        count, found = len(leaves[0]), []
        for first in range(0, max(count, 1), BLOCK):
            block = [leaf[first : first + BLOCK] for leaf in map(np.asarray, leaves)]
            found.append(program(*structure.unflatten(np.resize(x, (BLOCK, *x.shape[1:])) for x in block)))
        return jax.tree.map(lambda *parts: np.concatenate(parts)[:count], *found)

    return call


class Balance(NamedTuple):
    """The terms of the power balance at each point, in W."""

    ports: np.ndarray
    supplied: np.ndarray
    stored: np.ndarray
    dissipated: np.ndarray


class OpenEquations:
    """The equations and inner connections of components of one structure, and their derivatives in time.

    A point z of shape [3, variables] contains all variables with their first and second time derivatives. The
    modes, the discrete variables that events change, are separate. Functions take stacks of them all.
    """

    def __init__(self, component: Component) -> None:
        self.flat: FlatModel = flatten(component, split=True)
        self.n: int = self.flat.n_nodes
        self.variables = [leaf for leaf in self.flat.leaves if leaf.declaration.is_variable]
        self.names: list[str] = [self.flat.node_name(node) for node in range(self.n)]
        self._events = events_of(self.flat, ())
        # Any flow may enter an open port; a model of the component alone would set it to zero.
        own = self._own_flows()
        self._flow_sets = [joint for joint in self.flat.flow_sets if len(joint[0]) > 1 or not own.issuperset(joint[0])]
        self._rows: list[str] = []

    def _own_flows(self) -> set[int]:
        leaves = [leaf for leaf in self.variables if leaf.declaration.role == "flow" and leaf.path.count(".") == 1]
        return {node for leaf in leaves for node in leaf.nodes}

    def _leaves(self, x: jax.Array, params: Params, modes: Modes) -> list[jax.Array | np.ndarray]:
        own, param, mode = iter(jax.lax.split(x, [leaf.count for leaf in self.variables])), iter(params), iter(modes)
        return [
            jnp.reshape(next(own), leaf.stack) if leaf.declaration.is_variable
            else next(mode if leaf.declaration.role == "discrete" else param)
            for leaf in self.flat.own_leaves
        ]  # fmt: skip

    def _view(self, x: jax.Array, params: Params, modes: Modes) -> Component:
        return self.flat.structure.unflatten(self._leaves(x, params, modes))

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

    @ft.cached_property
    def residual(self) -> Callable[[jax.Array, jax.Array, Params, Modes], jax.Array]:
        """The residuals of the equations, zero at a solution."""

        def values(x: jax.Array, dx: jax.Array, params: Params, modes: Modes) -> jax.Array:
            found = self._residuals(x, dx, params, modes)
            self._rows = [
                f"{name}[{i}]" if value.shape else name for name, value in found.items() for i in range(value.size)
            ]
            return jnp.concatenate([jnp.zeros(0), *map(jnp.ravel, found.values())])

        return jax.jit(jax.vmap(values))  # traced once for all derivatives

    @property
    def rows(self) -> list[str]:
        """The name of the equation of each residual, and those of the power balance, once they are traced."""
        return [*self._rows, *TERMS]

    @ft.cached_property
    def _tangent(self) -> Callable[..., PyTree]:
        """The residuals of the equations and of their time derivatives, and their derivatives along a direction."""

        def along(z: jax.Array, way: jax.Array, params: Params, modes: Modes) -> tuple[jax.Array, jax.Array]:
            def both(z: jax.Array) -> jax.Array:
                value = lambda x, dx: self.residual(x, dx, params, modes)  # noqa: E731
                return jnp.concatenate(jax.jvp(value, (z[:, 0], z[:, 1]), (z[:, 1], z[:, 2])), axis=1)

            return jax.jvp(both, (z,), (way,))

        return stacked(along)

    def linearised(self, z: np.ndarray, params: Params, modes: Modes) -> tuple[np.ndarray, np.ndarray]:
        """The residuals of the equations and of their time derivatives, and the Jacobian."""
        k, m = len(z), 3 * self.n
        each = lambda value: np.repeat(value, m, axis=0)  # noqa: E731
        ways = np.tile(np.reshape(np.eye(m), (m, 3, self.n)), (k, 1, 1))
        value, slope = self._tangent(each(z), ways, list(map(each, params)), list(map(each, modes)))
        return value[::m], np.swapaxes(np.reshape(slope, (k, m, -1)), 1, 2)

    def _terms(self, x: jax.Array, dx: jax.Array, params: Params, modes: Modes) -> jax.Array:
        here, slope = self._view(x, params, modes), self._view(dx, params, modes)
        found = [account for _, account in accounts(here)]
        sums = [sum(terms) for terms in zip(*found, strict=True)] or [0.0] * 3
        ports = zip(children(here, ""), children(slope, ""), strict=True)
        power = sum(port.power(d) for (_, port), (_, d) in ports if isinstance(port, Port))
        return jnp.stack([jnp.asarray(term, float) for term in (*sums, power)])

    @ft.cached_property
    def _laws(self) -> Callable[[jax.Array, Params, Modes], jax.Array]:
        """The residuals, and the terms of the power balance."""

        def values(z: jax.Array, params: Params, modes: Modes) -> jax.Array:
            at = z[:, 0], z[:, 1], params, modes
            return jnp.concatenate([self.residual(*at), jax.vmap(self._terms)(*at)], axis=1)

        return jax.jit(values)

    @ft.cached_property
    def forward(self) -> Callable[..., PyTree]:
        """The laws and their derivatives along a direction of the point and of the parameters, in forward mode."""

        def along(z: jax.Array, params: Params, modes: Modes, z_way: jax.Array, p_way: Params) -> PyTree:
            return jax.jvp(lambda z, params: self._laws(z, params, modes), (z, params), (z_way, p_way))

        return stacked(along)

    @ft.cached_property
    def reverse(self) -> Callable[..., PyTree]:
        """The derivatives of a weighted sum of the laws by the point and the parameters, in reverse mode."""

        def slopes(z: jax.Array, params: Params, modes: Modes, weight: jax.Array) -> PyTree:
            return jax.vjp(lambda z, params: self._laws(z, params, modes), z, params)[1](weight)

        return stacked(slopes)

    def balance(self, z: np.ndarray, params: Params, modes: Modes) -> Balance:
        """The power balance."""
        way = np.concatenate([z[:, 1:], np.zeros_like(z[:, :1])], axis=1)
        now, rate = self.forward(z, params, modes, way, [np.zeros(np.shape(value)) for value in params])
        return Balance(now[:, -1], now[:, -2], rate[:, -4], now[:, -3])

    def happens(
        self, x: np.ndarray, params: Params, modes: Modes, before: Sequence[np.ndarray]
    ) -> tuple[Sequence[np.ndarray], Modes, np.ndarray]:
        """The true conditions of events, the modes after the events that became true, and whether the component refuses
        the point.
        """
        if self._events is None:
            return before, modes, np.zeros(len(x), bool)
        return self._after_events(x, params, modes, before)

    @ft.cached_property
    def _after_events(self) -> Callable[..., PyTree]:
        return stacked(jax.vmap(self._happens))

    def _happens(
        self, x: jax.Array, params: Params, modes: Modes, before: Sequence[jax.Array]
    ) -> tuple[Sequence[jax.Array], Modes, jax.Array]:
        assert self._events is not None
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


@made_once(maxsize=256)
def _equations(structure: PyTreeDef, shapes: tuple[tuple[int, ...], ...]) -> OpenEquations:
    return OpenEquations(structure.unflatten([jax.ShapeDtypeStruct(shape, float) for shape in shapes]))


class Opened:
    """A component with open ports: its equations, which all components of its structure share, and its numbers."""

    def __init__(self, component: Component, sizes: float | None = None) -> None:
        leaves, structure = jax.tree_util.tree_flatten(complete(component))
        self.component = component
        self.equations = _equations(structure, tuple(map(np.shape, leaves)))
        # The size of each variable: one for all, otherwise its nominal size.
        pieces = [np.full(leaf.count, sizes or nominal_size(leaf)) for leaf in self.equations.variables]
        self.size: np.ndarray = _joined(pieces)

    def given(self, component: Component) -> tuple[Params, Modes]:
        """The parameters and modes of a component of the same structure."""
        leaves, _ = complete_leaves(component)
        pairs = list(zip(self.equations.flat.own_leaves, leaves, strict=True))
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
            for leaf, value in zip(self.equations.flat.own_leaves, leaves, strict=True)
            if leaf.declaration.is_variable
        ]
        runs = [np.full(leaf.count, float(leaf.declaration.role == "time")) for leaf in self.equations.variables]
        return np.stack([_joined(x), _joined(runs), np.zeros(self.equations.n)])


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
