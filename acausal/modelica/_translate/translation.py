"""The state of a translation: the flat model, and what is found in it."""

import dataclasses
from collections.abc import Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from .._syntax.flat import FlatEquation, FlatModelica
from .clocks import Clocked, without_clocks
from .connectors import Connectors
from .determined import Determined
from .discrete_starts import with_starts
from .evaluate import SharedCalls, evaluate
from .known import KnownValues
from .leaves import ModelLeaf
from .record_targets import without_record_targets
from .resolve import Resolver
from .scope import Scope
from .semilinear import without_chains
from .slots import Previous, Slots
from .tree import attribute_path
from .values import Value, number, plain
from .whens import Lowered, Lowering

INITIAL = "initial_"


@dataclasses.dataclass
class Translation:
    """A flat model without clocks and when-clauses, with the leaves that replace its variables.

    `leaves` are by Modelica name, `previous` are those that hold previous values.
    """

    flat: FlatModelica
    clocked: Clocked
    lowered: Lowered
    known: KnownValues
    leaves: dict[str, ModelLeaf]
    previous: Previous
    resolver: Resolver
    equations: list[FlatEquation]
    determined: Determined
    connectors: Connectors
    calls: SharedCalls = dataclasses.field(default_factory=SharedCalls)

    @classmethod
    def of(cls, flat: FlatModelica) -> "Translation":
        flat, clocked = without_clocks(without_record_targets(flat))
        lowered = Lowering(flat).lower()
        variables = with_starts({**flat.variables, **lowered.variables}, lowered.initial, lowered.equations)
        flat = dataclasses.replace(flat, variables=variables)
        known = KnownValues(flat)
        leaves: dict[str, ModelLeaf] = {}
        previous = Previous(leaves)
        resolver = Resolver(known, leaves, previous)
        connectors = Connectors.of(flat, known.tree)
        equations = [
            q
            for q in without_chains(lowered.equations, variables)
            if q.origin != "open flow" or not connectors.closes(q.residual)
        ]
        return cls(
            flat, clocked, lowered, known, leaves, previous, resolver, equations, Determined(known.library), connectors
        )

    def term(self, x: Any) -> tuple[Any, list[ModelLeaf]]:
        """The term of an expression, and the leaves of its slots."""
        slots = Slots()
        return self.resolver.term(x, slots), slots.leaves

    def value(self, term: Any, leaves: Sequence[ModelLeaf]) -> Value:
        """The value of a term, where truths are numbers, for the values of the leaves of its slots."""
        known = [plain(np.asarray(leaf.value)) for leaf in leaves]
        key = tuple(leaf.path for leaf in leaves)
        return number(self.calls.value(term, Scope(self.known.library, known), key))

    def shape(self, x: Any) -> tuple[int, ...]:
        """The shape of an expression of variables and parameters."""
        term, reads = self.term(x)
        values = [jax.ShapeDtypeStruct(leaf.dims, float) for leaf in reads]
        scope = self.known.library
        return jax.eval_shape(lambda *found: jnp.asarray(evaluate(term, Scope(scope, found))), *values).shape

    def path(self, name: str) -> str:
        """The path of the leaf of a variable."""
        return attribute_path(self.leaves[name].path if name in self.leaves else name)

    def all_leaves(self) -> list[ModelLeaf]:
        return [*self.leaves.values(), *self.previous.of.values()]


def as_leaf(value: Value) -> Any:
    """A value as the number of a leaf."""
    return jnp.asarray(np.asarray(value, float))
