"""Fields of a record that one call of a function gives: the call is evaluated once for all of them."""

from collections.abc import Hashable
from typing import Any

from .._syntax import expressions as e
from .evaluate import evaluate
from .scope import Scope
from .terms import Opaque
from .values import Value


class SharedCalls:
    """The results of calls whose fields are values of other expressions."""

    def __init__(self) -> None:
        self._results: dict[Hashable, Value] = {}

    def value(self, x: Any, at: Scope, key: Hashable = ()) -> Value:
        """The value of an expression. `key` identifies the values in the scope."""
        if not isinstance(x, e.FieldOf) or not isinstance(x.base, e.FunctionCall):
            return evaluate(x, at)
        call = (x.base, key)
        if call not in self._results:
            self._results[call] = evaluate(x.base, at)
        found: Any = Opaque("result", self._results[call])
        return evaluate(e.FieldOf(found, x.name), at)
