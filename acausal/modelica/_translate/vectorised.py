"""Calls of functions of scalars with arrays, element by element (Modelica 3.6, section 12.4.6)."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from ..._errors import ModelError
from .._syntax.flat import FlatFunction, Formal
from .values import Value, is_known, plain, stacked

Results = tuple[Value, ...]


def by_elements(
    function: FlatFunction,
    given: Mapping[str, Value],
    constructors: Mapping[str, FlatFunction],
    call: Callable[[dict[str, Value]], Results],
) -> Results:
    """The results of calls for each element of the arguments that have more axes than the function declares."""
    more = {formal.name: _more_axes(formal, given[formal.name], constructors) for formal in function.inputs}
    arrays = [name for name, axes in more.items() if axes > 0]
    if not arrays:
        return call(dict(given))
    shapes = {_shape(given[name])[: more[name]] for name in arrays}
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


def _shape(value: Value) -> tuple[int, ...]:
    while isinstance(value, dict):
        value = next(iter(value.values()))
    return np.shape(value)


def _element(value: Value, place: tuple[int, ...]) -> Value:
    if isinstance(value, dict):
        return {name: _element(item, place) for name, item in value.items()}
    return plain(np.asarray(value)[place]) if is_known(value) else value[place]


def _array(values: Sequence[Value], shape: tuple[int, ...]) -> Value:
    for size in reversed(shape[1:]):
        values = [stacked(values[i : i + size]) for i in range(0, len(values), size)]
    return stacked(values)
