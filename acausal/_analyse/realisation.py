"""Reachable and observable parts of a linear system, minimal and balanced realisations; on numbers.

All functions scale the states to balanced units, so ranks do not depend on units.
"""

import numpy as np
import scipy
from jaxtyping import Float

from .._errors import ModelError
from .._numbers import Numbers

SMALL = 1e-12  # relative size that counts as zero: above rounding, below any relevant coupling

Matrix = Float[np.ndarray, "_ _"]


def reachable(A: Numbers, B: Numbers) -> Matrix:
    """A basis, as columns, of the reachable states: the range of [B, A B, A^2 B, ...], orthonormal in balanced
    units."""
    A, B = np.asarray(A), np.asarray(B)
    if A.size == 0 or B.size == 0:
        return np.zeros((len(A), 0))
    balanced, scale = _balanced(A)
    basis, newest = np.zeros((len(A), 0)), _unit_columns(B / scale[:, None])
    size = np.linalg.norm(balanced)
    threshold = SMALL
    while newest.shape[1] and basis.shape[1] < len(A):
        fresh = newest - basis @ (basis.T @ newest)
        left, values, _ = scipy.linalg.svd(fresh - basis @ (basis.T @ fresh), full_matrices=False)
        added = left[:, values > threshold]
        basis = np.concatenate([basis, added], axis=1)
        newest, threshold = balanced @ added, SMALL * size
    return scale[:, None] * basis


def _balanced(A: Matrix) -> tuple[Matrix, np.ndarray]:
    """A in units of the states that balance the sizes of its rows and columns, and these units."""
    balanced, (scale, _) = scipy.linalg.matrix_balance(A, permute=False, separate=True)
    return balanced, scale


def _unit_columns(matrix: Matrix) -> Matrix:
    norms = np.linalg.norm(matrix, axis=0)
    return matrix / np.where(norms > 0.0, norms, 1.0)


def minimal(A: Numbers, B: Numbers, C: Numbers) -> tuple[Matrix, Matrix, Matrix]:
    """A, B, C of the states that are both reachable and observable."""
    A, B, C = _restricted(*(np.asarray(matrix) for matrix in (A, B, C)))
    A, C, B = _restricted(A.T, C.T, B.T)
    return A.T, B.T, C.T


def _restricted(A: Matrix, B: Matrix, C: Matrix) -> tuple[Matrix, Matrix, Matrix]:
    """A, B, C on the reachable states; unchanged if all are reachable."""
    basis = reachable(A, B)
    if basis.shape[1] == len(A):
        return A, B, C
    inverse = np.linalg.pinv(basis)
    return inverse @ A @ basis, inverse @ B, C @ basis


def balanced(A: Matrix, B: Matrix, C: Matrix) -> tuple[np.ndarray, Matrix, Matrix]:
    """Hankel singular values, and the matrices to and from balanced states, by the square-root method (Laub 1987)."""
    if len(A) and np.max(np.linalg.eigvals(A).real) >= 0.0:
        raise ModelError(
            "Balanced states need stable poles, but the minimal system has one with a nonnegative real part."
        )
    _, scale = _balanced(A) if len(A) else (A, np.ones(0))
    A, B, C = A / scale[:, None] * scale, B / scale[:, None], C * scale
    reach = _square_root(scipy.linalg.solve_continuous_lyapunov(A, -B @ B.T)) if len(A) else A
    see = _square_root(scipy.linalg.solve_continuous_lyapunov(A.T, -C.T @ C)) if len(A) else A
    left, values, right = scipy.linalg.svd(see.T @ reach) if len(A) else (A, np.zeros(0), A)
    weight = 1.0 / np.sqrt(values)
    to = weight[:, None] * (left.T @ see.T) / scale
    return values, to, scale[:, None] * (reach @ right.T) * weight


def _square_root(gramian: Matrix) -> Matrix:
    """R with R R^T equal to a symmetric positive matrix."""
    gramian = 0.5 * (gramian + gramian.T)
    try:
        return scipy.linalg.cholesky(gramian, lower=True)
    except np.linalg.LinAlgError:
        values, vectors = np.linalg.eigh(gramian)
        return vectors * np.sqrt(np.maximum(values, np.finfo(float).tiny))


def truncated(A: Numbers, B: Numbers, C: Numbers, order: int) -> tuple[Matrix, Matrix, Matrix]:
    """The first `order` balanced states."""
    A, B, C = minimal(A, B, C)
    if not 0 <= order <= len(A):
        raise ModelError(f"order={order} is not possible: the minimal system has {len(A)} states.")
    _, to, back = balanced(A, B, C)
    to, back = to[:order], back[:, :order]
    return to @ A @ back, to @ B, C @ back
