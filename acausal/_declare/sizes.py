"""Nominal sizes of the variables of single components, where the sizes of their units do not fit."""

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
    """Nominal sizes by the path of a variable within a component; static, so that it can be hashed."""

    def __hash__(self) -> int:  # pyright: ignore[reportIncompatibleVariableOverride]
        return hash(frozenset(self.items()))


def sized(model: M, nominal: Mapping[str, object]) -> M:
    """The model with nominal sizes of variables, by path: `sized(model, {"c.v": 1e-5})`.

    A nominal size is what counts as 1 of a variable in error tolerances and in searches. It holds for all that is equal
    to the variable, be it as a derivative, as two speeds are of one angle, and per millisecond for its derivative. Of
    sizes given by a component and by one that holds it, the latter's count.

    Raises `ModelError` for a name that the model does not have, and for what is not a positive number.
    """
    sizes = Sizes(sizes_of(model))
    sizes.update(checked_sizes(model, as_sizes(nominal)))
    return copied(model, {"nominal": sizes})


def as_sizes(nominal: object) -> Sizes:
    """What the constructor of a component is given."""
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
    """Whether a name is that of a part of a leaf: `chain[3].w` of `chain.item.w` in an array of components, or `T[2]`
    of an array `T`.
    """
    pattern = r"(?:\.item|\[\d*\])".join(re.escape(piece) for piece in path.split(".item")) + r"(?:\[\d*\])*"
    return re.fullmatch(pattern, name) is not None


def _size(leaf: Leaf, value: object) -> float:
    unit = leaf.declaration.unit
    if is_traced(value):
        raise ModelError(f"nominal: the size of {leaf.path} must be a plain number, which is known before the run.")
    number = magnitude(value, unit, leaf.path)
    is_number = isinstance(number, int | float | np.number | np.ndarray | jax.Array) and np.ndim(number) == 0
    if not is_number or not 0.0 < float(number) < math.inf:
        raise ModelError(f"nominal: the size of {leaf.path} must be a positive number (unit {unit}), got {value!r}.")
    return float(number)


def sizes_of(node: Node) -> Mapping[str, float]:
    """What a component says of the sizes of its variables and of those of its parts."""
    sizes = vars(node).get("nominal")
    return sizes if isinstance(sizes, Sizes) else Sizes()


def says_sizes(node: Node) -> bool:
    """Whether a component or a part of it gives sizes."""
    return bool(sizes_of(node)) or any(says_sizes(part) for part in _parts(node))


def without_sizes(value: T) -> T:
    """A tree of nodes without what is said of sizes, so that components that differ by nothing else are alike."""
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
