"""Elimination of aliases: variables that are equal up to a sign become one. Sources are connected across variables,
flows of connections of two ports, and equations `a = b` or `a = -b` of components.
"""

import dataclasses
from collections.abc import Iterator, Set

import numpy as np
from jaxtyping import Int

from .._errors import ModelError, StructureError, complain
from .class_equations import templates
from .flat_model import FlatLeaf, FlatModel, Instances, reference_of
from .template import Template, sum_template

ZERO = -2  # the representative of a node that is identically zero
TIME = -3  # the representative of a node that is the simulation time


@dataclasses.dataclass
class Family:
    """All uses of one equation template: a row for each, with the node of every input (-1: a parameter).

    Sums of flows and combinations of equations belong to no instances. Combinations have `names` instead.
    """

    template: Template
    instances: Instances | None
    members: Int[np.ndarray, " rows"]  # instance of each row; the connection set for flow sums
    nodes: Int[np.ndarray, "rows inputs"]
    signs: Int[np.ndarray, "rows inputs"]
    names: list[str] | None = None

    def name(self, row: int, flat: FlatModel) -> str:
        """The path of the component and the name of the equation."""
        if self.names is not None:
            return self.names[row]
        if self.instances is None:
            ports = ", ".join(flat.node_name(int(n)).rpartition(".")[0] for n in flat.flow_sets[self.members[row]][0])
            return f"sum of flows at the connection of {ports}"
        path = self.instances.name(int(self.members[row]))
        return f"{path}.{self.template.name}" if path else self.template.name

    def leaves(self, row: int, flat: FlatModel) -> list[FlatLeaf]:
        """The leaves of the component that states the equation, or of the ports whose flows it sums."""
        if self.names is not None:
            return []
        if self.instances is None:
            return [flat.leaves[flat.leaf_of_node[node]] for node in flat.flow_sets[self.members[row]][0]]
        return [flat.leaves[leaf] for leaf in self.instances.own_leaves[0]]

    def select(self, rows: np.ndarray) -> "Family":
        names = None if self.names is None else [self.names[row] for row in rows.tolist()]
        return Family(self.template, self.instances, self.members[rows], self.nodes[rows], self.signs[rows], names)


@dataclasses.dataclass
class Merged:
    """The remaining equations and, for every node, its representative and sign."""

    families: list[Family]
    representative: Int[np.ndarray, " nodes"]
    sign: Int[np.ndarray, " nodes"]


class _Sets:
    """Union-find with signs: node = sign * root. A set that contains x = -x is zero."""

    def __init__(self, n: int) -> None:
        self.parent = list(range(n))
        self.sign = [1] * n
        self.zero = [False] * n

    def find(self, node: int) -> tuple[int, int]:
        path, sign = [], 1
        while self.parent[node] != node:
            path.append(node)
            node = self.parent[node]
        for item in reversed(path):
            sign *= self.sign[item]
            self.parent[item], self.sign[item] = node, sign
        return node, sign

    def join(self, a: int, b: int, sign: int) -> bool:
        """State a = sign * b; False if this was known already."""
        (root_a, sign_a), (root_b, sign_b) = self.find(a), self.find(b)
        relative = sign_a * sign * sign_b
        if root_a == root_b:
            news = relative < 0 and not self.zero[root_a]
            self.zero[root_a] |= relative < 0
            return news
        news = not (self.zero[root_a] and self.zero[root_b])
        first, second = min(root_a, root_b), max(root_a, root_b)
        self.parent[second], self.sign[second] = first, relative
        self.zero[first] |= self.zero[second]
        return news

    def vanish(self, a: int) -> bool:
        root, _ = self.find(a)
        news = not self.zero[root]
        self.zero[root] = True
        return news


def merge(flat: FlatModel) -> Merged:
    """Eliminate the trivial equations.

    Raises `StructureError` for a redundant equation.
    """
    sets = _Sets(flat.n_nodes)
    for a, b in flat.across.tolist():
        sets.join(a, b, 1)
    families = _without_aliases(flat, [*_flow_families(flat, sets), *component_families(flat)], sets)
    representative, sign = _resolved(flat, sets)
    for family in families:
        inner = family.nodes >= 0
        nodes = np.where(inner, family.nodes, 0)
        family.signs = np.where(inner, family.signs * sign[nodes], 1)
        family.nodes = np.where(inner, representative[nodes], -1)
    return Merged(families, representative, sign)


def _without_aliases(flat: FlatModel, families: list[Family], sets: _Sets) -> list[Family]:
    """The families that are not aliases. A zero factor can turn other families into aliases, so the search repeats."""
    kept = []
    for family in families:
        if family.instances is None or not _is_alias(family.template):
            kept.append(family)
            continue
        repeated = [row for row in range(len(family.members)) if not _join_alias(family, row, sets)]
        if repeated:
            names = ", ".join(family.name(row, flat) for row in repeated[:5])
            complain(StructureError(f"The equation {names} only repeats {_repeated(family, repeated[0], flat)}"))
    zero = np.array([sets.zero[sets.find(node)[0]] for node in range(flat.n_nodes)], dtype=bool)
    parts = [part for family in kept for part in by_zero_factors(family, zero)]
    is_same = {part.template for part in parts} <= {family.template for family in kept}
    return kept if is_same else _without_aliases(flat, parts, sets)


def by_zero_factors(family: Family, zero: np.ndarray) -> Iterator[Family]:
    """Splits a family by its inputs that are zero, if these are factors of other inputs."""
    form = family.template.form
    vanish = (family.nodes >= 0) & zero[family.nodes]
    if not vanish.any() or not (form.nonlinear or any(coefficient.on for coefficient in form.terms.values())):
        yield family
        return
    patterns, pattern = np.unique(vanish, axis=0, return_inverse=True)
    for index, positions in enumerate(patterns):
        part = family.select(np.flatnonzero(pattern.ravel() == index))
        yield dataclasses.replace(part, template=family.template.with_zeros(np.flatnonzero(positions).tolist()))


def _repeated(family: Family, row: int, flat: FlatModel) -> str:
    """The content that a redundant equation repeats, and the remedy."""
    if unconnected := [flat.node_name(node) for node in family.nodes[row].tolist() if node in flat.unconnected]:
        ports = ", ".join(name.rpartition(".")[0] for name in unconnected)
        return f"that the flow is zero at {ports}, which has no connection. Remedy: connect it."
    return (
        "other equations. Either its circuit has no reference: connect "
        f"{reference_of(family.leaves(row, flat))} to it. Or two ideal elements that fix a value or join two ports "
        "are in parallel: remove one, or give it a resistance or compliance."
    )


def _is_alias(template: Template) -> bool:
    form = template.form
    coefficients = list(form.terms.values())
    return (
        not form.nonlinear
        and not form.has_rest
        and len(coefficients) in (1, 2)
        and all(c.number is not None and c.number != 0 and c.elementwise for c in coefficients)
        and len({abs(c.number or 0.0) for c in coefficients}) == 1
        and all(template.inputs[i].order == 0 and template.inputs[i].source == "var" for i in form.terms)
        and all(template.jaxpr.in_avals[i].shape == template.shape for i in form.terms)
    )


def _join_alias(family: Family, row: int, sets: _Sets) -> bool:
    terms = [(int(family.nodes[row, i]), c.number or 0.0) for i, c in family.template.form.terms.items()]
    if len(terms) == 1:
        return sets.vanish(terms[0][0])
    (a, coefficient_a), (b, coefficient_b) = terms
    return sets.join(a, b, -1 if coefficient_a * coefficient_b > 0 else 1)


def component_families(flat: FlatModel) -> Iterator[Family]:
    for instances in flat.instances:
        nodes = flat.nodes(instances)
        try:
            stated = templates(instances.kind, split=flat.split)
        except ModelError as error:
            complain(error)
            continue
        for template in stated:
            of_inputs = nodes[:, [item.slot for item in template.inputs]]
            of_inputs = np.where(of_inputs < 0, -1, of_inputs + np.array([item.element for item in template.inputs]))
            yield Family(template, instances, np.arange(len(nodes)), of_inputs, np.ones_like(of_inputs))


def _flow_families(flat: FlatModel, sets: _Sets) -> Iterator[Family]:
    """Connections of one or two flows become aliases; larger ones stay equations."""
    groups: dict[tuple, list[int]] = {}
    for index, (nodes, signs) in enumerate(flat.flow_sets):
        if len(nodes) == 1:
            sets.vanish(nodes[0])
        elif len(nodes) == 2:
            sets.join(nodes[0], nodes[1], -signs[0] * signs[1])
        else:
            sizes = flat.leaves[flat.leaf_of_node[nodes[0]]].sizes
            groups.setdefault((len(nodes), sizes), []).append(index)
    for (length, sizes), members in groups.items():
        nodes = np.array([flat.flow_sets[i][0] for i in members])
        signs = np.array([flat.flow_sets[i][1] for i in members])
        yield Family(sum_template((1,) * length, sizes), None, np.array(members), nodes, signs)


def _resolved(flat: FlatModel, sets: _Sets) -> tuple[np.ndarray, np.ndarray]:
    """Representatives for readable reports: a component's own variable rather than a port's or a signal."""
    found = [sets.find(node) for node in range(flat.n_nodes)]
    root = np.array([item[0] for item in found], dtype=int)
    sign = np.array([item[1] for item in found], dtype=int)
    with_signals = {_owner(leaf.path) for leaf in flat.leaves if leaf.in_port and not leaf.declaration.unit}
    ranks = np.array([_rank(flat, i, with_signals) for i in flat.variable_leaves])
    node_rank = np.repeat(ranks, [flat.leaves[i].count for i in flat.variable_leaves])
    best = np.full(flat.n_nodes, -1)
    for node in np.lexsort((-np.arange(flat.n_nodes), node_rank)).tolist():
        best[root[node]] = node
    representative = best[root]
    sign = sign * sign[representative] if len(sign) else sign
    is_time = np.array([flat.leaves[i].declaration.role == "time" for i in flat.variable_leaves], dtype=bool)
    is_time = np.repeat(is_time, [flat.leaves[i].count for i in flat.variable_leaves])
    representative = np.where(np.isin(root, root[is_time]), TIME, representative)
    zero = np.array(sets.zero, dtype=bool)
    return np.where(zero[root], ZERO, representative) if len(root) else root, sign


def _rank(flat: FlatModel, leaf: int, with_signals: Set[str]) -> float:
    """The rank of a leaf as the name of equal variables: a physical variable before a signal, and the position of a
    mass before that of its sensor, which is one of the parts `with_signals`.
    """
    declaration, path = flat.leaves[leaf].declaration, flat.leaves[leaf].path
    rank = 10.0 * abs(declaration.select) + 5.0 * (declaration.nominal is not None) - 0.1 * path.count(".")
    return rank - (declaration.unit == "") - 0.05 * (_owner(path) in with_signals)


def _owner(path: str) -> str:
    """The path of the component of a variable in a port."""
    return path.rpartition(".")[0].rpartition(".")[0]
