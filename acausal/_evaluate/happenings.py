"""The events of a whole model: their conditions and what they change, as functions of its leaves."""

import dataclasses
import functools as ft
import math
from collections.abc import Iterator, Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.extend.core import ClosedJaxpr, Literal, jaxpr_as_fun

from .._declare.array import Array
from .._declare.component import Component, When
from .._errors import ModelError, suggestion
from .._reduce.connections import children
from .._reduce.flatten import FlatModel, indexed
from .._reduce.jaxpr import assembled, structs
from .._reduce.margins import margins


@dataclasses.dataclass(frozen=True)
class Happening:
    """One event of a component, or of all members of an array of them: `targets` are the leaves that it changes."""

    path: str
    name: str
    stack: tuple[int, ...]
    targets: tuple[int, ...]

    @property
    def count(self) -> int:
        return math.prod(self.stack)

    def label(self, index: int) -> str:
        """The path of one member's event."""
        path = indexed(self.path, self.stack, index)
        return f"{path}.{self.name}" if path else self.name


@dataclasses.dataclass(frozen=True, eq=False)
class Function:
    """A function of some leaves of a model, given by number."""

    closed: ClosedJaxpr
    leaves: tuple[int, ...]

    def __call__(self, values: Sequence[Any]) -> list[Any]:
        return list(jaxpr_as_fun(self.closed)(*values))


@dataclasses.dataclass(frozen=True, eq=False)
class Happenings:
    """`conditions` gives the margins of all events, one array for each of `items`; `actions` the new values, one array
    for each target of each item."""

    items: tuple[Happening, ...]
    conditions: Function
    actions: Function

    @property
    def total(self) -> int:
        return sum(item.count for item in self.items)

    @ft.cached_property
    def labels(self) -> list[str]:
        return [item.label(index) for item in self.items for index in range(item.count)]


def happenings_of(flat: FlatModel) -> Happenings | None:
    """The events of a model; None where it has none.

    Raises `ModelError` for an event that changes what its component does not have, or a parameter.
    """
    items: list[Happening] = []

    def stated(*leaves: Any) -> tuple[list[Any], list[Any]]:
        found = list(_events(flat.structure.unflatten(leaves), ""))
        items[:] = [_item(flat, path, name, event) for path, name, event in found]
        conditions = [jnp.asarray(event.condition) for _, _, event in found]
        values = [jnp.asarray(value, float) for _, _, event in found for value in event.changes.values()]
        return conditions, values

    shapes = [leaf.stack + leaf.sizes for leaf in flat.leaves]
    closed = jax.make_jaxpr(stated)(*structs(shapes))
    if not items:
        return None
    real = jax.make_jaxpr(lambda *leaves: margins(closed, list(leaves)))(*structs(shapes))
    n = len(items)
    return Happenings(tuple(items), _function(real, 0, n), _function(real, n, len(real.jaxpr.outvars)))


def _function(closed: ClosedJaxpr, start: int, stop: int) -> Function:
    """Some outputs of a jaxpr, with what they need."""
    jaxpr = closed.jaxpr
    outputs = jaxpr.outvars[start:stop]
    needed = {atom for atom in outputs if not isinstance(atom, Literal)}
    kept = []
    for eqn in reversed(jaxpr.eqns):
        if any(var in needed for var in eqn.outvars):
            kept.append(eqn)
            needed |= {atom for atom in eqn.invars if not isinstance(atom, Literal)}
    leaves = tuple(i for i, var in enumerate(jaxpr.invars) if var in needed)
    slim = assembled([jaxpr.invars[i] for i in leaves], outputs, kept[::-1], jaxpr.constvars)
    return Function(ClosedJaxpr(slim, closed.consts), leaves)


def _events(view: Any, path: str) -> Iterator[tuple[str, str, When]]:
    """The events of a component and its parts, those of an array of components member by member."""
    if isinstance(view, Component) and type(view).events is not Component.events:
        stated = view.events()
        if not isinstance(stated, dict) or not all(isinstance(event, When) for event in stated.values()):
            raise ModelError(
                f"{type(view).__name__}.events must return a dictionary of events, such as "
                "dict(impact=when(self.h < 0.0, v=-self.e * self.v))."
            )
        yield from ((path, name, event) for name, event in stated.items())
    for part_path, part in children(view, path):
        if isinstance(part, Component) and isinstance(view, Array):
            yield from _stacked(part, part_path)
        elif isinstance(part, Component):
            yield from _events(part, part_path)


def _stacked(item: Any, path: str) -> Iterator[tuple[str, str, When]]:
    names: list[tuple[str, str]] = []

    def members(part: Any) -> list[tuple[Any, dict[str, Any]]]:
        found = list(_events(part, path))
        names[:] = [(where, name) for where, name, _ in found]
        return [(event.condition, event.changes) for _, _, event in found]

    events = jax.vmap(members)(item)
    for (where, name), (condition, changes) in zip(names, events, strict=True):
        yield where, name, When(condition, changes)


def _item(flat: FlatModel, path: str, name: str, event: When) -> Happening:
    places = {leaf.path: index for index, leaf in enumerate(flat.leaves)}
    targets = []
    for target in event.changes:
        full = f"{path}.{target}" if path else target
        if full not in places:
            raise ModelError(f"{path}.events: {name} changes {target}, which does not exist.{suggestion(full, places)}")
        role = flat.leaves[places[full]].declaration.role
        if role in ("param", "time"):
            raise ModelError(
                f"{path}.events: {name} changes {target}, a {role}. Declare what events change with Discrete[...] or "
                "Var[...]."
            )
        targets.append(places[full])
    return Happening(path, name, np.shape(event.condition), tuple(targets))
