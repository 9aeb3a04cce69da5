"""Nominal sizes of the variables of single components, in place of the defaults of their units."""

import math
import re
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, TypeVar

import jax
import numpy as np

from .._errors import ModelError, suggestion
from .._tracing import is_traced
from .._units.quantity import magnitude
from .fields import copied, dynamic_fields, parts_of
from .node import Leaf, Node, leaves_of

if TYPE_CHECKING:
    from .component import Component

M = TypeVar("M", bound="Component")
T = TypeVar("T")


class Sizes(dict[str, float]):
    """Nominal sizes by the path of a variable within a component. Static, so it has a hash."""

    def __hash__(self) -> int:  # pyright: ignore[reportIncompatibleVariableOverride]
        return hash(frozenset(self.items()))


def sized(model: M, nominal: Mapping[str, object]) -> M:
    """A copy of the model with nominal sizes of variables, by path: `sized(model, {"c.v": 1e-5})`.

    Error tolerances and searches measure a variable in units of its nominal size. The size also applies to all
    variables that are equal to it, even as derivatives, such as two speeds of one angle, and per millisecond to its
    derivative. The size given by the outer component has priority.

    Raises `ModelError` for an unknown name, and for a size that is not a positive number.
    """
    sizes = Sizes(sizes_of(model))
    sizes.update(checked_sizes(model, as_sizes(nominal)))
    return copied(model, {"nominal": sizes})


def as_sizes(nominal: object) -> Sizes:
    """Conversion of the argument `nominal` of a component."""
    if not isinstance(nominal, Mapping):
        raise ModelError(f"nominal={nominal!r} is not a dictionary of sizes by name, such as nominal=dict(v=1e-5).")
    return Sizes(nominal)


def checked_sizes(node: Node, nominal: Mapping[str, object]) -> Sizes:
    """The sizes by the paths of variables, as numbers in their units."""
    known = {leaf.path: leaf for leaf in leaves_of(node) if leaf.declaration.is_variable}
    return Sizes({(leaf := _named(name, known)).path: _size(leaf, value) for name, value in nominal.items()})


def _named(name: str, known: dict[str, Leaf]) -> Leaf:
    if name in known:
        return known[name]
    for path, leaf in known.items():
        if _is_member(name, path):
            return leaf
    raise ModelError(f"nominal: the model has no variable {name!r}.{suggestion(name, known)}")


def _is_member(name: str, path: str) -> bool:
    """Whether a name stands for a part of a leaf: `chain[3].w` of `chain.item.w` in an array of components, or `T[2]`
    of an array `T`.
    """
    pattern = r"(?:\.item|\[\d*\])".join(re.escape(piece) for piece in path.split(".item")) + r"(?:\[[\d,]*\])*"
    return re.fullmatch(pattern, name) is not None


def _size(leaf: Leaf, value: object) -> float:
    unit = leaf.declaration.unit
    if is_traced(value):
        raise ModelError(f"nominal: the size of {leaf.path} must be a plain number, known before the run.")
    number = magnitude(value, unit, leaf.path)
    is_number = isinstance(number, int | float | np.number | np.ndarray | jax.Array) and np.ndim(number) == 0
    if not is_number or not 0.0 < float(number) < math.inf:
        raise ModelError(f"nominal: the size of {leaf.path} must be a positive number (unit {unit}), got {value!r}.")
    return float(number)


def sizes_of(node: Node) -> Mapping[str, float]:
    """The nominal sizes that a component sets for its variables and those of its parts."""
    sizes = vars(node).get("nominal")
    return sizes if isinstance(sizes, Sizes) else Sizes()


def says_sizes(node: Node) -> bool:
    """Whether a component or one of its parts sets nominal sizes."""
    return bool(sizes_of(node)) or any(says_sizes(part) for part in _parts(node))


def without_sizes(value: T) -> T:
    """A tree of nodes without nominal sizes, so that components that differ only in them are equal."""
    if isinstance(value, tuple | list):
        return type(value)(without_sizes(item) for item in value)
    if not isinstance(value, Node):
        return value
    parts = [name for name, declaration in dynamic_fields(type(value)) if declaration is None]
    plain = {name: without_sizes(getattr(value, name)) for name in parts}
    return copied(value, plain | {name: Sizes() for name, field in vars(value).items() if isinstance(field, Sizes)})


def _parts(node: Node) -> Iterator[Node]:
    for name, declaration in dynamic_fields(type(node)):
        if declaration is None:
            yield from (part for _, part in parts_of(getattr(node, name)) if isinstance(part, Node))
