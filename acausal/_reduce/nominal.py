"""Typical sizes of variables: given, declared, or by unit."""

from typing import TYPE_CHECKING

import numpy as np

from .flatten import FlatLeaf, FlatModel

if TYPE_CHECKING:
    from .aliases import Merged

# Machinery between the size of a hand and of a person: an engineer's guess, to a factor of ten. Error tolerances are
# relative to the larger of a variable and this size.
BY_UNIT = {
    "rad": 1.0,
    "rad/s": 10.0,
    "N.m": 1.0,
    "m": 1e-2,
    "m/s": 0.1,
    "N": 100.0,
    "V": 1.0,
    "A": 1.0,
    "C": 1e-3,
    "Wb": 1e-2,
    "Pa": 1e5,
    "m3": 1e-6,
    "m3/s": 1e-5,
    "K": 100.0,
    "W": 10.0,
    "J": 1.0,
}


def nominal_size(leaf: FlatLeaf) -> float:
    """The nominal size that the model gives, else the declared one, else that of the unit, else 1."""
    if leaf.nominal is not None:
        return leaf.nominal
    declaration = leaf.declaration
    return BY_UNIT.get(declaration.unit, 1.0) if declaration.nominal is None else declaration.nominal


def nominal_sizes(flat: FlatModel, merged: "Merged", variables: np.ndarray) -> np.ndarray:
    """The nominal size of each variable, known by its representative node.

    What the model says of one of its aliases comes before what a class declares of one, and that before the size of the
    unit; among several, the smallest given one, or what the class of the representative itself declares.
    """
    leaves = [flat.leaves[i] for i in flat.variable_leaves]
    counts = [leaf.count for leaf in leaves]
    size = np.repeat([nominal_size(leaf) for leaf in leaves], counts)
    said = [2 if leaf.nominal is not None else leaf.declaration.nominal is not None for leaf in leaves]
    said = np.repeat(np.array(said, int), counts)
    is_own = merged.representative == np.arange(flat.n_nodes)
    order = np.lexsort((np.where(said == 2, -size, is_own), said))
    known = np.ones(flat.n_nodes)
    order = order[merged.representative[order] >= 0]
    known[merged.representative[order]] = size[order]
    return known[variables]
