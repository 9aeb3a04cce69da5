"""Calls of Modelica functions."""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

import jax.numpy as jnp
import numpy as np

from ..._errors import ModelError
from .._syntax import expressions as e
from .._syntax.flat import Formal, Function
from .evaluate import NotKnown, Point, evaluate
from .external import BY_NAME, EXTERNAL
from .statements import execute
from .values import Value

_ZEROS: dict[str, Value] = {"Real": 0.0, "Integer": 0, "Boolean": False, "String": ""}


@dataclasses.dataclass(frozen=True)
class Library:
    """The functions of a flat model, and the values of its constants."""

    functions: Mapping[str, Function]
    constants: Mapping[str, Value] = dataclasses.field(default_factory=dict)

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
        at = Point(self, locals=self.constants)
        for formal in (*function.outputs, *function.locals):
            names[formal.name] = self._initial(formal, at.knowing(**names))
        execute(function.body, names, at)
        return tuple(names[formal.name] for formal in function.outputs)

    def _given(self, function: Function, args: Sequence[Value]) -> dict[str, Value]:
        names: dict[str, Value] = {}
        at = Point(self, locals=self.constants)
        for position, formal in enumerate(function.inputs):
            if position < len(args):
                names[formal.name] = args[position]
            elif formal.default is not None:
                names[formal.name] = evaluate(formal.default, at.knowing(**names))
            else:
                raise ModelError(f"the argument {formal.name} of {function.name} is missing.")
        return names

    def _initial(self, formal: Formal, at: Point) -> Value:
        if formal.default is not None:
            return evaluate(formal.default, at)
        zero = _ZEROS.get(formal.type)
        if zero is None:
            return self._empty_record(formal.type)
        try:
            sizes = [int(evaluate(size, at)) for size in formal.dims if not isinstance(size, e.Colon)]
        except NotKnown:
            return zero
        if len(sizes) < len(formal.dims):
            return zero
        return np.full(sizes, zero) if sizes else zero

    def _empty_record(self, type_name: str) -> Value:
        constructor = self.functions.get(type_name)
        if constructor is None:
            return {}
        at = Point(self, locals=self.constants)
        return {item.name: self._initial(item, at) for item in constructor.inputs}


def _as_tuple(value: Any) -> tuple[Value, ...]:
    return value if isinstance(value, tuple) else (value,)


def as_numbers(value: Value) -> Value:
    """A value as numbers for an equation."""
    return jnp.asarray(value, float)
