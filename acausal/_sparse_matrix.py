"""Sparse matrices with a fixed structure, and their factors by elimination in a fixed order."""

import dataclasses
import heapq
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import scipy
from jax import lax
from jax.custom_batching import custom_vmap
from jaxtyping import Array, Float, UInt32

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


ACCURATE = 1e-8  # backward error, relative to the terms, above which elimination has lost half of the digits

_Vector = Float[Array, " n"]


@dataclasses.dataclass(frozen=True, eq=False)
class Pattern:
    """The structure of a sparse Jacobian: the row and column of each entry, the colour of each column, and the order in
    which the matrix of a step is eliminated.
    """

    rows: np.ndarray
    columns: np.ndarray
    colours: np.ndarray
    elimination: EliminationOrder

    @property
    def n(self) -> int:
        return len(self.colours)

    @property
    def n_colours(self) -> int:
        return int(np.max(self.colours, initial=-1)) + 1

    @property
    def fill_in(self) -> int:
        """The number of entries that elimination adds to the given ones and to the diagonal."""
        return self.elimination.size - self.n - int(np.sum(self.rows != self.columns))

    @property
    def seeds(self) -> np.ndarray:
        """[colours, n], the sum of the unit vectors of each colour."""
        return (np.arange(self.n_colours)[:, None] == self.colours).astype(float)


def pattern_of(structure: Structure, most: float) -> Pattern | None:
    """The pattern of a Jacobian; None if an elimination takes more than `most` multiplications."""
    elimination = elimination_of(structure, most)
    if elimination is None:
        return None
    entries = structure.tocoo()
    return Pattern(entries.row, entries.col, column_colours(structure), elimination)


class SparseMatrix(eqx.Module):
    """A matrix with `entries` at the places of a pattern, plus a diagonal."""

    entries: Float[Array, " k"]
    diagonal: _Vector
    pattern: Pattern = eqx.field(static=True)

    def __matmul__(self, x: _Vector) -> _Vector:
        pattern = self.pattern
        return (self.diagonal * x).at[pattern.rows].add(self.entries * x[pattern.columns])

    def factors(self, nominal: _Vector | None = None) -> "SparseFactors":
        """The factors of the matrix, without derivatives.

        Pivots lie on the diagonal. This is safe if the symmetric part of the matrix is positive definite in some
        scaling, as for a step of a passive system, and for each short step. Factors that do not solve the system for a
        vector of `nominal` size are replaced by NaN, which rejects the step.
        """
        of, matrix = self.pattern.elimination, lax.stop_gradient(self)
        n, x = self.pattern.n, _eliminate(of, matrix.entries, matrix.diagonal)
        diagonal, lower, upper = jnp.split(x, [n, n + len(of.below)])
        inverse = 1.0 / diagonal
        found = SparseFactors(matrix, lower * inverse[of.beside], inverse, upper * inverse[of.beside])
        is_accurate = found.is_accurate(jnp.ones(n) if nominal is None else nominal)
        return dataclasses.replace(found, inverse=jnp.where(is_accurate, inverse, jnp.nan))


class SparseFactors(eqx.Module):
    """The factors of a sparse matrix, L D U with ones on the diagonals of L and U, and the inverse of D. Solves are not
    differentiated with respect to them.
    """

    matrix: SparseMatrix
    lower: Float[Array, " k"]
    inverse: _Vector
    upper: Float[Array, " k"]

    def solve(self, b: _Vector) -> _Vector:
        """The solution for one right-hand side."""
        return lax.custom_linear_solve(
            lambda x: self.matrix @ x, b, lambda _, b: self.substituted(b), lambda _, b: self.substituted_transposed(b)
        )

    def substituted(self, b: _Vector) -> _Vector:
        """The same without derivatives."""
        return _substitute(self.matrix.pattern.elimination, self.lower, self.inverse, self.upper, b)

    def substituted_transposed(self, b: _Vector) -> _Vector:
        """The same with the transposed matrix."""
        return _substitute(self.matrix.pattern.elimination, self.upper, self.inverse, self.lower, b)

    def is_accurate(self, x: _Vector) -> Array:
        """Whether the solution with the right-hand side of `x` is `x`, except for rounding."""
        matrix = self.matrix
        sizes = SparseMatrix(jnp.abs(matrix.entries), jnp.abs(matrix.diagonal), matrix.pattern)
        b = matrix @ x
        x = self.substituted(b)
        return jnp.all(jnp.abs(matrix @ x - b) <= ACCURATE * (sizes @ jnp.abs(x) + jnp.abs(b)))


# Loops over tables compile in constant time, and as one function each. A trailing axis is a batch, whose members lie
# side by side in memory.


def _eliminated(of: EliminationOrder, tables: Sequence[Array], entries: Array, diagonal: Array) -> Array:
    """All entries of the factors L D, D and D U, from those of the matrix and what is added to its diagonal."""
    given, *updates = tables
    x = jnp.zeros((of.size, *entries.shape[1:])).at[: len(diagonal)].set(diagonal).at[given].add(entries)

    def update(i: Array, x: Array) -> Array:
        own, left, right, pivot = (_at(table, i) for table in updates)
        return _put(x, _at(x, own) - _at(x, left) * _at(x, right) / _at(x, pivot), own)

    return _loop(len(of.updated), update, x)


def _substituted(
    of: EliminationOrder, tables: Sequence[Array], first: Array, inverse: Array, last: Array, b: Array
) -> Array:
    """The solution with a lower triangle, a diagonal and an upper triangle."""
    n = len(of.below)
    below, beside = tables

    def forward(i: Array, x: Array) -> Array:
        row = _at(below, i)
        return _put(x, _at(x, row) - _at(first, i) * _at(x, _at(beside, i)), row)

    def backward(i: Array, x: Array) -> Array:
        i = np.uint32(n - 1) - i
        row = _at(beside, i)
        return _put(x, _at(x, row) - _at(last, i) * _at(x, _at(below, i)), row)

    return _loop(n, backward, inverse * _loop(n, forward, b))


def _loop(count: int, body: Callable[[Array, Array], Array], x: Array) -> Array:
    return lax.fori_loop(np.uint32(0), np.uint32(count), body, x) if count else x


def _at(x: Array, i: Array) -> Array:
    return lax.dynamic_index_in_dim(x, i, 0, keepdims=False)


def _put(x: Array, value: Array, i: Array) -> Array:
    return lax.dynamic_update_index_in_dim(x, value, i, 0)


def _eliminate(of: EliminationOrder, *arrays: Array) -> Array:
    return _batched(of, _eliminated, (of.given, of.updated, of.left, of.right, of.pivot), arrays)


def _substitute(of: EliminationOrder, *arrays: Array) -> Array:
    return _batched(of, _substituted, (of.below, of.beside), arrays)


def _batched(
    of: EliminationOrder, function: Callable[..., Array], tables: Sequence[np.ndarray], arrays: Sequence[Array]
) -> Array:
    """A function of tables and of arrays whose batches lie along a trailing axis.

    The tables are arguments of the mapped function, which `lax.cond` on a batch repeats for each member; the batch uses
    the given ones.
    """

    @custom_vmap
    def alone(tables: list[Array], *arrays: Array) -> Array:
        return function(of, tables, *arrays)

    @alone.def_vmap
    def many(size: int, batched: list[Any], repeated: list[Array], *arrays: Array) -> tuple[Array, bool]:
        del repeated
        moved = [
            jnp.moveaxis(array, 0, -1) if own else jnp.broadcast_to(array[..., None], (*array.shape, size))
            for array, own in zip(arrays, batched[1:], strict=True)
        ]
        return jnp.moveaxis(function(of, [jnp.asarray(table) for table in tables], *moved), -1, 0), True

    return alone([jnp.asarray(table) for table in tables], *arrays)
