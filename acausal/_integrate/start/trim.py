"""Unknown parameters in a search for start values."""

import dataclasses
import math
from collections.abc import Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from ..._declare.component import Component
from ..._declare.node import Leaf, leaves_of
from ..._errors import ModelError, suggestion
from ..._evaluate.groups import ModelParameters
from ..._evaluate.starts import Inputs
from ..._evaluate.system import System
from ..._reduce.incidence import nominal_size
from ..setup.field import RunArgs


@dataclasses.dataclass(frozen=True)
class Trim:
    """Parameters as unknowns p / s after those of the start, scaled by their sizes s (`sizes`)."""

    system: System
    leaves: tuple[int, ...]  # the numbers of the parameters

    @property
    def count(self) -> int:
        """The number of unknowns."""
        return sum(self._counts)

    @property
    def names(self) -> list[str]:
        """The path of the parameter of each unknown."""
        return [
            self.system.flat.leaves[i].path for i, n in zip(self.leaves, self._counts, strict=True) for _ in range(n)
        ]

    @property
    def _counts(self) -> list[int]:
        return [math.prod(self._shape(leaf)) for leaf in self.leaves]

    def _shape(self, leaf: int) -> tuple[int, ...]:
        flat_leaf = self.system.flat.leaves[leaf]
        return flat_leaf.stack + flat_leaf.sizes

    def sizes(self, params: ModelParameters) -> Array:
        """The largest absolute element of each parameter, or its nominal size if that is zero; constants."""
        parts = [jnp.zeros(0)]
        for leaf, count in zip(self.leaves, self._counts, strict=True):
            largest = jnp.max(jnp.abs(jnp.asarray(params.leaves[leaf], float)))
            parts.append(jnp.full(count, jnp.where(largest > 0, largest, nominal_size(self.system.flat.leaves[leaf]))))
        return jax.lax.stop_gradient(jnp.concatenate(parts))

    def unknowns(self, params: ModelParameters, sizes: Array) -> Array:
        """The unknowns, computed from the values of the parameters."""
        parts = [jnp.ravel(jnp.asarray(params.leaves[leaf], float)) for leaf in self.leaves]
        return jnp.concatenate([jnp.zeros(0), *parts]) / sizes

    def own(self, x: Array) -> Array:
        """The unknowns of the start, without the parameters."""
        return x[: len(x) - self.count]

    def values(self, x: Array, sizes: Array) -> dict[int, Array]:
        """The values of the parameters, by number."""
        if not self.leaves:
            return {}
        pieces = jnp.split(x[len(x) - self.count :] * sizes, np.cumsum(self._counts)[:-1])
        return {leaf: piece.reshape(self._shape(leaf)) for leaf, piece in zip(self.leaves, pieces, strict=True)}

    def applied(self, x: Array, sizes: Array, inputs: Inputs) -> Inputs:
        """A copy of the inputs with the parameters from the unknowns."""
        if not self.leaves:
            return inputs
        params = self.system.intake.packed(inputs.params.changed(self.values(x, sizes)))
        return dataclasses.replace(inputs, params=params)

    def run_args(self, x: Array, sizes: Array, args: RunArgs) -> RunArgs:
        """A copy of the numbers of a run with the parameters from the unknowns."""
        return dataclasses.replace(args, inputs=self.applied(x, sizes, args.inputs))


def trimmed_leaves(model: Component, names: Sequence[str]) -> tuple[int, ...]:
    """The numbers of parameters by their paths.

    Raises `ModelError` for a name that is not a parameter of the model.
    """
    known = {leaf.path: (i, leaf) for i, leaf in enumerate(leaves_of(model))}
    return tuple(_parameter(model, name, known) for name in dict.fromkeys(names))


def _parameter(model: Component, name: str, known: dict[str, tuple[int, Leaf]]) -> int:
    if name not in known:
        if _is_static(model, name):
            raise ModelError(f"solve_for: {name} belongs to the structure of the model, which a search cannot change.")
        names = [path for path, (_, leaf) in known.items() if leaf.declaration.role == "param"]
        raise ModelError(f"solve_for: the model has no parameter {name!r}.{suggestion(name, names)}")
    number, leaf = known[name]
    if leaf.declaration.is_variable:
        raise ModelError(f"solve_for: {name} is a variable, not a parameter. To free its start value, use free=[...].")
    if leaf.declaration.role != "param":
        raise ModelError(f"solve_for: {name} is a discrete variable set by events, not a parameter.")
    return number


def _is_static(model: Component, name: str) -> bool:
    node: Any = model
    for part in name.split("."):
        if part not in getattr(node, "__dict__", {}):
            return False
        node = vars(node)[part]
    return True
