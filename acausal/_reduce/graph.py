"""Graphs of equations and variables: matching, connected sets, and the parts without a matching."""

import itertools

import numpy as np
import scipy  # imports its parts on first use: they take longer than the library itself

from . import small_graph

SMALL = 2000  # rows and columns up to which a search without scipy, with the same result, is faster


def match(rows: np.ndarray, columns: np.ndarray, n_rows: int, n_columns: int) -> np.ndarray:
    """A maximum matching: the column of each row, -1 for an unmatched row."""
    if n_rows == 0 or n_columns == 0 or len(rows) == 0:
        return np.full(n_rows, -1)
    if n_rows + n_columns <= SMALL:
        return np.array(small_graph.matching(_edges(rows, columns, n_rows), n_columns))
    graph = _incidence(rows, columns, n_rows, n_columns)
    return scipy.sparse.csgraph.maximum_bipartite_matching(graph, perm_type="column").astype(int)


def inverted(mate: np.ndarray, n_columns: int) -> np.ndarray:
    """The row of each column in a matching, -1 for an unmatched column."""
    partner = np.full(n_columns, -1)
    partner[mate[mate >= 0]] = np.flatnonzero(mate >= 0)
    return partner


def strong_components(users: np.ndarray, providers: np.ndarray, n_rows: int) -> tuple[int, np.ndarray]:
    """The number of strongly connected sets of rows, which use and provide variables, and the set of each row."""
    if n_rows <= SMALL:
        return _counted(small_graph.strongly_connected(_edges(users, providers, n_rows)))
    graph = _incidence(users, providers, n_rows, n_rows)
    return scipy.sparse.csgraph.connected_components(graph, directed=True, connection="strong")


def connected(edges: np.ndarray, n_nodes: int) -> tuple[int, np.ndarray]:
    """The number of connected sets of nodes, and the set of each node."""
    if n_nodes <= SMALL:
        return _counted(small_graph.connected(_edges(edges[:, 0], edges[:, 1], n_nodes)))
    graph = _incidence(edges[:, 0], edges[:, 1], n_nodes, n_nodes)
    return scipy.sparse.csgraph.connected_components(graph, directed=False)


def sharing(rows: list[int], users: np.ndarray, variables: np.ndarray) -> tuple[list[list[int]], np.ndarray]:
    """The sets of `rows` that share variables, and the set of each entry: a row and a variable that it uses."""
    place = {row: i for i, row in enumerate(rows)}
    user = np.array([place[row] for row in users.tolist()], dtype=int)
    names, column = np.unique(variables, return_inverse=True)
    count, label = connected(np.stack([user, len(rows) + column], axis=1), len(rows) + len(names))
    sets: list[list[int]] = [[] for _ in range(count)]
    for row, own in zip(rows, label.tolist(), strict=False):
        sets[own].append(row)
    return sets, label[user]


def _incidence(rows: np.ndarray, columns: np.ndarray, n_rows: int, n_columns: int) -> "scipy.sparse.csr_array":
    return scipy.sparse.csr_array((np.ones(len(rows)), (rows, columns)), shape=(n_rows, n_columns))


def _edges(rows: np.ndarray, columns: np.ndarray, n_rows: int) -> list[list[int]]:
    return [sorted(set(others)) for others in neighbours(rows, columns, n_rows)]


def _counted(label: list[int]) -> tuple[int, np.ndarray]:
    return max(label, default=-1) + 1, np.array(label, dtype=int)


def neighbours(rows: np.ndarray, columns: np.ndarray, n_rows: int) -> list[list[int]]:
    """The columns of each row."""
    order = np.argsort(rows, kind="stable")
    bounds = np.searchsorted(rows[order], np.arange(n_rows + 1)).tolist()
    ordered = columns[order].tolist()
    return [ordered[a:b] for a, b in itertools.pairwise(bounds)]


def reach(start: list[int], edges: list[list[int]], partner: np.ndarray) -> tuple[set[int], set[int]]:
    """Alternating paths from unmatched `start`: over an edge to the other side, back along the matching.

    `partner[k]` is the mate of the other side's k, -1 for none. Returns the reached nodes of both sides. From unmatched
    equations this is the over-determined part of Dulmage and Mendelsohn, from unmatched variables the
    under-determined one.
    """
    here, there, queue = set(start), set(), list(start)
    while queue:
        for other in edges[queue.pop()]:
            if other not in there:
                there.add(other)
                mate = int(partner[other])
                if mate >= 0 and mate not in here:
                    here.add(mate)
                    queue.append(mate)
    return here, there
