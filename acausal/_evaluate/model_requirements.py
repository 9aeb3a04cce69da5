"""Checks of the parameters of a model against the requirements of its components."""

import dataclasses
import functools as ft
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from .._declare.component import Component
from .._declare.fields import join
from .._declare.layout import complete_leaves
from .._declare.node import leaves_of
from .._declare.node_requirements import violation
from .._errors import ParameterError
from .._indices import joined
from .._interpret.in_parts import in_parts
from .._reduce.flat_model import FlatModel
from .._reduce.flatten import flatten
from .._reduce.stated import required
from .._tracing import known
from .groups import UNROLLED
from .packing import ModelParameters, SlotValues, discrete_start, slot_values


@dataclasses.dataclass(frozen=True, eq=False)
class ModelRequirements:
    """All requirements of a model, grouped by component class."""

    flat: FlatModel

    @ft.cached_property
    def _groups(self) -> list[tuple[int, Any]]:
        found = [(number, required(holder.kind)) for number, holder in enumerate(self.flat.holders)]
        return [(number, needed) for number, needed in found if needed.texts]

    @ft.cached_property
    def keys(self) -> frozenset[tuple[int, int]]:
        """The parameters that requirements read, by kind and slot."""
        return frozenset((number, slot) for number, needed in self._groups for slot in needed.slots)

    def broken(self, params: ModelParameters) -> list[Array]:
        """For each requirement, whether it is violated. Few like components are evaluated separately, many together."""
        parts: list[Array] = []
        for number, needed in self._groups:
            total, slots = self.flat.holders[number].total, [params.slots[number, slot] for slot in needed.slots]
            if total > UNROLLED:
                holds = jax.vmap(lambda *values, f=needed: jnp.stack(f(*values)), axis_size=total)
                parts.append(~jnp.ravel(holds(*(slot.stacked for slot in slots))))
            else:
                parts += [~jnp.asarray(x) for i in range(total) for x in needed(*(slot.of(i) for slot in slots))]
        return parts

    def enforced(self, params: ModelParameters) -> ModelParameters:
        """The leaves of packed parameters, NaN if a requirement is violated and they are not known.

        Raises `ParameterError` if they are known.
        """
        mask = _broken(self, params.slots)
        numbers = known(mask)
        if numbers is None:
            spoilt = jnp.any(mask)
            return params.changed({i: jnp.where(spoilt, jnp.nan, value) for i, value in params.leaves.items()})
        if numbers.any():
            raise ParameterError(self.violation(int(np.argmax(numbers)), jax.tree.map(jax.lax.stop_gradient, params)))
        return params.changed({})

    @ft.cached_property
    def sentences(self) -> list[str]:
        """The sentence of each requirement, with the path of its component."""
        holders = [(self.flat.holders[number], needed) for number, needed in self._groups]
        return [
            join(holder.name(member), text)
            for holder, needed in holders
            for member in range(holder.total)
            for text in needed.texts
        ]

    def violation(self, index: int, params: ModelParameters) -> str:
        """The sentence of a violated requirement, with the values of its parameters."""
        sentence = self.sentences[index]
        for number, needed in self._groups:
            holder = self.flat.holders[number]
            if index < holder.total * len(needed.texts):
                member, which = divmod(index, len(needed.texts))
                names, units = holder.kind.names, [declaration.unit for declaration in holder.kind.declarations]
                values = [
                    (names[slot], np.asarray(params.slots[number, slot].stacked)[member], units[slot])
                    for slot in needed.quoted[which]
                    if (number, slot) in params.slots
                ]
                return violation(sentence, values)
            index -= holder.total * len(needed.texts)
        raise IndexError(index)


def in_range(model: Component) -> Array:
    """Whether the parameters and start values of a model, traced or not, lie in their declared ranges."""
    given = [leaf for leaf in leaves_of(model) if leaf.value is not None]
    return jnp.all(joined([jnp.asarray(leaf.declaration.admits(leaf.value)) for leaf in given]))


def are_met(model: Component) -> Array:
    """Whether a model, traced or not, meets the requirements of its components and the ranges of its start values."""
    flat = flatten(model)
    numbered = enumerate(zip(flat.leaves, complete_leaves(model)[0], strict=True))
    leaves = {i: discrete_start(leaf, value) for i, (leaf, value) in numbered if not leaf.declaration.is_variable}
    requirements = ModelRequirements(flat)
    slots = {key: slot_values(flat, leaves, *key) for key in requirements.keys}
    return in_range(model) & ~jnp.any(joined(requirements.broken(ModelParameters(slots))))


@ft.partial(in_parts, static_argnums=(0,))
def _broken(requirements: ModelRequirements, slots: dict[tuple[int, int], SlotValues]) -> Array:
    return joined(requirements.broken(ModelParameters(slots)))
