"""Free parameters found by path, with their bounds and units checked."""

import itertools
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any, TypeVar

import numpy as np

from ..._declare.annotations import Declaration
from ..._declare.by_name import refuse_fixed, replace
from ..._declare.component import Component
from ..._declare.node import Leaf, leaves_of
from ..._errors import ModelError, ParameterError, reason_of, suggestion
from ..._units.display import Scale, scale_of
from .free import Built, Free, Place, Variable, built_parts, number_at, span_text
from .types import ByPath, Key, number_in

_ELEMENT = re.compile(r"(.+)\[(\d+(?:\s*,\s*\d+)*)\]")
_MEMBER = re.compile(r"\[(\d+)\]\.")


def free_parameters(model: Component, free: ByPath[object]) -> Free:
    """The free parameters named by a mapping.

    A key is the path of a parameter or of a given start value, such as `"gearbox.ratio"`, the path of an array element,
    such as `"table.y[3]"`, that of a constructor argument, such as `"motor.R"`, or a tuple of paths that share one
    value. The path of a whole array adds one variable per element. A value is a pair of bounds: numbers in the declared
    unit, quantities, or texts such as `"15 mm"`. None means no bound, or no bounds instead of the pair. The start is
    the value in the model. The elements of an array that lack a bound share one size, that of the largest.

    Raises `ModelError` for an unknown path or one named twice, and `ParameterError` for bounds that are crossed, of
    another dimension or outside the declared range, for a start outside its bounds, and for a parameter on which the
    structure depends.
    """
    if not isinstance(free, Mapping) or not free:
        raise ModelError(f"Name at least one free parameter, as in {{'gearbox.ratio': (2.0, 20.0)}}; got {free!r}.")
    known = {leaf.path: leaf for leaf in leaves_of(model)}
    paths = {path for key in free for path in (key if isinstance(key, tuple) else (key,)) if isinstance(path, str)}
    refuse_fixed(model, paths)
    parts = built_parts(model, paths - known.keys())
    known |= {path: _argument(path, built) for path, built in parts.items()}
    found = Free(
        tuple(itertools.chain.from_iterable(_variables(known, parts, key, bounds) for key, bounds in free.items()))
    )
    seen: set[Place] = set()
    for place in (place for variable in found.variables for place in variable.places):
        if place in seen:
            raise ModelError(f"{place.name} is named twice among the free parameters. Name it once.")
        seen.add(place)
    largest = (max(abs(found.variables[i].start) for i in group) or 1.0 for group in found.open_groups)
    return found.with_sizes({i: size for group, size in zip(found.open_groups, largest, strict=True) for i in group})


def single_parameters(model: Component, keys: Iterable[Key], what: str) -> Free:
    """Scalar parameters without bounds. `what` begins the error message about a whole array."""
    named = dict.fromkeys(keys)
    free = free_parameters(model, named)
    if len(free.variables) != len(named):
        raise ModelError(f"{what} one by one, as in 'table.y[3]'.")
    return free


def _variables(known: Mapping[str, Leaf], parts: Mapping[str, Built], key: Any, bounds: object) -> Iterator[Variable]:
    paths = key if isinstance(key, tuple) else (key,)
    if not paths or not all(isinstance(path, str) for path in paths):
        raise ModelError(f"A free parameter is named by its path, or by a tuple of paths that share it; got {key!r}.")
    columns = [[Place(path, None, parts[path])] if path in parts else _places(known, path) for path in paths]
    if len({len(column) for column in columns}) > 1:
        sizes = ", ".join(f"{path} ({len(column)})" for path, column in zip(paths, columns, strict=True))
        raise ModelError(f"Paths that share values must have equally many: {sizes}.")
    units = {known[column[0].path].declaration.unit for column in columns}
    if len(units) > 1:
        raise ParameterError(f"{', '.join(paths)} cannot share a value: their units are {', '.join(sorted(units))}.")
    name = ", ".join(paths)
    limits = _limits(bounds, units.pop(), name, len(columns[0]))
    for places, (low, high, scale) in zip(zip(*columns, strict=True), limits, strict=True):
        yield _variable(known, places, low, high, scale)


def _argument(path: str, built: Built) -> Leaf:
    """A constructor argument as a parameter without a declared range."""
    name = path.rpartition(".")[2]
    return Leaf(path, Declaration("param", built.units[name], is_unbounded=True), built.values[name], ())


def _places(known: Mapping[str, Leaf], path: str) -> list[Place]:
    """The places of the numbers at a path."""
    leaf, index = known.get(path), None
    if leaf is None and (element := _ELEMENT.fullmatch(path)) and element[1] in known:
        leaf, index = known[element[1]], tuple(int(i) for i in element[2].split(","))
    if leaf is None and (member := _MEMBER.search(path)):
        # A member of an array of components, whose leaves are stacked.
        stacked = f"{path[: member.start()]}.item.{path[member.end() :]}"
        leaf, index = known.get(stacked), (int(member[1]),)
    if leaf is None:
        raise ModelError(_unknown(path, known))
    if leaf.value is None:
        raise ModelError(f"{path} has no start value. Give it one: replace(model, {{{path!r}: ...}}).")
    shape = np.shape(leaf.value)
    if index is None:
        return [Place(leaf.path, i) for i in np.ndindex(shape)] if shape else [Place(leaf.path)]
    if len(index) != len(shape) or any(i >= n for i, n in zip(index, shape, strict=True)):
        raise ModelError(f"{path} is not an element of {leaf.path}, which has the shape {shape}.")
    return [Place(leaf.path, index)]


def _unknown(path: str, known: Mapping[str, Leaf]) -> str:
    parameters = [name for name, leaf in known.items() if leaf.declaration.role == "param"]
    inside = [name for name in parameters if name.startswith((f"{path}.", f"{path}["))]
    same = [name for name in parameters if name.endswith(f".{path}")]
    if inside:
        return f"{path} is not a parameter but contains some: {', '.join(inside)}. Name one of them."
    if same:
        return f"{path!r} is not a complete path. Write it out: {' or '.join(same)}."
    return f"The model has no parameter or start value {path!r}.{suggestion(path, parameters)}"


def _limits(bounds: Any, unit: str, where: str, n: int) -> list[tuple[float, float, Scale]]:
    """Bounds and display units of `n` numbers, from a pair, a pair of sequences, or None."""
    if bounds is None:
        return [(-np.inf, np.inf, scale_of("", unit, where))] * n
    if isinstance(bounds, str) or not hasattr(bounds, "__len__") or len(bounds) != 2:
        raise ParameterError(f"{where}: bounds must be a pair, such as (2.0, 20.0) or ('15 mm', None); got {bounds!r}.")
    lows, highs = (_each(bound, where, n) for bound in bounds)
    limits = []
    for below, above in zip(lows, highs, strict=True):
        low, shown = (-np.inf, "") if below is None else number_in(below, unit, where)
        high, other = (np.inf, "") if above is None else number_in(above, unit, where)
        limits.append((low, high, scale_of(shown or other, unit, where)))
    return limits


def _each(bound: Any, where: str, n: int) -> list[object]:
    if bound is None or isinstance(bound, str) or not np.ndim(getattr(bound, "magnitude", bound)):
        return [bound] * n
    if len(bound) != n:
        raise ParameterError(f"{where}: {len(bound)} bounds are given for {n} numbers.")
    return list(bound)


def _variable(known: Mapping[str, Leaf], places: tuple[Place, ...], low: float, high: float, scale: Scale) -> Variable:
    name = ", ".join(place.name for place in places)
    leaves = {path: leaf.value for path, leaf in known.items()}
    starts = [number_at(leaves, place) for place in places]
    start = starts[0]
    if not low < high:
        raise ParameterError(f"{name}: the lower bound must be below the upper one, got {span_text(low, high, scale)}.")
    for place in places:
        _check_range(place.name, known[place.path].declaration, low, high, scale)
    found = Variable(name, places, known[places[0].path].declaration.unit, scale, low, high, start)
    if any(other != start for other in starts):
        values = ", ".join(f"{place.name} = {found.text(value)}" for place, value in zip(places, starts, strict=True))
        raise ParameterError(
            f"Paths that share a value must start from the same one: {values}. Set them by replace(model, ...)."
        )
    found.checked(start)
    return found


def _check_range(name: str, declaration: Declaration, low: float, high: float, scale: Scale) -> None:
    if np.isinf(low) and np.isinf(high):
        return  # a run outside the declared range fails
    for one in declaration.ranges:
        if not (one.admits(low) and one.admits(high) and (one.name != "nonzero" or low * high > 0)):
            raise ParameterError(f"{name} must be {one.name}, also at its bounds, got {span_text(low, high, scale)}.")


T = TypeVar("T")
ALL = 6  # most variables for which all corners are tried


def unbuilt_corners(model: Component, free: Free, scenarios: Mapping[str, Mapping[str, Any]]) -> Iterator[str]:
    """Combinations of bounds at which a component refuses its parameters, with the reason.

    A missing bound is replaced by the start. For many variables, the corners combine both bounds of any two variables.
    """
    start = np.array([variable.start for variable in free.variables])
    built = {
        name: change for name, change in scenarios.items() if not why_not_built(lambda c=change: replace(model, c))
    }
    low, high = (np.where(np.isfinite(bound), bound, start) for bound in (free.low, free.high))
    for is_high in _corners(len(start)):
        x = np.where(is_high, high, low)
        for name, change in built.items():
            if reason := why_not_built(lambda x=x, change=change: replace(free.with_values(model, x), change)):
                yield f"{free.text(x)}{f' in {name}' if name else ''} cannot be built: {reason}"
                break


def _corners(n: int) -> Iterator[np.ndarray]:
    """Marks of the variables at their upper bound."""
    if n <= ALL:
        yield from map(np.array, itertools.product((False, True), repeat=n))
        return
    # The numbers of any two variables differ in a bit.
    for bit in range(n.bit_length() + 1):
        is_high = (np.arange(n) >> bit) % 2 == 1
        yield is_high
        yield ~is_high


def why_not_built(build: Callable[[], object]) -> str:
    """The reason why a model cannot be built; empty if it can."""
    return model_or_reason(build)[1]


def model_or_reason(build: Callable[[], T]) -> tuple[T | None, str]:
    """A model, or None and the reason why it cannot be built."""
    try:
        return build(), ""
    except Exception as error:  # of any constructor
        return None, reason_of(error)
