"""Bipartite matching of equations with variables, and what to say when there is none."""

import itertools

import numpy as np
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import connected_components, maximum_bipartite_matching


def match(rows: np.ndarray, columns: np.ndarray, n_rows: int, n_columns: int) -> np.ndarray:
    """A matching of largest size: the column of each row, -1 for a row left over."""
    if n_rows == 0 or n_columns == 0 or len(rows) == 0:
        return np.full(n_rows, -1)
    graph = csr_array((np.ones(len(rows), dtype=np.int8), (rows, columns)), shape=(n_rows, n_columns))
    return maximum_bipartite_matching(graph, perm_type="column").astype(int)


def inverted(mate: np.ndarray, n_columns: int) -> np.ndarray:
    """The row of each column in a matching, -1 for a column left over."""
    partner = np.full(n_columns, -1)
    partner[mate[mate >= 0]] = np.flatnonzero(mate >= 0)
    return partner


def strong_components(users: np.ndarray, providers: np.ndarray, n_rows: int) -> tuple[int, np.ndarray]:
    """How many strongly connected sets the rows form, of which some use what others provide, and that of each row."""
    graph = coo_array((np.ones(len(users), np.int8), (users, providers)), shape=(n_rows, n_rows))
    return connected_components(graph, directed=True, connection="strong")


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
