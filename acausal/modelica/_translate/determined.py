"""Parameters and start values that others determine."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import jax.numpy as jnp
import numpy as np

from ..._tracing import is_traced
from .evaluate import SharedCalls
from .leaves import ModelLeaf
from .scope import FunctionLibrary, Scope
from .tree import attribute_path
from .values import number


class Determined:
    """Leaves with the terms that determine them, in an order in which they can be evaluated."""

    def __init__(self, functions: FunctionLibrary) -> None:
        self._functions = functions
        self._steps: list[tuple[ModelLeaf, Any, list[str]]] = []

    def add(self, leaf: ModelLeaf, term: Any, reads: Sequence[ModelLeaf]) -> None:
        """The leaf follows others."""
        self._steps.append((leaf, term, [attribute_path(other.path) for other in reads]))

    def add_start(self, leaf: ModelLeaf, term: Any, reads: Sequence[ModelLeaf]) -> None:
        """The start value follows parameters, unless the model has another one."""
        leaf.is_followed = True
        self.add(leaf, term, reads)

    def names(self) -> frozenset[str]:
        """The paths of the parameters."""
        return frozenset(attribute_path(leaf.path) for leaf, _, _ in self._steps if not leaf.is_followed)

    def function(self, places: Mapping[str, int]) -> Callable[[Sequence[Any]], Sequence[Any]] | None:
        """The function of all leaves of the model, by their places, that replaces the determined ones."""
        steps = [
            (places[attribute_path(leaf.path)], leaf.is_followed, term, [places[path] for path in reads])
            for leaf, term, reads in self._steps
        ]

        def determine(leaves: Sequence[Any]) -> Sequence[Any]:
            new = list(leaves)
            calls = SharedCalls()
            for place, is_start, term, reads in steps:
                if not is_start or new[place] is None:
                    values = [_scalar(new[i]) for i in reads]
                    value = calls.value(term, Scope(self._functions, values), tuple(reads))
                    new[place] = jnp.asarray(number(value), float)
            return new

        return determine if steps else None


def _scalar(value: Any) -> Any:
    """A known scalar as a Python number, with which expressions evaluate fast."""
    return value if is_traced(value) or np.ndim(value) else float(value)
