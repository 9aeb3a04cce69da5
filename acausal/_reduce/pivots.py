"""Gaussian elimination on the coefficients of constraints, with pivots that are safe to divide by."""

from typing import NamedTuple

import numpy as np

from .graph import sharing


class Entries(NamedTuple):
    """Coefficients of constraints: one number for each (row, variable), and its preference as a pivot.

    A `safe` one cannot vanish during a run, a `steady` one is constant. Numbers that are not `known` are stand-ins.
    """

    rows: np.ndarray
    variables: np.ndarray
    numbers: np.ndarray
    liking: np.ndarray
    safe: np.ndarray
    steady: np.ndarray
    known: np.ndarray

    def where(self, kept: np.ndarray) -> "Entries":
        return Entries(*(part[kept] for part in self))

    def without(self, peeled: dict[int, int]) -> "Entries":
        return self.where(~(np.isin(self.rows, list(peeled)) | np.isin(self.variables, list(peeled.values()))))


def connected_rows(entries: Entries, rows: list[int]) -> list[tuple[list[int], Entries]]:
    """Sets of rows that share variables, each with all its entries."""
    sets, label = sharing(rows, entries.rows, entries.variables)
    order = np.argsort(label, kind="stable")
    bounds = np.searchsorted(label[order], np.arange(len(sets) + 1))
    return [(members, entries.where(order[bounds[g] : bounds[g + 1]])) for g, members in enumerate(sets)]


class Elimination:
    """State of a Gaussian elimination: `rows` and `columns` are the unused ones."""

    def __init__(self, n_rows: int, n_columns: int) -> None:
        self.matrix, self.liking = np.zeros((n_rows, n_columns)), np.ones((n_rows, n_columns))
        self.safe, self.steady = np.ones((n_rows, n_columns), bool), np.ones((n_rows, n_columns), bool)
        self.rows, self.columns = set(range(n_rows)), set(range(n_columns))

    def put(self, row: int, column: int, number: float, liking: float, safe: bool, steady: bool) -> None:
        place = row, column
        self.matrix[place] += number
        self.liking[place] = min(self.liking[place], liking)
        self.safe[place] &= safe
        self.steady[place] &= steady

    def pivot(self, columns: list[int], threshold: float, any_pivot: bool) -> list[int]:
        """Eliminate with pivots from `columns` larger than `threshold`; among equal ones, the last goes first."""
        picked: list[int] = []
        while columns and self.rows:
            rows = sorted(self.rows)
            inside = np.ix_(rows, columns)
            block = np.abs(self.matrix[inside])
            relative = block / np.maximum(np.max(np.abs(self.matrix[rows]), axis=1, keepdims=True), 1e-300)
            fit = (relative > threshold) & (block > 1e-12) & (self.safe[inside] | any_pivot)
            if not np.any(fit):
                return picked
            score = np.round(np.where(fit, relative * self.liking[inside], 0.0), 9)
            row, reverse = np.unravel_index(np.argmax(score[:, ::-1]), score.shape)
            r, c = rows[int(row)], columns[len(columns) - 1 - int(reverse)]
            self._use(r, c)
            columns = [item for item in columns if item != c]
            picked.append(c)
        return picked

    def _use(self, row: int, column: int) -> None:
        self.rows.remove(row)
        self.columns.remove(column)
        touched = self.matrix[row] != 0
        for other in self.rows:
            factor = self.matrix[other, column] / self.matrix[row, column]
            if factor:
                self.matrix[other] -= factor * self.matrix[row]
                # New coefficients are computed from four old ones and get the lowest preference of these.
                least = min(self.liking[other, column], self.liking[row, column])
                mixed = np.minimum(np.minimum(self.liking[other], self.liking[row]), least)
                self.liking[other] = np.where(touched, mixed, self.liking[other])
                steady = self.steady[other] & self.steady[row] & self.steady[other, column] & self.steady[row, column]
                self.steady[other] = np.where(touched, steady, self.steady[other])
                # A difference of safe coefficients may vanish. A new one is safe only if it is steady: it
                # keeps its present value.
                self.safe[other] = np.where(touched, steady, self.safe[other])
