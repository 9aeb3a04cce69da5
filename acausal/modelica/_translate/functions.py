"""Calls of Modelica functions."""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

import jax
import numpy as np

from ..._errors import ModelError
from ..._tracing import is_traced
from .._syntax import expressions as e
from .._syntax.flat import FlatFunction, Formal
from .branches import with_arrays, without_arrays
from .evaluate import evaluate
from .execute import execute
from .external import BY_NAME, EXTERNAL
from .programs import TracedFunction, hashable, is_large
from .scope import NotKnown, Scope
from .values import Value, is_known
from .vectorised import by_elements

_ZEROS: dict[str, Value] = {"Real": 0.0, "Integer": 0, "Boolean": False, "String": ""}


@dataclasses.dataclass(frozen=True)
class Library:
    """The functions of a flat model, and the values of its constants."""

    functions: Mapping[str, FlatFunction]
    constants: Mapping[str, Value] = dataclasses.field(default_factory=dict)
    programs: dict[Any, TracedFunction] = dataclasses.field(default_factory=dict, compare=False)

    def call(self, name: str, args: Sequence[Value]) -> tuple[Value, ...]:
        """The results of a function, from arguments by position."""
        if name in BY_NAME:
            return _as_tuple(BY_NAME[name](*args))
        function = self.functions.get(name)
        if function is None:
            raise ModelError(f"the function {name} is not in the flat model.")
        if function.external is not None:
            outside = EXTERNAL.get(name.rpartition(".")[2], EXTERNAL.get(function.external))
            if outside is None:
                raise ModelError(
                    f"the external function {function.external} of {name} is not supported; "
                    "redeclare the function or component that calls it."
                )
            return _as_tuple(outside(*self._given(function, args).values()))
        names = self._given(function, args)
        if function.is_constructor or (not function.body and not function.outputs):
            return (dict(names),)
        if not function.body and any(formal.default is None for formal in function.outputs):
            raise ModelError(f"the function {name} has no algorithm that gives its outputs values.")
        return by_elements(function, names, self.functions, lambda names: self._called(function, names))

    def _called(self, function: FlatFunction, names: dict[str, Value]) -> tuple[Value, ...]:
        return self._once(function, names) if is_large(function) else self._results(function, names)

    def _once(self, function: FlatFunction, names: dict[str, Value]) -> tuple[Value, ...]:
        """The results of a function that is traced once for each shape of its arguments."""
        arrays: list[jax.Array] = []
        inputs = without_arrays(names, arrays)
        if not any(is_traced(array) for array in arrays):
            return self._results(function, names)
        key = (function.name, hashable(inputs), *((array.dtype, array.shape) for array in arrays))
        if key not in self.programs:
            self.programs[key] = TracedFunction(
                function.name, lambda values: self._results(function, with_arrays(inputs, values))
            )
        return self.programs[key](arrays)

    def _results(self, function: FlatFunction, given: dict[str, Value]) -> tuple[Value, ...]:
        names = dict(given)
        at = Scope(self, locals=self.constants)
        waiting = [*function.outputs, *function.locals]
        while waiting:  # a value may read that of a variable further down
            formal = waiting.pop(0)
            try:
                names[formal.name] = self._initial(formal, at.knowing(**names))
            except NotKnown as missing:
                if not any(str(missing) == other.name for other in waiting):
                    raise
                waiting.append(formal)
        execute(function.body, names, at, is_whole=True)
        return tuple(names[formal.name] for formal in function.outputs)

    def _given(self, function: FlatFunction, args: Sequence[Value]) -> dict[str, Value]:
        names: dict[str, Value] = {}
        at = Scope(self, locals=self.constants)
        for position, formal in enumerate(function.inputs):
            if position < len(args):
                names[formal.name] = _without_derivative(args[position]) if formal.type == "Integer" else args[position]
            elif formal.default is not None:
                names[formal.name] = evaluate(formal.default, at.knowing(**names))
            else:
                raise ModelError(f"the argument {formal.name} of {function.name} is missing.")
        return names

    def _initial(self, formal: Formal, at: Scope) -> Value:
        if formal.default is not None:
            return evaluate(formal.default, at)
        zero = _ZEROS.get(formal.type)
        if zero is None:
            zero = self._empty_record(formal.type)
        try:
            sizes = [0 if isinstance(size, e.Colon) else int(evaluate(size, at)) for size in formal.dims]
        except NotKnown:
            return zero
        return _filled(zero, sizes) if sizes else zero

    def _empty_record(self, type_name: str) -> Value:
        constructor = self.functions.get(type_name)
        if constructor is None:
            return {}
        at = Scope(self, locals=self.constants)
        found: dict[str, Value] = {}
        for item in constructor.inputs:
            found[item.name] = self._initial(item, at.knowing(**found))
        return found


def _filled(zero: Value, sizes: Sequence[int]) -> Value:
    """An array of zeros, or an array of records as a record of arrays."""
    if isinstance(zero, dict):
        return {name: _filled(item, sizes) for name, item in zero.items()}
    return np.broadcast_to(zero, (*sizes, *np.shape(zero))).copy()


def _without_derivative(value: Value) -> Value:
    return value if is_known(value) else jax.lax.stop_gradient(value)


def _as_tuple(value: Any) -> tuple[Value, ...]:
    return value if isinstance(value, tuple) else (value,)
