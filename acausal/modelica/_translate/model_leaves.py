"""The leaves of a model: its parameters and variables."""

import dataclasses
from typing import Any

import jax.numpy as jnp
import numpy as np

from ..._declare.annotations import Limits
from .._errors import ModelicaError
from .._syntax import expressions as e
from .._syntax.flat import FlatVariable, equality
from .known import is_external, shaped
from .leaves import ModelLeaf, Role, kind_of, known_unit
from .scope import NotKnown, located
from .start_values import StartValues
from .terms import zeros
from .translation import INITIAL, Translation, as_leaf
from .values import Value

# "Never" is a wish here too: where the equations leave no other choice, such a variable becomes a state.
_SELECT = {"Never": -1, "Avoid": -1, "Prefer": 1, "Always": 2}


class ModelLeaves:
    """Makes the leaves of a model, and the equations of bindings."""

    def __init__(self, model: Translation, starts: StartValues) -> None:
        self._model = model
        self._starts = starts

    def make(self) -> None:
        leaves = self._model.leaves
        leaves["time"] = ModelLeaf("time", "time", unit="s")
        leaves[INITIAL] = ModelLeaf(INITIAL, "discrete", "boolean", is_discrete=True, value=1.0)
        for sample in self._model.lowered.samples:
            leaves[sample.ticks] = ModelLeaf(sample.ticks, "discrete", "integer", is_discrete=True, value=0.0)
        variables = [variable for variable in self._model.flat.variables.values() if self._has_leaf(variable)]
        for variable in variables:
            if variable.variability != "parameter":
                leaf = leaves[variable.name] = self._leaf(variable, "var")
                self._starts.state(leaf)
        self._parameters([variable for variable in variables if variable.variability == "parameter"])
        self._starts.state_late()
        for name in self._model.clocked.stored:
            leaf = leaves[name]
            leaf.role = "discrete"
            leaf.value = jnp.broadcast_to(jnp.asarray(leaf.guess, float), leaf.dims)
        for variable in self._model.flat.variables.values():
            leaf = leaves.get(variable.name)
            if leaf is not None and leaf.role == "var" and variable.binding is not None:
                self._equate(variable, e.Ref(variable.name), variable.binding, "binding")

    def _has_leaf(self, variable: FlatVariable) -> bool:
        model = self._model
        is_text = variable.type == "String" or is_external(variable, model.flat)
        is_made = variable.name in model.leaves or model.known.has(variable)
        return not is_made and not is_text and 0 not in variable.dims

    def _equate(self, variable: FlatVariable, left: Any, right: Any, origin: str) -> None:
        component = variable.name.rpartition(".")[0] if origin == "binding" else ""
        self._model.equations.append(equality(left, right, origin, component, variable.source))

    # Parameters

    def _parameters(self, variables: list[FlatVariable]) -> None:
        """The leaves of real parameters: first those with a value, then those that others determine."""
        for variable in variables:
            if variable.binding is not None or all(variable.fixed or (True,)):
                self._model.leaves[variable.name] = self._leaf(variable, "param")
            else:
                self._open_parameter(variable)
        for variable in variables:
            leaf = self._model.leaves[variable.name]
            if leaf.role == "param":
                self._parameter_value(variable, leaf, [])
        for variable in self._model.flat.variables.values():
            leaf = self._model.leaves.get(variable.name)
            if variable.variability != "parameter" or (variable.min, variable.max) == (None, None):
                continue
            if leaf is not None and leaf.role == "param":
                leaf.limits = self._check(variable, leaf.value)
                is_low = leaf.limits is not None and leaf.limits.low >= 0
                leaf.is_positive = is_low and bool(np.all(np.asarray(leaf.value) > 0))
            elif leaf is None and variable.name in self._model.known:
                self._check(variable, self._model.known[variable.name])

    def _open_parameter(self, variable: FlatVariable) -> None:
        """A parameter that initial equations determine: a variable that keeps its value."""
        name, initial = variable.name, self._model.lowered.initial
        leaf = self._model.leaves[name] = self._leaf(variable, "var")
        if name in initial:
            leaf.is_discrete = True
            self._starts.state(leaf)
            kept = e.Builtin("Pre", (e.Ref(name),))
            value = e.If(((e.Builtin("Initial", ()), initial.pop(name)),), kept)
            self._equate(variable, e.Ref(name), value, "initial")
        else:
            self._starts.state(leaf)
            self._equate(variable, e.Builtin("Der", (e.Ref(name),)), zeros(variable.dims), "initial")

    def _parameter_value(self, variable: FlatVariable, leaf: ModelLeaf, path: list[str]) -> Value:
        """The value of a parameter; one with a binding that reads others is determined by them."""
        if leaf.value is not None:
            return leaf.value
        if variable.name in path:
            raise ModelicaError(f"{variable.source}: {variable.name} is determined by itself.")
        stated = variable.start if variable.binding is None else variable.binding
        if stated is None:
            value: Value = np.zeros(variable.dims) if variable.dims else 0.0
        else:
            with located(variable.source):
                term, reads = self._model.term(stated)
            if any(other.role != "param" for other in reads):
                return self._becomes_variable(variable)
            others = [(other.variable, other) for other in reads if other.variable is not None]
            values = [self._parameter_value(other, its_leaf, [*path, variable.name]) for other, its_leaf in others]
            if any(value is None for value in values):
                return self._becomes_variable(variable)
            with located(variable.source):
                value = self._model.value(term, reads)
            if reads:
                self._model.determined.add(leaf, term, reads)
        leaf.value = as_leaf(shaped(value, variable))
        return leaf.value

    def _check(self, variable: FlatVariable, value: Value) -> Limits | None:
        """The limits of a parameter, except those that follow others. Raises `ModelicaError` if its value is outside,
        as far as the limits are known.
        """
        with located(variable.place):
            (low, is_set), (high, is_too) = self._limit(variable.min, -np.inf), self._limit(variable.max, np.inf)
        limits = Limits(float(np.min(low)), float(np.max(high)), f"declared in {variable.place}")
        if not np.all((np.asarray(value) >= low) & (np.asarray(value) <= high)):
            side = "max" if np.all(np.asarray(value) >= low) else "min"
            raise ModelicaError(
                f"{variable.source}: {variable.name} must be {limits.name} ({limits.place}), got {value}. Remedy: "
                f"another value, or another limit by a modifier: {variable.name.rpartition('.')[2]}({side}=...)."
            )
        limits = dataclasses.replace(
            limits, low=limits.low if is_set else -np.inf, high=limits.high if is_too else np.inf
        )
        return limits if np.isfinite(limits.low) or np.isfinite(limits.high) else None

    def _limit(self, x: Any, otherwise: float) -> tuple[Any, bool]:
        """A limit, `otherwise` if it is unknown, and whether it never changes."""
        if x is None:
            return otherwise, False
        term, reads = self._model.term(x)
        if any(other.role != "param" or other.value is None for other in reads):
            return otherwise, False
        return np.asarray(self._model.value(term, reads), float), not reads

    def _becomes_variable(self, variable: FlatVariable) -> None:
        """A parameter whose binding reads one that initial equations determine."""
        self._model.leaves[variable.name] = dataclasses.replace(self._leaf(variable, "var"), is_discrete=False)

    # One leaf

    def _leaf(self, variable: FlatVariable, role: Role) -> ModelLeaf:
        is_real = variable.type == "Real"
        connectors = self._model.connectors
        return ModelLeaf(
            connectors.path(variable),
            role,
            kind_of(variable.type),
            variable.dims,
            known_unit(variable.unit) if is_real else "1",
            variable.name in self._model.lowered.discrete,
            select=_SELECT.get(variable.select, 0),
            nominal=self._nominal(variable) if is_real else 1.0,
            variable=variable,
            in_port=connectors.has(variable.name),
        )

    def _nominal(self, variable: FlatVariable) -> float | None:
        found = self._number(variable.nominal)
        return abs(found) if found else None

    def _number(self, x: Any) -> float | None:
        """The largest number of an attribute, if it is known."""
        if x is None:
            return None
        try:
            value = self._model.known.value(x)
        except NotKnown:
            return None
        return float(np.max(value)) if np.size(value) else None
