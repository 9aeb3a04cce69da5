"""Elimination of a sparse matrix as tables of positions, from its structure alone."""

import dataclasses

import numpy as np
from jaxtyping import UInt32

from ._sparse_order import Structure, least_degree

_Index = UInt32[np.ndarray, " k"]


@dataclasses.dataclass(frozen=True, eq=False)
class EliminationOrder:
    """The order in which a sparse matrix is eliminated, as tables of positions among its entries and the fill-in.

    The diagonal comes first, by row, then the entries of L: the i-th is in row `below[i]` and column `beside[i]`. Those
    of U, their mirror images, follow. In sequence, `updated[i] -= left[i] * right[i] / pivot[i]` turns the entries into
    those of the factors.
    """

    given: _Index  # of each entry of the matrix
    size: int
    below: _Index
    beside: _Index
    updated: _Index
    left: _Index
    right: _Index
    pivot: _Index

    @property
    def work(self) -> int:
        """The number of multiplications of a factorisation."""
        return len(self.updated)

    @property
    def work_of_solve(self) -> int:
        """The number of multiplications of one solution."""
        return 2 * len(self.below)


def elimination_of(structure: Structure, most: float) -> EliminationOrder | None:
    """The elimination of a sparse matrix; None if it takes more than `most` multiplications."""
    order = least_degree(structure, most)
    if order is None:
        return None
    n = len(order)
    counts = np.array([len(rows) for _, rows in order], int)
    pivots = np.array([row for row, _ in order], int)
    rank = np.argsort(pivots)
    below, beside = np.array([row for _, rows in order for row in rows], int), np.repeat(pivots, counts)
    keys = rank[beside] * n + below  # increasing

    def places(rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
        is_upper = rank[rows] < rank[columns]
        pivot, other = np.where(is_upper, rows, columns), np.where(is_upper, columns, rows)
        found = n + np.searchsorted(keys, rank[pivot] * n + other)
        return np.where(rows == columns, rows, np.where(is_upper, found + len(keys), found))

    # A pivot changes the entries of all rows and columns beside it.
    squares = counts**2
    start, width = np.repeat(np.cumsum(counts) - counts, squares), np.repeat(counts, squares)
    inside = np.arange(len(start)) - np.repeat(np.cumsum(squares) - squares, squares)
    left, right = start + inside // width, start + inside % width
    updated, pivot = places(below[left], below[right]), np.repeat(pivots, squares)
    entries = structure.tocoo()
    given = places(entries.row.astype(int), entries.col.astype(int))
    tables = (below, beside, updated, n + left, n + len(keys) + right, pivot)
    return EliminationOrder(given.astype(np.uint32), n + 2 * len(keys), *(table.astype(np.uint32) for table in tables))
