"""Derivatives of derivatives: in der(der(x)), the inner derivative is a variable of its own."""

import dataclasses
from typing import Any

from .._syntax import expressions as e
from .._syntax.flat import FlatEquation
from .._syntax.visits import mapped
from .leaves import ModelLeaf
from .terms import reads_rates
from .translation import Translation


def name_rates(model: Translation) -> None:
    """Replace derivatives inside of derivatives by variables, in a model whose leaves exist."""
    named = _NamedRates(model)
    for equations in (model.equations, model.lowered.initial_equations):
        equations[:] = [dataclasses.replace(q, residual=named.in_expression(q.residual)) for q in equations]
    for parts in (model.lowered.algorithms, model.lowered.resets, model.lowered.demands):
        parts[:] = [named.in_expression(part) for part in parts]
    model.equations += named.equations


class _NamedRates:
    def __init__(self, model: Translation) -> None:
        self._model = model
        self._names: dict[Any, str] = {}
        self.equations: list[FlatEquation] = []

    def in_expression(self, x: Any) -> Any:
        x = mapped(x, self.in_expression)
        if isinstance(x, e.Builtin) and x.name == "Der" and any(map(reads_rates, x.args)):
            return mapped(x, self._named)
        return x

    def _named(self, x: Any) -> Any:
        if not isinstance(x, e.Builtin) or x.name != "Der":
            return mapped(x, self._named)
        if x not in self._names:
            name = self._names[x] = self._variable(x.args[0])
            self.equations.append(FlatEquation(e.Binary("Sub", e.Ref(name), x), "", "rate", None))
        return e.Ref(self._names[x])

    def _variable(self, x: Any) -> str:
        leaves, number = self._model.leaves, 1
        while (name := f"rate_{number}") in leaves:
            number += 1
        leaves[name] = ModelLeaf(name, "var", dims=self._model.shape(x))
        return name
