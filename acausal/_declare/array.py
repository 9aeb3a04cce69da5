"""Arrays of components: one instance with stacked leaves."""

from collections.abc import Iterator, Sequence
from typing import Any, Generic, TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import PyTree

from .._errors import ModelError, UnknownPartError
from .._numbers import Numbers
from .._tracing import is_traced
from .component import Component
from .layout import as_new, rebuilt
from .node import Leaf, Node, leaves_of

C = TypeVar("C", bound=Component)
T = TypeVar("T")


class Array(Component, Generic[C]):
    """`n` components of one class; `item` holds their stacked leaves. Made by `repeat` or `stack`.

    `parts[i]`, `parts[1:]` and `parts[:]` select members, mainly in `connections`:
    `connect(self.inertias[:-1].b, self.springs[:].a)` joins member by member.
    """

    item: C
    n: int
    axis: int = 0

    def __getitem__(self, index: int | slice) -> C:
        where = (slice(None),) * self.axis + (self._within(index),)
        return jax.tree_util.tree_map(lambda leaf: leaf if isinstance(leaf, float) else leaf[where], self.item)

    def _within(self, index: Any) -> Any:
        """A valid index. jax, which traces equations, would clip an index beyond the last part."""
        if not isinstance(index, slice) and not is_traced(index):
            try:
                np.arange(self.n)[index]
            except IndexError as error:
                text = f"An array of {self.n} parts of the class {type(self.item).__name__} has none at [{index}]: "
                raise UnknownPartError(f"{text}they are [0] to [{self.n - 1}], or [-{self.n}] to [-1].") from error
        return index

    def __iter__(self) -> Iterator[C]:
        return (self[i] for i in range(self.n))

    def __len__(self) -> int:
        return self.n

    def _shown(self) -> tuple[str, Node]:
        return f"{self.n} × {type(self.item).__name__}", self.item


def deepened(tree: T, by: int) -> T:
    """A tree in which arrays of components have `by` more leading axes."""

    def deepen(node: PyTree) -> PyTree:
        if not isinstance(node, Array):
            return node
        return Array(item=deepened(node.item, by), n=node.n, axis=node.axis + by)

    return jax.tree_util.tree_map(deepen, tree, is_leaf=lambda node: isinstance(node, Array))


def repeat(part: C, n: int) -> Array[C]:
    """An array of `n` components like `part`.

    All members share a parameter of `part`, unless it has a leading axis of length `n` before its declared shape:
    `repeat(Inertia(J=jnp.linspace(1.0, 2.0, 5)), 5)`.
    """
    if not isinstance(part, Component) or not isinstance(n, int | np.integer) or n < 0:
        raise ModelError(f"repeat(part, n) takes a component and the number of copies, got repeat({part!r}, {n!r}).")
    part = as_new(part)
    structure = jax.tree_util.tree_structure(part)
    item = structure.unflatten([_stacked(leaf, n) for leaf in leaves_of(part) if leaf.value is not None])
    return Array(item=deepened(item, 1), n=n)


def _stacked(leaf: Leaf, n: int) -> Numbers:
    shape = jnp.shape(leaf.value)
    if isinstance(leaf.value, float) or (leaf.sizes is not None and shape == (n, *leaf.sizes)):
        return leaf.value
    return jnp.broadcast_to(leaf.value, (n, *shape))


def stack(parts: Sequence[C]) -> Array[C]:
    """An array of the given components, which must have one class and structure.

    If only some of them give a start value, the others use the default of their class.
    """
    parts = [as_new(part) for part in parts]
    if len({jax.tree_util.tree_structure(part) for part in parts}) > 1:
        parts = [rebuilt(part, lambda _, declared, value: declared.start if value is None else value) for part in parts]
    if len({jax.tree_util.tree_structure(part) for part in parts}) != 1:
        raise ModelError("stack(...) needs components of one class, with the same static fields and parts.")
    return Array(item=deepened(jax.tree_util.tree_map(_stack_leaf, *parts), 1), n=len(parts))


def _stack_leaf(*values: Numbers) -> Numbers:
    if all(isinstance(value, float) and value == values[0] for value in values):
        return values[0]
    return (np if all(isinstance(value, float) for value in values) else jnp).stack(values)
