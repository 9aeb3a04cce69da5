"""The fields of nodes and of their classes, and the arguments of constructors that fill them."""

import dataclasses
import functools as ft
import inspect
import math
import weakref
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from .._errors import ArgumentError, ParameterError, suggestion
from .._numbers import Numbers
from .._units.quantity import magnitude
from .annotations import Declaration


def check_arguments(cls: type, args: Sequence[object], kwargs: Mapping[str, object]) -> None:
    """Raise `ArgumentError` for unknown and missing arguments of a constructor."""
    takes = _parameters(cls)
    if takes is None:
        return
    if args:
        raise ArgumentError(f"{cls.__name__} takes its arguments by name only: {_listed(takes)}.")
    for name in kwargs:
        if name not in takes:
            answer = known_here(cls, name) or suggestion(name, takes)
            raise ArgumentError(f"{cls.__name__} takes no argument {name!r}.{answer} It takes {_listed(takes)}.")
    missing = [name for name, is_needed in takes.items() if is_needed and name not in kwargs]
    if missing:
        raise ArgumentError(f"{cls.__name__} lacks {', '.join(missing)}. It takes {_listed(takes)}.")


def known_here(cls: type, name: str) -> str:
    """A sentence that gives the name here for a name in another library; empty if the class states none."""
    here = getattr(cls, "elsewhere", {}).get(name)
    return f" Here it is {here}." if here else ""


def _listed(takes: Mapping[str, bool]) -> str:
    """Required arguments first, then optional ones, then `nominal`."""
    ordered = sorted(takes, key=lambda name: (not takes[name], name == "nominal"))
    return ", ".join(name if takes[name] else f"[{name}]" for name in ordered) or "none"


@ft.cache
def _parameters(cls: type) -> dict[str, bool] | None:
    """The names of the arguments and whether each is required; None if they can be positional."""
    found = list(inspect.signature(cls.__init__).parameters.values())[1:]
    if any(parameter.kind is not inspect.Parameter.KEYWORD_ONLY for parameter in found):
        return None
    return {parameter.name: parameter.default is inspect.Parameter.empty for parameter in found}


def argument_names(cls: type) -> frozenset[str]:
    """The names of the arguments of a constructor."""
    return frozenset(_parameters(cls) or ())


@ft.cache
def computes_fields(cls: type) -> bool:
    """Whether a constructor takes other arguments than the fields, and computes these."""
    return argument_names(cls) != {field.name for field in dataclasses.fields(cls) if field.init}


# The arguments of nodes by their identity: equinox counts the attributes of an object, so they cannot be one.
_GIVEN: dict[int, tuple[weakref.ref[object], Mapping[str, object]]] = {}


def remember_arguments(node: object, arguments: Mapping[str, object]) -> None:
    """Keep the constructor arguments of a node as long as it lives. Transformations of jax and files do not."""
    key = id(node)
    _GIVEN[key] = weakref.ref(node, lambda _: _GIVEN.pop(key, None)), dict(arguments)


def given_arguments(node: object) -> Mapping[str, object] | None:
    """The arguments with which a node was built; None if they are lost."""
    found = _GIVEN.get(id(node))
    return found[1] if found is not None and found[0]() is node else None


def as_parameter(value: Any, *, unit: str, where: str) -> Array:
    """An array of floats in double precision, in `unit`; an integer would break differentiation.

    Raises `ParameterError` for anything except real numbers, arrays of them, and texts such as "15 mm".
    """
    value = magnitude(value, unit, where)
    if isinstance(value, float | int):
        return jnp.asarray(np.asarray(value, float))  # as NumPy's, it needs no program of XLA
    if value is None or any(isinstance(item, str) for item in jax.tree_util.tree_leaves(value)):
        raise _not_a_number(value, where)
    try:
        array = jnp.asarray(value)
    except (TypeError, ValueError) as error:
        raise _not_a_number(value, where) from error
    if jnp.iscomplexobj(array):
        raise _not_a_number(value, where)
    return array.astype(float)


def _not_a_number(value: object, where: str) -> ParameterError:
    return ParameterError(f"{where} must be a real number or an array of them, got {value!r}.")


def as_start(value: Any, *, unit: str, where: str) -> Numbers | None:
    """A start value. A float stays one: `eqx.filter_grad` skips start values unless they are given as arrays."""
    if value is None:
        return None
    value = magnitude(value, unit, where)
    return float(value) if isinstance(value, bool | int | float) else as_parameter(value, unit=unit, where=where)


@dataclasses.dataclass(frozen=True)
class Converter:
    """Conversion of the value of one field."""

    convert: Callable[..., object]
    unit: str
    where: str

    # Equinox reads the signature of each converter. To derive it from the code would take a third of the time to create
    # a class.
    __signature__ = inspect.Signature([inspect.Parameter("value", inspect.Parameter.POSITIONAL_ONLY)])

    def __call__(self, value: object) -> object:
        return self.convert(value, unit=self.unit, where=self.where)


CONVERTERS = {"param": as_parameter, "var": as_start, "flow": as_start, "time": as_start, "discrete": as_start}


def plain_number(kind: type) -> Callable[[Any], Any] | None:
    """A converter for fields annotated as plain numbers; None for others.

    Models are cached by their static fields, where 1, 1.0 and True are equal, as are 0.0 and -0.0. So the converter
    turns an equal number into one of the annotated type.
    """
    if kind not in (bool, int, float):
        return None

    def converted(value: Any) -> Any:
        if type(value) not in (bool, int, float) or not math.isfinite(value):
            return value
        return kind(value + 0) if kind(value) == value else value

    return converted


T = TypeVar("T")


def dynamic_fields(cls: type) -> tuple[tuple[str, Declaration | None], ...]:
    """Names of the leaves and parts of a class in pytree order: a leaf with its declaration, a part with None."""
    return _dynamic_fields(cls)  # type checkers would refuse unhashable instances here


@ft.cache
def _dynamic_fields(cls: Any) -> tuple[tuple[str, Declaration | None], ...]:
    fields = [f for f in dataclasses.fields(cls) if not f.metadata.get("static") and not f.metadata.get("is_past")]
    return tuple((field.name, field.metadata.get("declaration")) for field in fields)


def join(path: str, name: str) -> str:
    return f"{path}.{name}" if path else name


def copied(node: T, changes: Mapping[str, object]) -> T:
    """A copy of a node with other values of some fields, without the checks and conversions of its constructor."""
    copy = object.__new__(type(node))
    for name, value in {**vars(node), **changes}.items():
        object.__setattr__(copy, name, value)
    if (given := given_arguments(node)) is not None:
        remember_arguments(copy, given)
    return copy


class FromOne(tuple):
    """Parts that are counted from 1, as in Modelica: `model.cell[1]` is the first."""

    def __getitem__(self, index: Any) -> Any:
        if isinstance(index, slice):
            raise IndexError("parts that are counted from 1 have no slices.")
        if not 1 <= index <= len(self):
            raise IndexError(f"these parts are counted from 1 to {len(self)}; got [{index}].")
        return super().__getitem__(index - 1)


jax.tree_util.register_pytree_with_keys(
    FromOne,
    lambda parts: ([(jax.tree_util.SequenceKey(i), part) for i, part in enumerate(parts, start=1)], None),
    lambda _, parts: FromOne(parts),
)


def first_index(parts: object) -> int:
    """The index of the first of several parts: 1 for those of a Modelica model."""
    return 1 if isinstance(parts, FromOne) else 0


def parts_of(value: object, path: str = "") -> Iterator[tuple[str, Any]]:
    """The nodes in a field: the value itself, or the members of its tuples, each with its path."""
    if isinstance(value, tuple | list):
        for index, item in enumerate(value, start=first_index(value)):
            yield from parts_of(item, f"{path}[{index}]")
    elif value is not None:
        yield path, value
