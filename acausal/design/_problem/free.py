"""Free parameters of a model as a vector, in declared units or scaled between their bounds."""

import dataclasses
import functools as ft
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple, Self, TypeAlias, TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from ..._declare.by_name import arguments_of, replace, with_arguments
from ..._declare.component import Component
from ..._declare.fields import join
from ..._declare.node import Node, leaves_of, nodes_of
from ..._errors import ModelError, ParameterError, suggestion
from ..._reduce.jaxpr import slice_output
from ..._tracing import are_traced
from ..._units.display import Scale
from ..._units.quantity import magnitude
from .types import number_in


@dataclasses.dataclass(frozen=True, eq=False)
class Built:
    """A component to be built with other arguments, and the leaves that each of them determines."""

    path: str
    _node: Node
    determined: Mapping[str, frozenset[str]]  # paths in the component, by argument
    units: Mapping[str, str]  # of the arguments that are values of a parameter
    values: Mapping[str, float]  # of the arguments

    def leaves(self, arguments: Mapping[str, Any]) -> dict[str, Any]:
        """The leaves that some arguments determine, by path in the model."""
        made = with_arguments(self._node, arguments, self.path)
        names = frozenset().union(*(self.determined[name] for name in arguments))
        return {join(self.path, leaf.path): leaf.value for leaf in leaves_of(made) if leaf.path in names}


def built_parts(model: Component, paths: set[str]) -> dict[str, Built]:
    """The component of each path that names a numeric constructor argument. Other paths are left out."""
    nodes, found = dict(nodes_of(model)), {}
    for above in {path.rpartition(".")[0] for path in paths} & nodes.keys():
        names = {path.rpartition(".")[2]: path for path in paths if path.rpartition(".")[0] == above}
        leaves = {leaf.path for leaf in leaves_of(nodes[above])}
        given = arguments_of(nodes[above]) or {}
        values = {name: given[name] for name in names if name not in leaves and _is_number(given.get(name))}
        if values:
            made = _built(above, nodes[above], values)
            found |= {names[name]: made for name in values}
    return found


def _is_number(value: object) -> bool:
    number = magnitude(value, "")
    return isinstance(number, int | float | np.ndarray | jax.Array) and np.ndim(number) == 0 and number is not True


def _built(path: str, node: Node, values: Mapping[str, object]) -> Built:
    numbers = {name: float(magnitude(value, "")) for name, value in values.items()}
    leaves = [leaf for leaf in leaves_of(node) if leaf.value is not None]
    determined, units = {}, {}
    for name, number in numbers.items():
        of_argument = ft.partial(_values, node, path, name, [leaf.path for leaf in leaves])
        try:
            closed = jax.make_jaxpr(of_argument)(number)
        except (ModelError, jax.errors.TracerArrayConversionError, jax.errors.ConcretizationTypeError) as error:
            raise ModelError(
                f"{join(path, name)} cannot be varied: the constructor of {type(node).__name__} needs its value. Vary "
                "the parameters that it computes."
            ) from error
        own = [leaf for i, leaf in enumerate(leaves) if slice_output(closed, i).used]
        determined[name] = frozenset(leaf.path for leaf in own)
        equal = {leaf.declaration.unit for leaf in own if np.array_equal(leaf.value, number)}
        units[name] = equal.pop() if len(equal) == 1 else ""
    return Built(path, node, determined, units, numbers)


def _values(node: Node, path: str, name: str, leaves: list[str], value: Any) -> list[Any]:
    """The leaves of a node that is built with another argument."""
    made = {leaf.path: leaf.value for leaf in leaves_of(with_arguments(node, {name: value}, path))}
    return [made[leaf] for leaf in leaves]


M = TypeVar("M", bound=Component)
FloatVector: TypeAlias = Array | np.ndarray  # one number for each variable
DECADE = 10.0  # ratio of the bounds above which a variable is scaled logarithmically


class Place(NamedTuple):
    """Location of a number in a model: the path of a parameter or start value, and the indices of an element; or that
    of a constructor argument, and the component that is built with it.
    """

    path: str
    element: tuple[int, ...] | None = None
    built: Built | None = None

    @property
    def name(self) -> str:
        """The path, with the indices of an element."""
        return self.path if self.element is None else f"{self.path}[{','.join(map(str, self.element))}]"

    @property
    def determined(self) -> set[str]:
        """The paths of the parameters that a constructor argument determines."""
        above, _, name = self.path.rpartition(".")
        return set() if self.built is None else {join(above, path) for path in self.built.determined[name]}


class Variable(NamedTuple):
    """A free number at one or several places, with bounds in the declared unit.

    `size` is the unit of its scaled values if a bound is missing.
    """

    name: str
    places: tuple[Place, ...]
    unit: str
    scale: Scale
    low: float
    high: float
    start: float
    size: float = 1.0

    def checked(self, value: float) -> float:
        """The value. Raises `ParameterError` if it is outside the bounds."""
        if not self.low <= value <= self.high:
            raise ParameterError(
                f"{self.name} is {self.text(value)}, outside its bounds "
                f"{span_text(self.low, self.high, self.scale)}. Widen them, or choose another value."
            )
        return value

    def text(self, value: float) -> str:
        """A value in its display unit."""
        return f"{self.scale.value(value):.6g}{self.scale.text}"

    @property
    def is_open(self) -> bool:
        """Whether a bound is missing."""
        return not np.isfinite(self.high - self.low)

    @property
    def is_log(self) -> bool:
        """Whether the variable is scaled logarithmically."""
        return self.low > 0.0 and np.isfinite(self.high) and self.high > DECADE * self.low

    @property
    def origin_and_width(self) -> tuple[float, float]:
        """The value that is scaled to 0, and its distance to the value that is scaled to 1; logarithms if `is_log`."""
        if self.is_log:
            return float(np.log(self.low)), float(np.log(self.high / self.low))
        return (self.start, self.size) if self.is_open else (self.low, self.high - self.low)


@dataclasses.dataclass(frozen=True)
class Free:
    """The free parameters of a model, in the order in which the user named them.

    Vectors `x` hold values in the declared units, vectors `z` scaled values; both can be traced.
    """

    variables: tuple[Variable, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the variables."""
        return tuple(variable.name for variable in self.variables)

    @property
    def units(self) -> tuple[str, ...]:
        """The declared units."""
        return tuple(variable.unit for variable in self.variables)

    @property
    def low(self) -> Float[np.ndarray, " n"]:
        """The lower bounds in the declared units."""
        return np.array([variable.low for variable in self.variables])

    @property
    def high(self) -> Float[np.ndarray, " n"]:
        """The upper bounds in the declared units."""
        return np.array([variable.high for variable in self.variables])

    @property
    def is_open(self) -> np.ndarray:
        """Marks the variables that lack a bound."""
        return np.array([variable.is_open for variable in self.variables])

    @property
    def open_groups(self) -> list[list[int]]:
        """Positions of the variables that lack a bound, grouped by array."""
        groups: dict[str, list[int]] = {}
        for i, variable in enumerate(self.variables):
            if variable.is_open:
                groups.setdefault(variable.places[0].path, []).append(i)
        return list(groups.values())

    def with_sizes(self, sizes: Mapping[int, float]) -> Self:
        """A copy with other sizes of variables that lack a bound, by position."""
        variables = tuple(v._replace(size=sizes.get(i, v.size)) for i, v in enumerate(self.variables))
        return dataclasses.replace(self, variables=variables)

    def values(self, model: Component) -> Float[np.ndarray, " n"]:
        """The values in a model."""
        leaves = {leaf.path: leaf.value for leaf in leaves_of(model)}
        return np.array([number_at(leaves, variable.places[0]) for variable in self.variables])

    def with_values(self, model: M, x: FloatVector | Sequence[float]) -> M:
        """A copy of the model with other values, which can be traced."""
        return with_numbers(model, [variable.places for variable in self.variables], x)

    def text(self, x: FloatVector) -> str:
        """Names and values, such as "load.m = 3 kg". Values beyond the variables are ignored."""
        shown = (
            (v.name, f"{v.scale.value(value):.6g}{v.scale.text}") for v, value in zip(self.variables, x, strict=False)
        )
        return ", ".join(f"{name} = {value}" for name, value in shown)

    def changed(self, x: FloatVector, values: Mapping[str, object]) -> np.ndarray:
        """A copy of the values with some changed, by name."""
        new = np.array(x, float)
        for name, value in values.items():
            if name not in self.names:
                raise ModelError(f"{name!r} is not a free parameter.{suggestion(name, self.names)}")
            i = self.names.index(name)
            new[i] = self.variables[i].checked(number_in(value, self.units[i], name)[0])
        return new

    def scaled(self, x: FloatVector) -> Array:
        """Values from 0 at the lower to 1 at the upper bound, linear or, over more than a decade, logarithmic.

        Without both bounds: the distance from the start, divided by the size.
        """
        origin, width = self._origin_and_width
        return (jnp.where(self._is_log, jnp.log(jnp.where(self._is_log, x, 1.0)), x) - origin) / width

    def unscaled(self, z: FloatVector) -> Array:
        """The inverse of `scaled`."""
        origin, width = self._origin_and_width
        straight = origin + width * z
        return jnp.where(self._is_log, jnp.exp(jnp.where(self._is_log, straight, 0.0)), straight)

    def slopes(self, x: FloatVector) -> Array:
        """dx/dz, the derivatives with respect to scaled values."""
        _, width = self._origin_and_width
        return jnp.where(self._is_log, x, 1.0) * width

    @property
    def _is_log(self) -> np.ndarray:
        return np.array([variable.is_log for variable in self.variables])

    @property
    def _origin_and_width(self) -> tuple[np.ndarray, np.ndarray]:
        origins, widths = zip(*(variable.origin_and_width for variable in self.variables), strict=True)
        return np.array(origins), np.array(widths)


def with_numbers(model: M, places: Iterable[Sequence[Place]], x: FloatVector | Sequence[float]) -> M:
    """A copy of the model with other values, each at one or several places."""
    leaves = {leaf.path: leaf.value for leaf in leaves_of(model)}
    changed: dict[str, object] = {}
    arguments: dict[Built, dict[str, Any]] = {}
    for own, value in zip(places, x, strict=True):
        for path, index, built in own:
            if built is not None:
                arguments.setdefault(built, {})[path.rpartition(".")[2]] = value
                continue
            whole = changed.get(path, leaves[path])
            changed[path] = value if index is None else _with_element(whole, index, value)
    for built, given in arguments.items():
        changed = built.leaves(given) | changed
    return replace(model, changed)


def _with_element(whole: Any, index: tuple[int, ...], value: Any) -> Any:
    if are_traced(whole, value):
        return jnp.asarray(whole, float).at[index].set(value)
    # jax would dispatch a program for each element of a large array.
    changed = np.array(whole, float)
    changed[index] = value
    return changed


def number_at(leaves: Mapping[str, Any], place: Place) -> float:
    if place.built is not None:
        return place.built.values[place.path.rpartition(".")[2]]
    value = leaves[place.path]
    return float(value if place.element is None else value[place.element])


def span_text(low: float, high: float, scale: Scale) -> str:
    return f"{scale.value(low):g} to {scale.value(high):g}{scale.text}"
