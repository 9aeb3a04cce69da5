"""Operators that become variables of their own, with equations: derivatives inside of derivatives, `delay`, and the
integers of `floor`, `ceil`, `integer`, `div`, `mod` and `rem`, which change at events (Modelica 3.6, sections 3.7.2 and
3.7.4.1).
"""

import dataclasses
from collections.abc import Callable
from typing import Any, NamedTuple

import jax.numpy as jnp

from ..._declare.history import ROW
from ..._errors import ModelError
from .._syntax import expressions as e
from .._syntax.flat import Algorithm, FlatEquation, SourcePlace, equality
from .._syntax.visits import mapped
from .leaves import ModelLeaf
from .scope import NotKnown
from .terms import only_discrete, reads_rates
from .translation import Translation

STEPS = 128  # number of steps that a history holds


class _NewVariables:
    """Variables that take the places of expressions, with their equations."""

    def __init__(self, model: Translation) -> None:
        self.model = model
        self.names: dict[Any, str] = {}
        self.equations: list[FlatEquation] = []

    def ref(self, x: Any, make: Callable[[], str]) -> e.Ref:
        """The variable in the place of an expression, which is made when the expression first occurs."""
        if x not in self.names:
            self.names[x] = make()
        return e.Ref(self.names[x])

    def variable(self, word: str, dims: tuple[int, ...] = (), kind: str = "real") -> str:
        """The name of a new variable."""
        leaves, number = self.model.leaves, 1
        while (name := f"{word}_{number}") in leaves:
            number += 1
        leaves[name] = ModelLeaf(name, "var", kind, dims, is_discrete=kind == "integer")
        return name

    def equate(self, left: Any, right: Any, origin: str, at: tuple[str, SourcePlace | None] = ("", None)) -> None:
        self.equations.append(equality(left, right, origin, *at))


# Derivatives of derivatives: in der(der(x)), the inner derivative is a variable.


def name_rates(model: Translation) -> None:
    """Replace derivatives inside of derivatives by variables, in a model whose leaves exist."""
    new, lowered = _NewVariables(model), model.lowered

    def variable(x: e.Builtin) -> str:
        name = new.variable("rate", model.shape(x.args[0]))
        new.equate(e.Ref(name), x, "rate")
        return name

    def named(x: Any) -> Any:
        is_rate = isinstance(x, e.Builtin) and x.name == "Der"
        return new.ref(x, lambda: variable(x)) if is_rate else mapped(x, named)

    def change(x: Any) -> Any:
        x = mapped(x, change)
        is_second = isinstance(x, e.Builtin) and x.name == "Der" and any(map(reads_rates, x.args))
        return mapped(x, named) if is_second else x

    for parts in (
        model.equations, lowered.initial_equations, lowered.algorithms, lowered.resets, lowered.demands,
    ):  # fmt: skip
        parts[:] = [change(part) for part in parts]
    model.equations += new.equations


# `delay(x, T)`: x a fixed time T ago; until T has passed, x at the start.


class Delay(NamedTuple):
    """The name of the leaf of a history, and the terms of its signal and its delay."""

    past: str
    signal: Any
    delay: Any


def make_delays(model: Translation) -> list[Delay]:
    """Replace the delays in the equations of a model by variables. Returns their histories.

    A delay y obeys y = recall(past, since, before), since = time - T and der(before) = 0, with before = x at the start.
    """
    new, found = _NewVariables(model), list[Delay]()

    def is_fixed(x: e.Builtin) -> bool:
        """Whether a delay depends on parameters only, and the signal on variables of the model."""
        try:
            _, (_, reads) = (model.term(arg) for arg in x.args[:2])
        except (NotKnown, ModelError):  # reported where the value is needed
            return False
        return all(leaf.role == "param" for leaf in reads)

    def variable(signal: Any, delay: Any, component: str, place: SourcePlace | None) -> str:
        name = new.variable("delay")
        since, before, past = (f"{name}_{part}" for part in ("since", "before", "past"))
        for own in (since, before):
            model.leaves[own] = ModelLeaf(own, "var")
        history = jnp.full((STEPS, ROW), -jnp.inf)
        model.leaves[past] = ModelLeaf(past, "discrete", dims=history.shape, is_discrete=True, value=history)
        read = e.Builtin("Recall", (e.Ref(past), e.Ref(since), e.Ref(before)))
        for left, right in (
            (e.Ref(name), read),
            (e.Ref(since), e.Binary("Sub", e.Ref("time"), delay)),
            (e.Builtin("Der", (e.Ref(before),)), e.Const(0.0)),
        ):
            new.equate(left, right, "delay", (component, place))
        start = e.Unary("Minus", e.Binary("Sub", signal, e.Ref(before)))
        model.lowered.initial_equations.append(FlatEquation(start, component, "delay", place))
        found.append(Delay(past, signal, delay))
        return name

    def change(x: Any, component: str = "", place: SourcePlace | None = None) -> Any:
        x = mapped(x, lambda part: change(part, component, place))
        if not isinstance(x, e.Builtin) or x.name != "Delay" or not is_fixed(x):
            return x  # refused by name where it is evaluated
        return new.ref(x, lambda: variable(x.args[0], x.args[1], component, place))

    model.equations[:] = [change(q, q.component, q.place) for q in model.equations]
    for parts in (model.lowered.resets, model.lowered.demands):
        parts[:] = [change(part) for part in parts]
    model.equations += new.equations
    return found


# Integers: k = floor(x) of a continuous x obeys k = if x >= pre(k) + 1 or x < pre(k) then floor(x) else pre(k). The
# other functions follow from `floor`.

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
    model.equations[:] = [held.changed(equation, held.by_equation) for equation in model.equations]
    model.equations += held.equations
    model.lowered.algorithms[:] = map(held.in_algorithm, model.lowered.algorithms)


class _HeldIntegers(_NewVariables):
    def by_equation(self, x: Any) -> Any:
        return self.ref(x, lambda: self._equated(x))

    def _equated(self, x: Any) -> str:
        name = self._variable(x)
        self.equate(e.Ref(name), _value(name, x), "when")
        return name

    def _variable(self, x: Any) -> str:
        return self.variable("floor", self.model.shape(x), "integer")

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
                    new: e.Statement = dataclasses.replace(statement, value=self.changed(statement.value, floor))
                case e.IfStatement():
                    blocks = tuple((self.changed(c, floor), self._body(b, added)) for c, b in statement.blocks)
                    new = e.IfStatement(blocks, self._body(statement.otherwise, added))
                case _:
                    new = statement
            found += [*before, new]
        return tuple(found)

    def changed(self, x: Any, floor: Floor) -> Any:
        """An expression or equation with the functions replaced."""
        match x:
            case e.Builtin("NoEvent" | "Pre" | "Der" | "Size", _) | e.Comprehension():
                return x
            case e.Builtin("Smooth", (order, _)) if order != e.Const(0):
                return x
        x = mapped(x, lambda part: self.changed(part, floor))
        if isinstance(x, e.Builtin) and x.name in _BY_FLOOR and self._is_continuous(x):
            return _BY_FLOOR[x.name](floor, *x.args)
        return x

    def _is_continuous(self, x: Any) -> bool:
        """Whether a value changes between events. That of a name of a loop is not known."""
        try:
            term, _ = self.model.term(x)
        except (NotKnown, ModelError):  # an error occurs again where the value is needed
            return False
        return not only_discrete(term) and not reads_rates(term)


def _value(name: str, x: Any) -> Any:
    return e.Builtin("HeldFloor", (x, e.Builtin("Pre", (e.Ref(name),))))
