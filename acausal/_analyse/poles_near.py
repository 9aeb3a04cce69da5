"""A few poles of a large linear system, by sparse factors on the host."""

import numpy as np
import scipy  # imports its parts on use

from .._errors import ArgumentError


def poles_near(A: np.ndarray, shift: complex, count: int) -> np.ndarray:
    """The eigenvalues of a matrix that are closest to a shift: those of largest magnitude of (A - shift)^-1, by the
    Arnoldi method (Saad, Numerical Methods for Large Eigenvalue Problems, 2011).
    """
    n = len(A)
    if not 1 <= count <= n:
        raise ArgumentError(f"poles_near(..., count={count}) of a system with {n} states: ask for 1 to {n} poles.")
    if count >= n - 1:  # as many as the Arnoldi method has vectors
        values = np.linalg.eigvals(A)
    else:
        sparse = scipy.sparse
        real = shift.real if shift.imag == 0.0 else shift
        matrix = sparse.csc_array(A) - sparse.csc_array(sparse.diags_array(np.full(n, real)))
        try:
            factors = sparse.linalg.splu(sparse.csc_matrix(matrix))
        except RuntimeError as error:
            raise ArgumentError(
                f"shift={real} is a pole of the system, so A - shift has no inverse. Remedy: a shift beside it."
            ) from error
        inverse = sparse.linalg.LinearOperator((n, n), matvec=factors.solve, dtype=matrix.dtype)
        start = np.random.default_rng(0).normal(size=n).astype(matrix.dtype)
        found = sparse.linalg.eigs(inverse, count, v0=start, return_eigenvectors=False)
        values = shift + 1.0 / found
    return values[np.argsort(np.abs(values - shift), kind="stable")][:count]
