"""Typical sizes of variables: given, declared, or by unit."""

import numpy as np

from .aliases import ZERO, Merged
from .flat_model import FlatLeaf, FlatModel
from .graph import connected

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


def nominal_sizes(flat: FlatModel, merged: Merged, variables: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The nominal size of each variable, known by its representative node, and of its derivative.

    What the model says of one of its aliases comes before what a class declares of one, and that before the size of the
    unit; among several, the smallest given one, or what the class of the representative itself declares. What the model
    says holds, too, for all that equations state to be equal, as two speeds are that are the derivative of one angle.
    Other derivatives are as large over a typical time of a millisecond.
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
    """For all nodes and then their derivatives, the number of the set that each is in. In one set are those that single
    equations, and their derivatives, state to be equal up to the sign, but for what is zero.
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
