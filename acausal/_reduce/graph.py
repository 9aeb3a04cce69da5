"""Graphs of equations and variables: matching, connected sets, and what to say when there is no matching."""

import itertools

import numpy as np
import scipy  # whose parts are imported when they are first used: they take longer than the library itself

from . import small_graph

SMALL = 2000  # graphs with up to so many rows and columns are searched without scipy, with the same outcome


def match(rows: np.ndarray, columns: np.ndarray, n_rows: int, n_columns: int) -> np.ndarray:
    """A matching of largest size: the column of each row, -1 for a row left over."""
    if n_rows == 0 or n_columns == 0 or len(rows) == 0:
        return np.full(n_rows, -1)
    if n_rows + n_columns <= SMALL:
        return np.array(small_graph.matching(_edges(rows, columns, n_rows), n_columns))
    graph = _incidence(rows, columns, n_rows, n_columns)
    return scipy.sparse.csgraph.maximum_bipartite_matching(graph, perm_type="column").astype(int)


def inverted(mate: np.ndarray, n_columns: int) -> np.ndarray:
    """The row of each column in a matching, -1 for a column left over."""
    partner = np.full(n_columns, -1)
    partner[mate[mate >= 0]] = np.flatnonzero(mate >= 0)
    return partner


def strong_components(users: np.ndarray, providers: np.ndarray, n_rows: int) -> tuple[int, np.ndarray]:
    """How many strongly connected sets the rows form, of which some use what others provide, and that of each row."""
    if n_rows <= SMALL:
        return _counted(small_graph.strongly_connected(_edges(users, providers, n_rows)))
    graph = _incidence(users, providers, n_rows, n_rows)
    return scipy.sparse.csgraph.connected_components(graph, directed=True, connection="strong")


def connected(edges: np.ndarray, n_nodes: int) -> tuple[int, np.ndarray]:
    """How many connected sets the nodes form, of which pairs are joined by edges, and that of each node."""
    if n_nodes <= SMALL:
        return _counted(small_graph.connected(_edges(edges[:, 0], edges[:, 1], n_nodes)))
    graph = _incidence(edges[:, 0], edges[:, 1], n_nodes, n_nodes)
    return scipy.sparse.csgraph.connected_components(graph, directed=False)


def sharing(rows: list[int], users: np.ndarray, variables: np.ndarray) -> tuple[list[list[int]], np.ndarray]:
    """The sets of `rows` that are connected through variables, and the set of each entry: a row and one it uses."""
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

    `partner[k]` is the mate of the other side's k, -1 for none. Returns what is reached on both sides. From unmatched
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
