"""Transfer functions on numbers: minimal realisations, transmission zeros, static gains, and stability margins.

All functions of realisations scale the states to balanced units, so ranks do not depend on units.
"""

from typing import Any, NamedTuple

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


NEAR = 1e-6  # relative real part below which a zero counts as imaginary


class Margins(NamedTuple):
    """Stability margins of a negative-feedback loop with L(s); infinite if there is no limit.

    - `gain`: the factor above 1 by which L may grow, and `phase_crossover` in rad/s, where arg L = -180 degrees;
      `least_gain` is the factor below 1 down to which it may shrink, zero if it may vanish.
    - `phase`: the additional phase lag of L in degrees, and `gain_crossover` in rad/s, where |L| = 1.
    - `delay`: the additional delay in s.
    """

    gain: float
    phase_crossover: float
    phase: float
    gain_crossover: float
    delay: float
    least_gain: float

    def __str__(self) -> str:
        least = f"least gain {self.least_gain:.4g}, " if self.least_gain > 0.0 else ""
        return (
            f"gain margin {self.gain:.4g} at {self.phase_crossover:.4g} rad/s, {least}"
            f"phase margin {self.phase:.4g} deg at {self.gain_crossover:.4g} rad/s, delay margin {self.delay:.4g} s"
        )


def margins(matrices: Matrices) -> Margins:
    """The margins of L(s) = C (s - A)^-1 B + D; its crossovers are zeros of systems twice as large.

    |L| = 1 where L(s) L(-s) - 1 vanishes on the imaginary axis, and L is real where L(s) - L(-s) does.
    """
    A, B, C, D = (np.asarray(matrix, float) for matrix in matrices)

    def response(w: float) -> complex:
        return complex((C @ np.linalg.solve(1j * w * np.eye(len(A)) - A, B) + D)[0, 0])

    none = np.zeros_like(A)
    # L(-s) = -C (s + A)^-1 B + D
    turned = np.concatenate([C, -D @ C], axis=1)
    series = np.block([[A, -B @ C], [none, -A]]), np.concatenate([B @ D, B]), turned, D @ D - 1.0
    apart = np.block([[A, none], [none, -A]]), np.concatenate([B, B]), np.concatenate([C, C], axis=1), np.zeros((1, 1))
    real = {w: response(w).real for w in _crossings(apart)}
    gains = sorted((-1.0 / value, w) for w, value in real.items() if value < 0.0)
    above, below = [pair for pair in gains if pair[0] > 1.0], [pair for pair in gains if pair[0] < 1.0]
    gain, phase_crossover = min(above, default=(np.inf, np.inf))
    phases = [(float(np.degrees(np.angle(-response(w)))), w) for w in _crossings(series)]
    phase, gain_crossover = min(phases, key=lambda pair: abs(pair[0]), default=(np.inf, np.inf))
    delay = min((np.radians(angle % 360.0) / w for angle, w in phases if w > 0.0), default=np.inf)
    return Margins(gain, phase_crossover, phase, gain_crossover, float(delay), max(below, default=(0.0, 0.0))[0])


def _crossings(matrices: Any) -> list[float]:
    """The frequencies in rad/s of zeros on the imaginary axis, except zero."""
    zeros: Any = transmission_zeros(matrices)
    is_there = (np.abs(zeros.real) < NEAR * np.abs(zeros)) & (zeros.imag > 0.0)
    return zeros[is_there].imag.tolist()
