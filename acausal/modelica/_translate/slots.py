"""The slots of terms, and the leaves that hold previous values."""

import dataclasses
import re
from collections.abc import Mapping

import jax.numpy as jnp

from .leaves import ModelLeaf
from .terms import SlotValue


class Slots:
    """The leaves that a term reads, in the order of their slots."""

    def __init__(self) -> None:
        self.leaves: list[ModelLeaf] = []
        self._places: dict[str, int] = {}

    def slot(self, leaf: ModelLeaf) -> SlotValue:
        if leaf.path not in self._places:
            self._places[leaf.path] = len(self.leaves)
            self.leaves.append(leaf)
        return SlotValue(self._places[leaf.path], leaf.kind, leaf.is_discrete or leaf.role == "param")


class Previous:
    """The leaves that hold the values of `pre`. `leaves` are those of the model, whose names are taken."""

    def __init__(self, leaves: Mapping[str, ModelLeaf]) -> None:
        self.of: dict[str, ModelLeaf] = {}
        self._leaves = leaves

    def leaf(self, leaf: ModelLeaf) -> ModelLeaf:
        """The discrete leaf for `pre` of a leaf."""
        if leaf.path not in self.of:
            head, dot, last = _without_port(leaf).rpartition(".")
            start = leaf.guess if leaf.value is None else leaf.value
            start = jnp.broadcast_to(jnp.asarray(start, float), leaf.dims)
            path = f"{head}{dot}pre_{last}"
            while path in self._leaves:
                path += "_"
            self.of[leaf.path] = dataclasses.replace(
                leaf,
                path=path,
                role="discrete",
                is_discrete=True,
                value=start,
                is_followed=False,
                in_port=False,
                variable=None,
                of=leaf,
            )
        return self.of[leaf.path]


def _without_port(leaf: ModelLeaf) -> str:
    """A path for a leaf that belongs to no port: a port has no variables besides those of its class."""
    return re.sub(r"\W+", "_", leaf.path) if leaf.in_port else leaf.path
