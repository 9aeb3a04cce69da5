"""Spans and solutions of matrices with entries of different units, with a tolerance for their ranks."""

import numpy as np

SAME = 1e-7  # relative difference that counts as none
RANK = 1e-10  # relative size of a singular value that counts as zero


def equilibrated(matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A matrix with rows and columns scaled so that all entries are near one, and the factors of the columns.

    The factors minimise the logarithms of the entries in the least-squares sense (Curtis and Reid, 1972): volumes of
    1e-14 then have the same size as pressures of 1.
    """
    rows, columns = np.nonzero(matrix)
    if not len(rows):
        return matrix.copy(), np.ones(matrix.shape[1])
    design = np.zeros((len(rows), sum(matrix.shape)))
    design[np.arange(len(rows)), rows] = 1.0
    design[np.arange(len(rows)), matrix.shape[0] + columns] = 1.0
    logs = np.linalg.lstsq(design, -np.log(np.abs(matrix[rows, columns])), rcond=None)[0]
    down, across = np.exp(logs[: matrix.shape[0]]), np.exp(logs[matrix.shape[0] :])
    return matrix * down[:, None] * across, across


def solution(matrix: np.ndarray, right: np.ndarray) -> np.ndarray | None:
    """The solution of equally many independent equations and unknowns; None for other ranks."""
    if matrix.shape[0] < matrix.shape[1] or np.linalg.matrix_rank(matrix, tol=RANK) < matrix.shape[1]:
        return None
    if matrix.shape[0] == matrix.shape[1]:
        # Elimination keeps zeros, which least squares would fill with rounding errors.
        return np.linalg.solve(matrix, right)
    found = np.linalg.lstsq(matrix, right, rcond=None)[0]
    return found if np.max(np.abs(matrix @ found - right), initial=0.0) < SAME else None


def left_null(matrix: np.ndarray) -> np.ndarray:
    """Rows that multiply the matrix to zero."""
    if matrix.size == 0:
        return np.eye(matrix.shape[0])
    u, sizes, _ = np.linalg.svd(matrix)
    rank = int(np.sum(sizes > RANK * max(sizes[0], 1e-300)))
    return u[:, rank:].T


def independent(rows: np.ndarray) -> np.ndarray:
    """Independent rows that span the same space."""
    if rows.size == 0:
        return rows[:0]
    size = np.max(np.abs(rows), axis=0)
    size = np.where(size > 0.0, size, 1.0)
    _, sizes, vt = np.linalg.svd(rows / size)
    rank = int(np.sum(sizes > RANK * max(sizes[0], 1e-300))) if sizes[0] > RANK else 0
    return vt[:rank] * size
