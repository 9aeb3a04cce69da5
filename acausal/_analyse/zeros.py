"""Transmission zeros, transfer functions and static gains; on numbers."""

from typing import Any, NamedTuple

import numpy as np
import scipy

from .realisation import SMALL, minimal

# Relative size of couplings that count as zero: a smaller one would make a zero this much faster than the fastest pole.
COUPLING = 1e-10

Matrices = tuple[Any, Any, Any, Any]


class TransferFunction(NamedTuple):
    """Coefficients of numerator and denominator in s, highest power first; the denominator is monic."""

    numerator: np.ndarray
    denominator: np.ndarray


def transmission_zeros(matrices: Matrices) -> np.ndarray:
    """Finite zeros of [A - s, B; C, D], in ascending order of magnitude (Emami-Naeini, Van Dooren 1982).

    Zeros at infinity and rank deficiencies are removed first, by rank decisions on balanced matrices; the others
    are the eigenvalues of a regular pencil.
    """
    A, B, C, D = (np.asarray(matrix, float) for matrix in matrices)
    rate = np.linalg.norm(scipy.linalg.matrix_balance(A, permute=False)[0]) if A.any() else 1.0
    A, B, C, D = _compressed(*_normalised(A / rate, B / rate, C, D))
    A, C, B, D = (matrix.T for matrix in _compressed(A.T, C.T, B.T, D.T))
    n = len(A)
    if n == 0:
        return np.zeros(0, complex)
    if D.size == 0:
        return _sorted(scipy.linalg.eigvals(A), rate)
    # Orthogonal columns W with [C, D] W = [0, D'] leave the pencil (A' - s E') of the zeros.
    W = scipy.linalg.svd(np.concatenate([C, D], axis=1))[2][len(D) :].T
    return _sorted(scipy.linalg.eigvals(np.concatenate([A, B], axis=1) @ W, W[:n]), rate)


def _sorted(values: Any, rate: Any) -> np.ndarray:
    """Values times a rate in 1/s, in ascending order of magnitude; in a conjugate pair, the one above the real axis
    first.
    """
    return rate * values[np.lexsort((-values.imag, np.round(np.abs(values), 12)))]


def _normalised(A: np.ndarray, B: np.ndarray, C: np.ndarray, D: np.ndarray) -> Matrices:
    """A system with the same zeros, balanced states, and inputs and outputs of size 1."""
    if len(A):
        A, (scale, _) = scipy.linalg.matrix_balance(A, permute=False, separate=True)
        B, C = B / scale[:, None], C * scale
    inputs = np.linalg.norm(np.concatenate([B, D]), axis=0)
    inputs = np.where(inputs > 0.0, inputs, 1.0)
    B, D = B / inputs, D / inputs
    outputs = np.linalg.norm(np.concatenate([C, D], axis=1), axis=1)[:, None]
    outputs = np.where(outputs > 0.0, outputs, 1.0)
    return A, B, C / outputs, D / outputs


def _compressed(A: np.ndarray, B: np.ndarray, C: np.ndarray, D: np.ndarray) -> Matrices:
    """An equivalent system whose D has full row rank: outputs without direct feedthrough become constraints."""
    while len(C):
        left, values, _ = scipy.linalg.svd(D) if D.size else (np.eye(len(C)), np.zeros(0), None)
        rank = int(np.sum(values > COUPLING))
        C, D = left.T @ C, (left.T @ D)[:rank]
        if rank == len(C):
            break
        top, blind = C[:rank], C[rank:]
        _, sizes, V = scipy.linalg.svd(blind) if blind.size else (None, np.zeros(0), np.eye(len(A)))
        held = int(np.sum(sizes > COUPLING))  # number of states that the other outputs fix at zero
        if held == 0:
            return A, B, top, D
        # The last coordinates are fixed; their rates become outputs.
        V = np.concatenate([V[held:], V[:held]]).T
        A, B, top, free = V.T @ A @ V, V.T @ B, top @ V, len(A) - held
        C = np.concatenate([A[free:, :free], top[:, :free]])
        D = np.concatenate([B[free:], D])
        A, B = A[:free, :free], B[:free]
    return A, B, C, D


def dc_gain(matrices: Matrices) -> np.ndarray:
    """The gain at s = 0 of each channel; infinite if its minimal system has a pole there."""
    A, B, C, D = (np.asarray(matrix) for matrix in matrices)
    return np.array([[_static(A, B[:, [j]], C[[i]], D[i, j]) for j in range(D.shape[1])] for i in range(D.shape[0])])


def _static(A: np.ndarray, B: np.ndarray, C: np.ndarray, D: Any) -> float:
    A, B, C = minimal(A, B, C)
    if len(A) == 0:
        return float(D)
    balanced = scipy.linalg.matrix_balance(A, permute=False)[0]
    values = scipy.linalg.svd(balanced, compute_uv=False)
    if values[-1] <= SMALL * values[0]:
        return np.inf
    return float(D - (C @ np.linalg.solve(A, B))[0, 0])


def transfer_function(matrices: Matrices) -> TransferFunction:
    """The transfer function of a system with one input and one output, from its poles and zeros and its value at one
    point.
    """
    A, B, C, D = (np.asarray(matrix) for matrix in matrices)
    A, B, C = minimal(A, B, C)
    poles, zeros = np.linalg.eigvals(A), transmission_zeros((A, B, C, D))
    # To the right of all poles and zeros none of the factors is small.
    s = 1.0 + 2.0 * np.max(np.abs([*poles, *zeros]), initial=0.0)
    value = (C @ np.linalg.solve(s * np.eye(len(A)) - A, B) + D)[0, 0]
    gain = value * np.prod(s - poles).real / np.prod(s - zeros).real
    return TransferFunction(gain * np.atleast_1d(np.poly(zeros).real), np.atleast_1d(np.poly(poles).real))
