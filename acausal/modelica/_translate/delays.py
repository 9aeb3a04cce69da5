"""`delay(x, T)` (Modelica 3.6, section 3.7.4.1): x a fixed time T ago; until T has passed, x at the start."""

import dataclasses
from typing import Any, NamedTuple

import jax.numpy as jnp

from ..._declare.history import ROW
from ..._errors import ModelError
from .._syntax import expressions as e
from .._syntax.flat import FlatEquation
from .._syntax.visits import mapped
from .leaves import ModelLeaf
from .scope import NotKnown
from .translation import Translation

STEPS = 128  # number of steps that a history holds


class Delay(NamedTuple):
    """The name of the leaf of a history, and the terms of its signal and its delay."""

    past: str
    signal: Any
    delay: Any


def make_delays(model: Translation) -> list[Delay]:
    """Replace the delays in the equations of a model by variables. Returns their histories.

    A delay y obeys y = recall(past, since, before), since = time - T and der(before) = 0, with before = x at the start.
    """
    made = _Delays(model)
    model.equations[:] = [made.in_equation(q) for q in model.equations]
    for parts in (model.lowered.resets, model.lowered.demands):
        parts[:] = [made.in_event(part) for part in parts]
    model.equations += made.equations
    return made.found


class _Delays:
    def __init__(self, model: Translation) -> None:
        self._model = model
        self._names: dict[Any, str] = {}
        self.equations: list[FlatEquation] = []
        self.found: list[Delay] = []

    def in_equation(self, equation: FlatEquation) -> FlatEquation:
        residual = self._in(equation.residual, equation)
        return equation if residual is equation.residual else dataclasses.replace(equation, residual=residual)

    def in_event(self, x: Any) -> Any:
        return self._in(x, FlatEquation(e.Const(0.0), "", "delay", None))

    def _in(self, x: Any, at: FlatEquation) -> Any:
        x = mapped(x, lambda part: self._in(part, at))
        if not isinstance(x, e.Builtin) or x.name != "Delay" or not self._is_fixed(x):
            return x  # refused by name where it is evaluated
        if x not in self._names:
            self._names[x] = self._made(x.args[0], x.args[1], at)
        return e.Ref(self._names[x])

    def _is_fixed(self, x: e.Builtin) -> bool:
        """Whether a delay depends on parameters only, and the signal on variables of the model."""
        try:
            _, (_, reads) = (self._model.term(arg) for arg in x.args[:2])
        except (NotKnown, ModelError):  # reported where the value is needed
            return False
        return all(leaf.role == "param" for leaf in reads)

    def _made(self, signal: Any, delay: Any, at: FlatEquation) -> str:
        model, number = self._model, 1 + len(self.found)
        name = f"delay_{number}"
        since, before, past = (f"{name}_{part}" for part in ("since", "before", "past"))
        for own in (name, since, before):
            model.leaves[own] = ModelLeaf(own, "var")
        history = jnp.full((STEPS, ROW), -jnp.inf)
        model.leaves[past] = ModelLeaf(past, "discrete", dims=history.shape, is_discrete=True, value=history)
        read = e.Builtin("Recall", (e.Ref(past), e.Ref(since), e.Ref(before)))
        ago = e.Binary("Sub", e.Ref("time"), delay)
        for left, right in (
            (e.Ref(name), read),
            (e.Ref(since), ago),
            (e.Builtin("Der", (e.Ref(before),)), e.Const(0.0)),
        ):
            self.equations.append(FlatEquation(e.Binary("Sub", left, right), at.component, "delay", at.place))
        start = e.Unary("Minus", e.Binary("Sub", signal, e.Ref(before)))
        model.lowered.initial_equations.append(FlatEquation(start, at.component, "delay", at.place))
        self.found.append(Delay(past, signal, delay))
        return name
