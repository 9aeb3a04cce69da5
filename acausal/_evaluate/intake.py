"""Conversion of the numbers of a model to inputs of its compiled functions, and checks of its parameters."""

import dataclasses
import functools as ft
import itertools
from collections.abc import Iterable, Sequence
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
from .._numbers import Numbers
from .._reduce.class_equations import required
from .._reduce.flat_model import FlatLeaf, FlatModel
from .._reduce.flatten import flatten
from .._tracing import known
from .groups import UNROLLED, ModelParameters, SlotValues, discrete_start, slot_values
from .starts import Inputs, Starts


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


LARGE = 300  # number of leaves above which parameters are packed before a compiled run


@dataclasses.dataclass(frozen=True, eq=False)
class Intake:
    """Sorts the leaves of a model into parameters and start values, and checks them.

    `used` are the parameters that the compiled functions read, by component kind and slot.
    """

    flat: FlatModel
    starts: Starts
    requirements: ModelRequirements
    used: tuple[tuple[int, int], ...]

    def inputs(self, model: Component) -> Inputs:
        """The inputs of the compiled functions, from a model. Those of a large one hold no leaves: thousands of
        arguments would slow each call down.
        """
        found = self.inputs_of(complete_leaves(model)[0])
        is_large = len(self.flat.leaves) > LARGE
        return dataclasses.replace(found, params=ModelParameters(found.params.slots)) if is_large else found

    def inputs_of(self, leaves: Sequence[Numbers | None]) -> Inputs:
        """The inputs from the leaves of a model; None for a missing start value."""
        return Inputs(self.packed(self.parameters(leaves)), self.starts.pack(leaves), self.given(leaves))

    def parameters(self, leaves: Sequence[Numbers | None]) -> ModelParameters:
        """The parameters among the leaves of a model, unpacked, with discrete variables at the start."""
        held = [None] * (len(self.flat.leaves) - len(leaves))
        numbered = enumerate(zip(self.flat.leaves, [*leaves, *held], strict=True))
        found = {i: discrete_start(leaf, value) for i, (leaf, value) in numbered if not leaf.declaration.is_variable}
        return ModelParameters(leaves={i: _strong(value) for i, value in found.items()})

    def packed(self, params: ModelParameters) -> ModelParameters:
        """The parameters packed in slots, as the equations read them."""
        if params.slots:
            return params
        return ModelParameters({key: slot_values(self.flat, params.leaves, *key) for key in self.used}, params.leaves)

    def handed(self, params: ModelParameters, read: Iterable[int]) -> ModelParameters:
        """The parameters as arguments of a compiled run.

        For a small model, these are its leaves, so that derivatives are only along those that vary. For a large one,
        they are slots, since thousands of arguments would slow XLA down, and the leaves that functions `read` one by
        one.
        """
        if len(self.flat.leaves) <= LARGE:
            return params
        leaves = {i: params.leaves[i] for i in sorted(set(read)) if i in params.leaves}
        return ModelParameters(self.packed(params).slots, leaves)

    def complete(self, inputs: Inputs) -> Inputs:
        """The arguments of a compiled run, converted for the equations."""
        return dataclasses.replace(
            inputs, params=self.packed(inputs.params), starts=self.starts.whole(inputs), apart={}
        )

    def given(self, leaves: Sequence[Numbers | None]) -> frozenset[int]:
        """The variable leaves with a start value in the model."""
        return frozenset(i for i in self.flat.variable_leaves if leaves[i] is not None)

    def enforced(self, params: ModelParameters) -> ModelParameters:
        """The parameters after a check of all requirements.

        Raises `ParameterError` if a known parameter violates one. Parameters that are not known become NaN.
        """
        return self.requirements.enforced(self.packed(params))

    def check(self, leaves: Sequence[Numbers | None]) -> None:
        """Raise `ParameterError` for known inadmissible parameters or start values of a model."""
        self.enforced(self.parameters(leaves))
        for index in sorted(self.given(leaves)):
            leaf, start = self.flat.leaves[index], known(jnp.asarray(leaves[index], float))
            if start is not None and not np.all(leaf.declaration.admits(start)):
                raise ParameterError(_bad_start(leaf, start))

    def bad_values(self, inputs: Inputs) -> list[Array]:
        """For each requirement, and each given start value, whether it is violated."""
        checks = self.requirements.broken(inputs.params)
        for leaves in self._checked(inputs.given):
            declaration = self.flat.leaves[leaves[0]].declaration
            if len(leaves) > 1:
                checks.append(~declaration.admits(self.starts.of_scalars(inputs, leaves)))
            else:
                checks.append(~jnp.all(declaration.admits(self.starts.of_leaf(inputs, leaves[0]))))
        return checks

    def needed(self, given: frozenset[int]) -> list[str]:
        """The condition of each of `bad_values` as a sentence."""
        leaves = itertools.chain.from_iterable(self._checked(given))
        return self.requirements.sentences + [_needed(self.flat.leaves[index]) for index in leaves]

    def bad_value(self, index: int, inputs: Inputs) -> str:
        """A sentence for one of `bad_values`, with the numbers."""
        count = len(self.requirements.sentences)
        if index < count:
            return self.requirements.violation(index, inputs.params)
        leaf = list(itertools.chain.from_iterable(self._checked(inputs.given)))[index - count]
        return _bad_start(self.flat.leaves[leaf], np.asarray(self.starts.of_leaf(inputs, leaf)))

    def _checked(self, given: frozenset[int]) -> list[list[int]]:
        """Given start values that are checked together: scalars with one range, if they are many."""
        alike: dict[object, list[int]] = {}
        for index in sorted(given):
            leaf = self.flat.leaves[index]
            alike.setdefault(index if leaf.stack or leaf.sizes else leaf.declaration.range, []).append(index)
        parts = [[own] if len(own) > UNROLLED else [[index] for index in own] for own in alike.values()]
        return list(itertools.chain.from_iterable(parts))


def _strong(value: Numbers) -> Numbers:
    """A Python float, which jax would compile for separately, as an array."""
    return np.asarray(value) if isinstance(value, float) else value


def _needed(leaf: FlatLeaf) -> str:
    return f"{leaf.path} must be {leaf.declaration.range}"


def _bad_start(leaf: FlatLeaf, start: np.ndarray) -> str:
    return f"{_needed(leaf)}, but starts from {start if start.size > 1 else start.ravel()[0]} {leaf.declaration.unit}."
