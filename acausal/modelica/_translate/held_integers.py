"""Events of `floor`, `ceil`, `integer`, `div`, `mod` and `rem` (Modelica 3.6, section 3.7.2).

The integer k = floor(x) of a continuous x is a variable of its own, which changes only at events: it obeys
k = if x >= pre(k) + 1 or x < pre(k) then floor(x) else pre(k). The other functions follow from `floor`.
"""

import dataclasses
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp

from ..._errors import ModelError
from .._syntax import expressions as e
from .._syntax.flat import Algorithm, FlatEquation
from .._syntax.visits import mapped
from .evaluate import evaluate
from .leaves import ModelLeaf
from .scope import NotKnown, Scope
from .terms import only_discrete, reads_rates
from .translation import Translation

Floor = Callable[[Any], Any]  # the expression that takes the place of floor(x)


def _truncated(floor: Floor, x: Any) -> Any:
    zero = e.Const(0.0)
    above, below = (e.Builtin("Max", (part, zero)) for part in (x, e.Unary("Minus", x)))
    return e.Binary("Sub", floor(above), floor(below))


def _remaining(x: Any, y: Any, quotient: Any) -> Any:
    return e.Binary("Sub", x, e.Binary("MulElem", quotient, y))


def _quotient(x: Any, y: Any) -> Any:
    return e.Binary("DivElem", x, y)


_BY_FLOOR: dict[str, Callable[..., Any]] = {
    "Floor": lambda floor, x: floor(x),
    "Integer": lambda floor, x: floor(x),
    "Ceil": lambda floor, x: e.Unary("Minus", floor(e.Unary("Minus", x))),
    "Div": lambda floor, x, y: _truncated(floor, _quotient(x, y)),
    "Mod": lambda floor, x, y: _remaining(x, y, floor(_quotient(x, y))),
    "Rem": lambda floor, x, y: _remaining(x, y, _truncated(floor, _quotient(x, y))),
}


def hold_integers(model: Translation) -> None:
    """Replace the functions by variables in the equations and algorithms of a model, whose leaves exist."""
    held = _HeldIntegers(model)
    model.equations[:] = [dataclasses.replace(q, residual=held.in_equation(q.residual)) for q in model.equations]
    model.equations += held.equations
    model.lowered.algorithms[:] = map(held.in_algorithm, model.lowered.algorithms)


class _HeldIntegers:
    def __init__(self, model: Translation) -> None:
        self._model = model
        self._names: dict[Any, str] = {}
        self.equations: list[FlatEquation] = []

    def in_equation(self, x: Any) -> Any:
        return self._in(x, self._by_equation)

    def in_algorithm(self, algorithm: Algorithm) -> Algorithm:
        added: list[str] = []
        body = self._body(algorithm.body, added)
        return dataclasses.replace(algorithm, body=body, outputs=(*algorithm.outputs, *added))

    def _body(self, body: e.Body, added: list[str]) -> e.Body:
        """Statements, each after those that set its integers. The integers of a loop have no events."""
        found: list[e.Statement] = []
        for statement in body:
            before: list[e.Statement] = []

            def floor(x: Any, before: list[e.Statement] = before) -> Any:
                name = self._variable(x)
                added.append(name)
                before.append(e.Assign((e.Target(name),), _value(name, x)))
                return e.Ref(name)

            match statement:
                case e.Assign():
                    new: e.Statement = dataclasses.replace(statement, value=self._in(statement.value, floor))
                case e.IfStatement():
                    blocks = tuple((self._in(c, floor), self._body(b, added)) for c, b in statement.blocks)
                    new = e.IfStatement(blocks, self._body(statement.otherwise, added))
                case _:
                    new = statement
            found += [*before, new]
        return tuple(found)

    def _in(self, x: Any, floor: Floor) -> Any:
        match x:
            case e.Builtin("NoEvent" | "Pre" | "Der" | "Size", _) | e.Comprehension():
                return x
            case e.Builtin("Smooth", (order, _)) if order != e.Const(0):
                return x
        x = mapped(x, lambda part: self._in(part, floor))
        if isinstance(x, e.Builtin) and x.name in _BY_FLOOR and self._is_continuous(x):
            return _BY_FLOOR[x.name](floor, *x.args)
        return x

    def _is_continuous(self, x: Any) -> bool:
        """Whether a value changes between events. That of a name of a loop is not known."""
        try:
            term, _ = self._model.term(x)
        except (NotKnown, ModelError):  # an error occurs again where the value is needed
            return False
        return not only_discrete(term) and not reads_rates(term)

    def _by_equation(self, x: Any) -> Any:
        if x not in self._names:
            name = self._names[x] = self._variable(x)
            self.equations.append(FlatEquation(e.Binary("Sub", e.Ref(name), _value(name, x)), "", "when", None))
        return e.Ref(self._names[x])

    def _variable(self, x: Any) -> str:
        leaves = self._model.leaves
        number = 1
        while (name := f"floor_{number}") in leaves:
            number += 1
        leaves[name] = ModelLeaf(name, "var", "integer", self._shape(x), is_discrete=True)
        return name

    def _shape(self, x: Any) -> tuple[int, ...]:
        term, reads = self._model.term(x)
        library = self._model.known.library
        values = [jax.ShapeDtypeStruct(leaf.dims, float) for leaf in reads]
        return jax.eval_shape(lambda *found: jnp.asarray(evaluate(term, Scope(library, found))), *values).shape


def _value(name: str, x: Any) -> Any:
    return e.Builtin("HeldFloor", (x, e.Builtin("Pre", (e.Ref(name),))))
