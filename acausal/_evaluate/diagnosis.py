"""Search for the unknown that caused a failure, for messages."""

import numpy as np
from jax import Array

from .._numbers import Numbers
from .._reduce.aliases import ZERO
from .._reduce.incidence import Pair
from .._reduce.tear import Torn
from .starts import Inputs
from .system import System


def first_not_finite(system: System, t: Numbers, y: Array, inputs: Inputs) -> Pair | None:
    """The first unknown, in the order of computation, that is not finite at a point."""
    store = system.evaluate_all(t, y, inputs)
    for pair, place in system.plan.places.items():
        value = store.flat(place.segment)[place.start : place.start + system.plan.size(pair[0])]
        if not np.all(np.isfinite(np.asarray(value))):
            return pair
    return None


def block_of(system: System, pair: Pair) -> Torn | None:
    """The simultaneous block of a pair; None for other pairs."""
    unknowns = system.ordered.unknowns
    return next((torn for torn in system.torn if torn.tears and pair in [unknowns[u] for u in torn.unknowns]), None)


def without_storage(system: System, block: Torn) -> list[tuple[str, str]]:
    """Connections without storage in a block that has to determine their level.

    For each, the connected ports and a component that could store the flow.
    """
    table, flat, representative = system.ordered.table, system.flat, system.merged.representative
    owners = {table.row_name(row).rpartition(".")[0] for row in block.rows}
    met: dict[int, tuple[list[str], list[str], str]] = {}
    for leaf in flat.leaves:
        if leaf.port is None or not leaf.port.storage or leaf.declaration.role != "var":
            continue
        for node in leaf.nodes:
            root = int(representative[node])
            if root != ZERO and _level(system, table.number_of_node[root]) >= block.level:
                port = flat.node_name(node).rpartition(".")[0]
                ports, holders, _ = met.setdefault(root, ([], [], leaf.port.storage))
                ports.append(port)
                holders.append(port.rpartition(".")[0])
    return [(" and ".join(ports), storage) for ports, holders, storage in met.values() if owners & set(holders)]


def _level(system: System, variable: int) -> int:
    """Position of a variable in the order of computation; -1 for a state."""
    unknowns = system.ordered.unknowns
    return next((torn.level for torn in system.torn if (variable, 0) in [unknowns[u] for u in torn.unknowns]), -1)
