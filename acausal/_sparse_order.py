"""Order of elimination and colours of the columns of a sparse matrix, from its structure alone."""

import heapq
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy  # imports its parts on use

if TYPE_CHECKING:
    Structure = scipy.sparse.csr_array  # true where an entry may differ from zero
else:
    Structure = Any


def column_colours(structure: Structure) -> np.ndarray:
    """The colour of each column: columns that share a row have different ones, so a directional derivative along all
    columns of a colour contains the entries of each (Curtis, Powell and Reid, IMA J. Appl. Math. 13, 1974).
    """
    rows, columns = scipy.sparse.csr_array(structure), scipy.sparse.csc_array(structure)
    colours = np.full(len(columns.indptr) - 1, -1)
    for column in range(len(colours)):
        beside = [_line(rows, row) for row in _line(columns, column)]
        taken = set(colours[np.concatenate(beside)].tolist()) if beside else set()
        colours[column] = next(colour for colour in range(len(taken) + 1) if colour not in taken)
    return colours


def least_degree(structure: Structure, most: float) -> list[tuple[int, list[int]]] | None:
    """The rows of a square matrix in an order of elimination by least degree, each with the later rows that it changes
    (George and Liu, Computer Solution of Large Sparse Positive Definite Systems, 1981). The structure is made symmetric
    first. None if the elimination takes more than `most` multiplications.
    """
    both = scipy.sparse.csr_array(structure + structure.T)
    near = [set(_line(both, row).tolist()) - {row} for row in range(len(both.indptr) - 1)]
    waiting = [(len(others), row) for row, others in enumerate(near)]
    heapq.heapify(waiting)
    order: list[tuple[int, list[int]]] = []
    done = np.zeros(len(near), bool)
    while waiting:
        degree, row = heapq.heappop(waiting)
        if done[row] or degree != len(near[row]):
            continue
        most -= degree**2
        if most < 0:
            return None
        done[row] = True
        order.append((row, sorted(near[row])))
        for other in near[row]:
            near[other] |= near[row]
            near[other] -= {other, row}
            heapq.heappush(waiting, (len(near[other]), other))
    return order


def _line(matrix: "scipy.sparse.csr_array | scipy.sparse.csc_array", number: int) -> np.ndarray:
    return matrix.indices[matrix.indptr[number] : matrix.indptr[number + 1]]
