"""Free parameters of a model: by path, with bounds and units, as a vector of numbers and scaled between its bounds."""

import dataclasses
import itertools
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple, TypeVar

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from .._declare.annotations import Declaration
from .._declare.by_name import replace
from .._declare.component import Component
from .._declare.node import leaves_of
from .._errors import ModelError, ParameterError, suggestion
from ._bounds import Scale, number_in, scale_of

M = TypeVar("M", bound=Component)
DECADE = 10.0  # a ratio of the bounds from which on a variable is scaled by its logarithm
_ELEMENT = re.compile(r"(.+)\[(\d+(?:\s*,\s*\d+)*)\]")
_MEMBER = re.compile(r"\[(\d+)\]\.")


class Place(NamedTuple):
    """A number in a model: the path of a parameter or start value, and the indices of an element of it."""

    path: str
    element: tuple[int, ...] | None = None

    @property
    def name(self) -> str:
        return self.path if self.element is None else f"{self.path}[{','.join(map(str, self.element))}]"


class Variable(NamedTuple):
    """One free number, which stands at one place or at several ones; bounds in the declared unit."""

    name: str
    places: tuple[Place, ...]
    unit: str
    scale: Scale
    low: float
    high: float
    start: float

    def checked(self, value: float) -> float:
        """A value to start from, which has to lie between the bounds."""
        if not self.low <= value <= self.high:
            raise ParameterError(
                f"{self.name} starts from {self.scale.value(value):g}{self.scale.text}, outside of its bounds "
                f"{_span(self.low, self.high, self.scale)}. Widen these, or start from another value."
            )
        return value

    @property
    def is_log(self) -> bool:
        return self.low > 0.0 and np.isfinite(self.high) and self.high > DECADE * self.low

    @property
    def origin_and_width(self) -> tuple[float, float]:
        """Of the variable or of its logarithm: what is scaled to 0, and by what it differs from what is scaled to 1."""
        if self.is_log:
            return float(np.log(self.low)), float(np.log(self.high / self.low))
        if np.isfinite(self.high - self.low):
            return self.low, self.high - self.low
        return self.start, abs(self.start) or 1.0


@dataclasses.dataclass(frozen=True)
class Free:
    """The free parameters of a model, in the order in which they were named.

    Vectors `x` hold their values in the declared units, `z` the scaled ones; both may be traced.
    """

    variables: tuple[Variable, ...]

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(variable.name for variable in self.variables)

    @property
    def units(self) -> tuple[str, ...]:
        """The declared units, in which all numbers here are."""
        return tuple(variable.unit for variable in self.variables)

    @property
    def low(self) -> Float[np.ndarray, " n"]:
        return np.array([variable.low for variable in self.variables])

    @property
    def high(self) -> Float[np.ndarray, " n"]:
        return np.array([variable.high for variable in self.variables])

    def values(self, model: Component) -> Float[np.ndarray, " n"]:
        """The numbers of a model."""
        leaves = {leaf.path: leaf.value for leaf in leaves_of(model)}
        return np.array([_number(leaves, variable.places[0]) for variable in self.variables])

    def with_values(self, model: M, x: Any) -> M:
        """The model with other numbers, which may be traced."""
        return with_numbers(model, [variable.places for variable in self.variables], x)

    def changed(self, x: Any, values: Mapping[str, Any]) -> Any:
        """The numbers with some of them changed, by the names of the variables."""
        new = np.array(x, float)
        for name, value in values.items():
            if name not in self.names:
                raise ModelError(f"{name!r} is no free parameter.{suggestion(name, self.names)}")
            i = self.names.index(name)
            new[i] = self.variables[i].checked(number_in(value, self.units[i], name)[0])
        return new

    def scaled(self, x: Any) -> Any:
        """From 0 at the lower to 1 at the upper bound: evenly, or by the logarithm over more than a decade."""
        origin, width = self._origin_and_width
        return (jnp.where(self._is_log, jnp.log(jnp.where(self._is_log, x, 1.0)), x) - origin) / width

    def unscaled(self, z: Any) -> Any:
        """The numbers from those between 0 and 1."""
        origin, width = self._origin_and_width
        straight = origin + width * z
        return jnp.where(self._is_log, jnp.exp(jnp.where(self._is_log, straight, 0.0)), straight)

    def slopes(self, x: Any) -> Any:
        """dx/dz, from scaled numbers to the numbers themselves."""
        _, width = self._origin_and_width
        return width * jnp.where(self._is_log, x, 1.0)

    @property
    def _is_log(self) -> np.ndarray:
        return np.array([variable.is_log for variable in self.variables])

    @property
    def _origin_and_width(self) -> tuple[np.ndarray, np.ndarray]:
        origins, widths = zip(*(variable.origin_and_width for variable in self.variables), strict=True)
        return np.array(origins), np.array(widths)


def with_numbers(model: M, places: Iterable[Sequence[Place]], x: Any) -> M:
    """The model with other numbers, each of them at one place or at several ones."""
    leaves = {leaf.path: leaf.value for leaf in leaves_of(model)}
    changed: dict[str, Any] = {}
    for own, value in zip(places, x, strict=True):
        for path, index in own:
            whole = changed.get(path, leaves[path])
            changed[path] = value if index is None else jnp.asarray(whole, float).at[index].set(value)
    return replace(model, changed)


def free_parameters(model: Component, free: Mapping[Any, Any]) -> Free:
    """The free parameters that a mapping names.

    A key is the path of a parameter or of a start value that is given, as in `"gearbox.ratio"`, of an element of an
    array, as in `"table.y[3]"`, or a tuple of paths that share one value. An array that is named as a whole is as many
    variables as it has elements. A value is a pair of bounds: numbers in the declared unit, quantities, or texts such
    as `"15 mm"`; None is no bound, also in place of the pair. The start is what the model has.

    Raises `ModelError` for a path that the model does not have or that is named twice, and `ParameterError` for bounds
    that are crossed, of another dimension or outside of the declared range, and for a start outside of its bounds.
    """
    if not isinstance(free, Mapping) or not free:
        raise ModelError(f"Name at least one free parameter, as in {{'gearbox.ratio': (2.0, 20.0)}}; got {free!r}.")
    known = {leaf.path: leaf for leaf in leaves_of(model)}
    found = Free(tuple(itertools.chain.from_iterable(_variables(known, key, bounds) for key, bounds in free.items())))
    seen: set[Place] = set()
    for place in (place for variable in found.variables for place in variable.places):
        if place in seen:
            raise ModelError(f"{place.name} is named twice among the free parameters. Name it once.")
        seen.add(place)
    return found


def single_parameters(model: Component, keys: Iterable[Any], what: str) -> Free:
    """Parameters without bounds, each of which is one number; `what` begins the message where one is a whole array."""
    named = dict.fromkeys(keys)
    free = free_parameters(model, named)
    if len(free.variables) != len(named):
        raise ModelError(f"{what} one by one, as in 'table.y[3]'.")
    return free


def _variables(known: Mapping[str, Any], key: Any, bounds: Any) -> Iterator[Variable]:
    paths = key if isinstance(key, tuple) else (key,)
    if not paths or not all(isinstance(path, str) for path in paths):
        raise ModelError(f"A free parameter is named by its path, or by a tuple of paths that share it; got {key!r}.")
    columns = [_places(known, path) for path in paths]
    if len({len(column) for column in columns}) > 1:
        sizes = ", ".join(f"{path} ({len(column)})" for path, column in zip(paths, columns, strict=True))
        raise ModelError(f"What shares values must have as many of them: {sizes}.")
    units = {known[column[0].path].declaration.unit for column in columns}
    if len(units) > 1:
        raise ParameterError(f"{', '.join(paths)} cannot share a value: their units are {', '.join(sorted(units))}.")
    name = ", ".join(paths)
    limits = _limits(bounds, units.pop(), name, len(columns[0]))
    for places, (low, high, scale) in zip(zip(*columns, strict=True), limits, strict=True):
        yield _variable(known, places, low, high, scale)


def _places(known: Mapping[str, Any], path: str) -> list[Place]:
    """The numbers that a path stands for."""
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
        raise ModelError(
            f"{path} has no start value that could be free. Give it one: replace(model, {{{path!r}: ...}})."
        )
    shape = np.shape(leaf.value)
    if index is None:
        return [Place(leaf.path, i) for i in np.ndindex(shape)] if shape else [Place(leaf.path)]
    if len(index) != len(shape) or any(i >= n for i, n in zip(index, shape, strict=True)):
        raise ModelError(f"{path} is no element of {leaf.path}, which has the shape {shape}.")
    return [Place(leaf.path, index)]


def _unknown(path: str, known: Mapping[str, Any]) -> str:
    parameters = [name for name, leaf in known.items() if leaf.declaration.role == "param"]
    inside = [name for name in parameters if name.startswith((f"{path}.", f"{path}["))]
    same = [name for name in parameters if name.endswith(f".{path}")]
    if inside:
        return f"{path} is no parameter, but holds some: {', '.join(inside)}. Name one of them."
    if same:
        return f"{path!r} is ambiguous or no whole path. Write it out: {' or '.join(same)}."
    return f"The model has no parameter or start value {path!r}.{suggestion(path, parameters)}"


def _limits(bounds: Any, unit: str, where: str, n: int) -> list[tuple[float, float, Scale]]:
    """The bounds of each of `n` numbers: a pair, or a pair of sequences of them; None where there are none."""
    if bounds is None:
        return [(-np.inf, np.inf, Scale(unit))] * n
    if isinstance(bounds, str) or not hasattr(bounds, "__len__") or len(bounds) != 2:
        raise ParameterError(f"{where}: bounds are a pair, such as (2.0, 20.0) or ('15 mm', '25 mm'); got {bounds!r}.")
    lows, highs = (_each(bound, where, n) for bound in bounds)
    limits = []
    for below, above in zip(lows, highs, strict=True):
        low, shown = (-np.inf, unit) if below is None else number_in(below, unit, where)
        high, other = (np.inf, unit) if above is None else number_in(above, unit, where)
        limits.append((low, high, scale_of(shown if shown != unit else other, unit, where)))
    return limits


def _each(bound: Any, where: str, n: int) -> list[Any]:
    if bound is None or isinstance(bound, str) or not np.ndim(getattr(bound, "magnitude", bound)):
        return [bound] * n
    if len(bound) != n:
        raise ParameterError(f"{where}: {len(bound)} bounds are given for {n} numbers.")
    return list(bound)


def _variable(known: Mapping[str, Any], places: tuple[Place, ...], low: float, high: float, scale: Scale) -> Variable:
    name = ", ".join(place.name for place in places)
    leaves = {path: leaf.value for path, leaf in known.items()}
    starts = [_number(leaves, place) for place in places]
    start = starts[0]
    if not low < high:
        raise ParameterError(f"{name}: the lower bound must be below the upper one, got {_span(low, high, scale)}.")
    for place in places:
        _check_range(place.name, known[place.path].declaration, low, high, scale)
    if any(other != start for other in starts):
        values = ", ".join(f"{place.name} = {value:g}" for place, value in zip(places, starts, strict=True))
        raise ParameterError(f"What shares a value must start from one: {values}. Set them by replace(model, ...).")
    found = Variable(name, places, known[places[0].path].declaration.unit, scale, low, high, start)
    found.checked(start)
    return found


def _number(leaves: Mapping[str, Any], place: Place) -> float:
    value = leaves[place.path]
    return float(value if place.element is None else value[place.element])


def _check_range(name: str, declaration: Declaration, low: float, high: float, scale: Scale) -> None:
    sign = declaration.sign
    if np.isinf(low) and np.isinf(high):
        return  # a trial outside of the range is a run that fails
    if sign is not None and not (sign.admits(low) and sign.admits(high) and (sign.name != "nonzero" or low * high > 0)):
        raise ParameterError(f"{name} must be {sign.name}, also at its bounds, got {_span(low, high, scale)}.")


def _span(low: float, high: float, scale: Scale) -> str:
    return f"{scale.value(low):g} to {scale.value(high):g}{scale.text}"
