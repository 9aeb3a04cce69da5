"""Conversion of the numbers of a model to inputs of its compiled functions."""

import dataclasses
import itertools
from collections.abc import Iterable, Sequence

import jax.numpy as jnp
import numpy as np
from jax import Array

from .._declare.component import Component
from .._declare.layout import complete_leaves
from .._errors import ParameterError
from .._numbers import Numbers
from .._reduce.flat_model import FlatLeaf, FlatModel
from .._tracing import known
from .groups import UNROLLED
from .model_requirements import ModelRequirements
from .packing import ModelParameters, discrete_start, slot_values
from .starts import Inputs, Starts

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
