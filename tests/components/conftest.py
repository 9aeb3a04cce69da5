"""The energy account of any component at random points that satisfy its equations and their time derivative."""

import dataclasses
import math
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _static_blocks import settled
from jax import Array
from jax.flatten_util import ravel_pytree

from acausal import Component, Energy, Port
from acausal._declare.layout import complete_leaves
from acausal._reduce.flatten import FlatLeaf, FlatModel, flatten
from components.blocks import Signal
from components.electrical import Pin
from components.hydraulic import FluidPort
from components.rotational import Flange as Shaft
from components.thermal import HeatPort
from components.translational import Flange as Rod


class Point(NamedTuple):
    """Values of all variables with their first and second time derivatives."""

    x: Array
    dx: Array
    ddx: Array


class Balance(NamedTuple):
    """Power through the ports and the three terms of the energy account, in W."""

    ports: Array
    supplied: Array
    stored: Array
    dissipated: Array


def power_into(port: Port, d: Port) -> Any:
    """Power that enters through a port, from its variables and their time derivatives."""
    match port, d:
        case Pin(), _:
            return port.v * port.i
        case Shaft(), Shaft():
            return d.phi * port.tau
        case Rod(), Rod():
            return d.s * port.f
        case FluidPort(), _:
            return port.p * port.q
        case HeatPort(), _:
            return port.Q_flow
        case Signal(), _:
            return 0.0
    raise NotImplementedError(f"the power through a {type(port).__name__}")


def parts(model: Component) -> list[Any]:
    """What a component's fields hold, leaves and None aside."""
    held = (getattr(model, field.name) for field in dataclasses.fields(model))
    return [part for part in held if isinstance(part, Component | Port)]


def components(model: Component) -> Iterator[Component]:
    """The model and all components in it."""
    yield model
    for part in parts(model):
        if isinstance(part, Component):
            yield from components(part)


class _Account:
    """A model as residuals of its equations and connections, its own ports left open."""

    def __init__(self, model: Component) -> None:
        self.flat: FlatModel = flatten(model)
        self.leaves: list[Any] = complete_leaves(model)[0]
        flows = [leaf for leaf in self.flat.leaves if leaf.declaration.role == "flow"]
        own = {leaf.first for leaf in flows if leaf.path.count(".") == 1}
        self.flow_sets = [item for item in self.flat.flow_sets if not own.issuperset(item[0][:1]) or len(item[0]) > 1]
        self.times = [leaf.first for leaf in self.flat.leaves if leaf.declaration.role == "time"]
        # An array variable is one node, and takes as many places in a point as it has elements.
        sizes = np.ones(self.flat.n_nodes, dtype=int)
        for leaf in self.flat.leaves:
            if leaf.declaration.role not in ("param", "discrete"):
                sizes[leaf.first] = math.prod(leaf.sizes)
        self.start: list[int] = np.concatenate([[0], np.cumsum(sizes)]).tolist()

    def fill(self, x: Array) -> Any:
        """The model with the variables' values in place; parameters and modes stay, but pieces of laws are those of
        the values.
        """
        return settled(self._filled(x), every=False)

    def _filled(self, x: Array) -> Any:
        filled = [
            self._value(x, leaf) if leaf.declaration.is_variable else leaf.declaration.start if value is None else value
            for leaf, value in zip(self.flat.leaves, self.leaves, strict=True)
        ]
        return jax.tree_util.tree_unflatten(self.flat.structure, filled)

    def _value(self, x: Array, leaf: FlatLeaf) -> Array:
        return jnp.reshape(x[self.start[leaf.first] : self.start[leaf.first + 1]], leaf.sizes)

    def equations(self, x: Array, dx: Array) -> Array:
        here, slope = self.fill(x), self._filled(dx)
        terms: list[Any] = []
        for part, d in zip(components(here), components(slope), strict=True):
            terms.extend(equation.residual for equation in part.equations(d).values())
        at = self.start
        terms.extend(x[at[a]] - x[at[b]] for a, b in self.flat.across)
        terms.extend(sum(s * x[at[n]] for n, s in zip(nodes, signs, strict=True)) for nodes, signs in self.flow_sets)
        terms.extend(dx[at[n]] - 1.0 for n in self.times)
        return jnp.concatenate([jnp.ravel(term) for term in terms])

    def residual(self, point: Point) -> Array:
        value, rate = jax.jvp(self.equations, (point.x, point.dx), (point.dx, point.ddx))
        return jnp.concatenate([value, rate])

    def balance(self, point: Point) -> Balance:
        def accounts(x: Array) -> Energy:
            terms = [part.energy() or Energy() for part in components(self.fill(x))]
            return Energy(*(jnp.asarray(sum(column)) for column in zip(*terms, strict=True)))

        here, slope = self.fill(point.x), self._filled(point.dx)
        pairs = zip(parts(here), parts(slope), strict=True)
        power = sum(power_into(p, d) for p, d in pairs if isinstance(p, Port))
        now, rate = jax.jvp(accounts, (point.x,), (point.dx,))
        return Balance(jnp.asarray(power), now.supplied, rate.stored, now.dissipated)


def _balances(model: Component, seeds: int = 6) -> Balance:
    """The energy account at random points, found by Gauss-Newton steps of least norm from random guesses."""
    account = _Account(model)
    n = account.start[-1]
    guess, unravel = ravel_pytree(Point(*(jnp.zeros(n) for _ in range(3))))
    residual: Callable[[Array], Array] = lambda z: account.residual(unravel(z))  # noqa: E731
    both = jax.jit(jax.vmap(lambda z: (residual(z), jax.jacfwd(residual)(z))))
    points = np.random.default_rng(0).normal(size=(seeds, len(guess)))
    for _ in range(60):
        values, jacobians = (np.asarray(item) for item in both(points))
        if np.max(np.abs(values), initial=0.0) < 1e-12:
            break
        points = points - np.stack([np.linalg.lstsq(j, v)[0] for j, v in zip(jacobians, values, strict=True)])
    np.testing.assert_allclose(both(points)[0], 0.0, atol=1e-10)
    return jax.vmap(lambda z: account.balance(unravel(z)))(points)


@pytest.fixture(scope="session")
def balances() -> Callable[[Component], Balance]:
    return _balances
