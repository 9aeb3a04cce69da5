"""Ports at which nothing takes up the flow, and the consequences.

The flow of a port without a connection is zero, and so is that of a port connected only to sensors, whose own equations
set their flow to zero. That is right at the open end of a shaft. In a gear, however, each torque is a multiple of the
others, so one free port takes the load off all of them.

The search is structural. An equation that is linear in one remaining variable, and has no other part, makes it zero.
"""

import collections
from collections.abc import Iterator, Sequence

import numpy as np
from jaxtyping import Bool

from .._reduce.aliases import Family, by_zero_factors, component_families
from .._reduce.flat_model import FlatModel

SHOWN = 3  # variables in a sentence


def free_ports(flat: FlatModel) -> Iterator[str]:
    """Sentences about free ports that make other variables of their component vanish, and about components on which
    nothing acts. The ports of the model itself count as connected.
    """
    families = list(component_families(flat))
    alone = _vanishing(families, np.zeros(flat.n_nodes, bool))  # in any model
    free = _unloaded(flat, alone) & ~alone
    lost = _vanishing(families, alone | free) & ~alone & ~free
    flows, others = collections.defaultdict(list), collections.defaultdict(list)
    for instances in flat.instances:
        nodes = flat.nodes(instances)
        for row in range(len(nodes)) if np.any(free[nodes[nodes >= 0]]) else ():
            name = instances.name(row)
            own = _elements(flat, nodes[row])
            flows[name] = [node for node in own if _is_flow(flat, node) and not alone[node]]
            others[name] = [node for node in own if lost[node]]
    for name, own in flows.items():
        ends = [node for node in own if free[node]]
        if not name or not ends:
            continue
        if others[name]:
            vanish = [flat.node_name(node).removeprefix(f"{name}.") for node in others[name]]
            more = ["..."] if len(vanish) > SHOWN else []
            yield (
                f"{_are_free(flat, ends, f' of {name}')}: nothing takes up {_flow(flat, ends[0])} there, so "
                f"{', '.join([*vanish[:SHOWN], *more])} {'is' if len(vanish) == 1 else 'are'} zero."
            )
        elif len(ends) == len(own):
            yield f"Nothing acts on {name}: {_are_free(flat, ends)}."


def _elements(flat: FlatModel, firsts: np.ndarray) -> list[int]:
    """The nodes of the variables of a component."""
    found = []
    for first in firsts[firsts >= 0].tolist():
        leaf = flat.leaves[flat.leaf_of_node[first]]
        found += range(first, first + (leaf.count if flat.split and not leaf.stack else 1))
    return found


def _is_flow(flat: FlatModel, node: int) -> bool:
    leaf = flat.leaves[flat.leaf_of_node[node]]
    return leaf.in_port and leaf.declaration.role == "flow"


def _are_free(flat: FlatModel, nodes: Sequence[int], of: str = "") -> str:
    """The clause that names the free ports of some flows, such as "a and b are free"."""
    ports = dict.fromkeys(flat.node_name(node).rpartition(".")[0].rpartition(".")[2] for node in nodes)
    return f"{' and '.join(ports)}{of} {'is' if len(ports) == 1 else 'are'} free"


def _flow(flat: FlatModel, node: int) -> str:
    """The noun of a flow: its comment up to the first comma, such as "torque"."""
    from .._declare.class_card import comment_of  # reads sources, which an import does not need

    leaf = flat.leaves[flat.leaf_of_node[node]]
    name = leaf.path.rpartition(".")[2]
    noun = comment_of(leaf.port, name).partition(",")[0].partition(";")[0] if leaf.port is not None else ""
    return f"the {noun}" if noun else name


def _is_port_of_model(flat: FlatModel, nodes: Sequence[int]) -> bool:
    """Whether a set of flows is that of a port of the model itself without a connection."""
    return len(nodes) == 1 and flat.node_name(nodes[0]).count(".") == 1


def _unloaded(flat: FlatModel, zero: Bool[np.ndarray, " nodes"]) -> Bool[np.ndarray, " nodes"]:
    """Marks flows that are zero because all others of their connection are."""
    zero, sets = zero.copy(), [nodes for nodes, _ in flat.flow_sets if not _is_port_of_model(flat, nodes)]
    while True:
        left = [[node for node in nodes if not zero[node]] for nodes in sets]
        news = [nodes[0] for nodes in left if len(nodes) == 1]
        if not news:
            return zero
        zero[news] = True


def _vanishing(families: Sequence[Family], zero: Bool[np.ndarray, " nodes"]) -> Bool[np.ndarray, " nodes"]:
    """Marks the given nodes and those that the equations of components then make zero."""
    zero, n = zero.copy(), -1
    while n != np.sum(zero):
        n = np.sum(zero)
        for part in (part for family in families for part in by_zero_factors(family, zero)):
            form = part.template.form
            terms = [i for i in form.terms if part.template.inputs[i].source == "var"]
            if form.has_rest or len(terms) < len(form.terms) or not terms:
                continue
            vanish = (part.nodes >= 0) & zero[part.nodes]
            is_linear = np.all(vanish[:, sorted(form.nonlinear)], axis=1)
            remain = ~vanish[:, terms]
            for place, i in enumerate(terms):
                if part.template.inputs[i].order == 0 and form.terms[i].elementwise:
                    rows = is_linear & remain[:, place] & (np.sum(remain, axis=1) == 1)
                    zero[part.nodes[rows, i]] = True
    return zero
