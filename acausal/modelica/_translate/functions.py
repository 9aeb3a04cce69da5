"""Calls of Modelica functions: by elements of arrays (Modelica 3.6, section 12.4.6), and as programs."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from typing import Any

import jax
import numpy as np

from ..._errors import ModelError
from ..._tracing import is_traced
from .._syntax import expressions as e
from .._syntax.flat import FlatFunction, Formal
from .._syntax.visits import nodes
from .branches import with_arrays, without_arrays
from .evaluate import evaluate
from .execute import execute
from .external import BY_NAME, EXTERNAL
from .scope import NotKnown, Scope
from .values import ZEROS, Value, by_field, is_known, plain, shape_of, stacked

_LARGE = 30  # nodes of a body from which on it is worth a program of its own


@dataclasses.dataclass(frozen=True)
class Library:
    """The functions of a flat model, and the values of its constants."""

    functions: Mapping[str, FlatFunction]
    constants: Mapping[str, Value] = dataclasses.field(default_factory=dict)
    programs: "dict[Any, TracedFunction]" = dataclasses.field(default_factory=dict, compare=False)

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
        zero = ZEROS.get(formal.type)
        if zero is None:
            zero = self._empty_record(formal.type)
        try:
            sizes = [0 if isinstance(size, e.Colon) else int(evaluate(size, at)) for size in formal.dims]
        except NotKnown:
            return zero
        return by_field(zero, lambda x: np.broadcast_to(x, (*sizes, *np.shape(x))).copy()) if sizes else zero

    def _empty_record(self, type_name: str) -> Value:
        constructor = self.functions.get(type_name)
        if constructor is None:
            return {}
        at = Scope(self, locals=self.constants)
        found: dict[str, Value] = {}
        for item in constructor.inputs:
            found[item.name] = self._initial(item, at.knowing(**found))
        return found


def _without_derivative(value: Value) -> Value:
    return value if is_known(value) else jax.lax.stop_gradient(value)


def _as_tuple(value: Any) -> tuple[Value, ...]:
    return value if isinstance(value, tuple) else (value,)


# Programs of functions, which are traced once for each shape of their arguments


class TracedFunction:
    """A function of arrays whose results are values; those that are known are found when it is traced."""

    def __init__(self, name: str, compute: Callable[[Sequence[Any]], Value]) -> None:
        self._values: Value = None

        def run(arrays: list[jax.Array]) -> list[jax.Array]:
            found: list[jax.Array] = []
            self._values = without_arrays(compute(arrays), found)
            return found

        run.__name__ = name.replace(".", "_")
        self._run = jax.jit(run)

    def __call__(self, arrays: list[jax.Array]) -> Value:
        found = self._run(arrays)
        return with_arrays(self._values, found)


def hashable(value: Value) -> Any:
    """A known value as a key."""
    if isinstance(value, dict):
        return tuple((name, hashable(item)) for name, item in value.items())
    if isinstance(value, tuple | list):
        return tuple(hashable(item) for item in value)
    if isinstance(value, np.ndarray):
        return value.shape, value.dtype.str, value.tobytes()
    return type(value), value


@cache
def is_large(function: FlatFunction) -> bool:
    """Whether a body is worth a program of its own."""
    return sum(1 for _ in nodes(function.body)) >= _LARGE


# Calls of functions of scalars with arrays, element by element


def by_elements(
    function: FlatFunction,
    given: Mapping[str, Value],
    constructors: Mapping[str, FlatFunction],
    call: Callable[[dict[str, Value]], tuple[Value, ...]],
) -> tuple[Value, ...]:
    """The results of calls for each element of the arguments that have more axes than the function declares."""
    more = {formal.name: _more_axes(formal, given[formal.name], constructors) for formal in function.inputs}
    arrays = [name for name, axes in more.items() if axes > 0]
    if not arrays:
        return call(dict(given))
    shapes = {shape_of(given[name])[: more[name]] for name in arrays}
    if len(shapes) > 1:
        raise ModelError(f"the arguments {', '.join(arrays)} of {function.name} have different sizes.")
    (shape,) = shapes
    results = [
        call({name: _element(value, place) if name in arrays else value for name, value in given.items()})
        for place in np.ndindex(shape)
    ]
    return tuple(_array([result[i] for result in results], shape) for i in range(len(function.outputs)))


def _more_axes(formal: Formal, value: Value, constructors: Mapping[str, FlatFunction]) -> int:
    """The number of axes of an argument beyond those of the input."""
    if not isinstance(value, dict):
        return np.ndim(value) - len(formal.dims)
    constructor = constructors.get(formal.type)
    fields = () if constructor is None else constructor.inputs
    found = [_more_axes(field, value[field.name], constructors) for field in fields if field.name in value]
    return found[0] - len(formal.dims) if found else 0


def _element(value: Value, place: tuple[int, ...]) -> Value:
    return by_field(value, lambda x: plain(np.asarray(x)[place]) if is_known(x) else x[place])


def _array(values: Sequence[Value], shape: tuple[int, ...]) -> Value:
    for size in reversed(shape[1:]):
        values = [stacked(values[i : i + size]) for i in range(0, len(values), size)]
    return stacked(values)
