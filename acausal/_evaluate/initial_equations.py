"""The initial equations of a model, as functions of its leaves and their derivatives."""

import dataclasses
import functools as ft
import math
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from .._declare.fields import join
from .._numbers import Numbers
from .._reduce.class_equations import initial_templates
from .._reduce.flat_model import FlatModel, indexed
from .._reduce.jaxpr import as_function
from .._reduce.template import Template


class _Entry(NamedTuple):
    """One initial equation of a component, or of all members of an array of them."""

    template: Template
    path: str
    stack: tuple[int, ...]
    own_leaves: Sequence[int]

    @property
    def leaves(self) -> list[int]:
        return [self.own_leaves[item.slot] for item in self.template.inputs]

    @property
    def names(self) -> list[str]:
        """One name for each element of the residuals."""
        members = [indexed(self.path, self.stack, i) for i in range(math.prod(self.stack))]
        return [join(path, self.template.name) for path in members for _ in range(math.prod(self.template.shape))]


@dataclasses.dataclass(frozen=True, eq=False)
class InitialEquations:
    """All initial equations of a model; those of an array of components are evaluated together."""

    flat: FlatModel

    @ft.cached_property
    def _entries(self) -> list[_Entry]:
        return [
            _Entry(template, *place)
            for starters in self.flat.starters
            for place in zip(starters.paths, starters.stacks, starters.own_leaves, strict=True)
            for template in initial_templates(starters.kind)
        ]

    @ft.cached_property
    def names(self) -> list[str]:
        """The path of each initial equation."""
        return [name for entry in self._entries for name in entry.names]

    @ft.cached_property
    def variables(self) -> frozenset[int]:
        """The variables whose values the equations read."""
        return self._read(0).intersection(self.flat.variable_leaves)

    @ft.cached_property
    def rates(self) -> frozenset[int]:
        """The variables whose derivatives the equations read."""
        return self._read(1)

    def _read(self, order: int) -> frozenset[int]:
        reads = [pair for entry in self._entries for pair in zip(entry.template.inputs, entry.leaves, strict=True)]
        return frozenset(leaf for item, leaf in reads if item.order == order)

    def own(self) -> Iterator[int]:
        """The variables of the components with initial equations, except those in ports, which others share."""
        for starters in self.flat.starters:
            for leaves in starters.own_leaves:
                yield from (
                    leaf
                    for leaf in leaves
                    if self.flat.leaves[leaf].declaration.is_variable and not self.flat.leaves[leaf].in_port
                )

    def residuals(
        self, params: Mapping[int, Numbers], values: Mapping[int, Numbers], rates: Mapping[int, Numbers]
    ) -> Array:
        """The residuals, from parameters and from the values and derivatives of variables, by number."""
        parts = [jnp.zeros(0)]
        for entry in self._entries:
            read = [
                rates[leaf] if item.order else values[leaf] if leaf in values else params[leaf]
                for item, leaf in zip(entry.template.inputs, entry.leaves, strict=True)
            ]
            parts.append(jnp.ravel(_mapped(entry, read)))
        return jnp.concatenate(parts)


def _mapped(entry: _Entry, read: Sequence[Numbers]) -> Array:
    """The residuals of all members."""
    residual, count = as_function(entry.template.jaxpr), math.prod(entry.stack)
    sizes = [aval.shape for aval in entry.template.jaxpr.in_avals]
    members = [
        jnp.reshape(jnp.broadcast_to(jnp.asarray(value, float), (*entry.stack, *size)), (count, *size))
        for value, size in zip(read, sizes, strict=True)
    ]
    return jax.vmap(residual, axis_size=count)(*members)


def initial_equations_of(flat: FlatModel) -> InitialEquations | None:
    """The initial equations of a model; None if there are none."""
    return InitialEquations(flat) if flat.starters else None
