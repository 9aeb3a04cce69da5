"""Nominal sizes of variables: given, declared, or the default of the unit."""

import numpy as np

from .aliases import ZERO, Merged
from .flat_model import FlatLeaf, FlatModel
from .graph import connected

# Defaults for machines of 0.1 m to 2 m, to within a factor of ten. Error tolerances are
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
    """The nominal size given by the model, otherwise the declared one, otherwise that of the unit, otherwise 1."""
    if leaf.nominal is not None:
        return leaf.nominal
    declaration = leaf.declaration
    return BY_UNIT.get(declaration.unit, 1.0) if declaration.nominal is None else declaration.nominal


def nominal_sizes(flat: FlatModel, merged: Merged, variables: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The nominal size of each variable, identified by its representative node, and of its derivative.

    A size that the model gives for an alias has priority over one that a class declares, and that over the size of the
    unit. If several are given, the smallest counts; if several are declared, that of the representative. A given size
    also applies to all variables that equations state to be equal, such as two speeds that are the derivative of one
    angle. Other derivatives have the nominal size per millisecond.
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
    rates, given = 1e3 * known, np.zeros(flat.n_nodes, bool)
    given[merged.representative[order[said[order] == 2]]] = True
    if np.any(given):
        alike = _alike(flat, merged)
        least = np.full(2 * flat.n_nodes, np.inf)
        np.minimum.at(least, alike[: flat.n_nodes][given], known[given])
        own, of_rates = least[alike].reshape(2, -1)
        known = np.where(np.isfinite(own), own, known)
        rates = np.where(np.isfinite(of_rates), of_rates, 1e3 * known)
    return known[variables], rates[variables]


def _alike(flat: FlatModel, merged: Merged) -> np.ndarray:
    """The set number of each node and then of each derivative. A set contains the nodes that single equations and their
    derivatives state to be equal up to the sign, except zero ones.
    """
    n, edges = flat.n_nodes, [np.zeros((0, 2), int)]
    for family in merged.families:
        form, terms = family.template.form, list(family.template.form.terms)
        orders = np.array([family.template.inputs[i].order for i in terms], int)
        numbers = {None if c.number is None else abs(c.number) for c in form.terms.values()}
        if form.nonlinear or form.has_rest or None in numbers or len(numbers) != 1 or np.max(orders) > 1:
            continue
        nodes = family.nodes[:, terms]
        is_left = nodes != ZERO
        nodes, is_left = (
            x[(is_left.sum(axis=1) == 2) & np.all((nodes >= 0) | ~is_left, axis=1)] for x in (nodes, is_left)
        )
        pairs = nodes[is_left].reshape(-1, 2)
        places = np.broadcast_to(orders, nodes.shape)[is_left].reshape(-1, 2)
        edges += [pairs + n * places, pairs[np.all(places == 0, axis=1)] + n]
    return connected(np.concatenate(edges), 2 * n)[1]
