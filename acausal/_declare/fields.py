"""The fields of nodes and of their classes."""

import dataclasses
import functools as ft
from collections.abc import Iterator, Mapping
from typing import Any, TypeVar

import jax

from .annotations import Declaration
from .arguments import given_arguments, remember_arguments

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
