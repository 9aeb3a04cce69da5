"""Elimination of states that invariants make dependent."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import scipy
from jaxtyping import Array, Float

from .._errors import ModelError
from .._tracing import is_traced

RANK = 1e-10  # relative size of pivots that count as zero


class IndependentSystem(NamedTuple):
    """A system in independent states; `basis` maps them to all: dy = basis dz."""

    A: Float[Array, "k k"]
    B: Float[Array, "k m"]
    C: Float[Array, "p k"]
    basis: Float[Array, "n k"]
    independent: np.ndarray  # indices of the independent states, ascending


def reduced(A: Any, B: Any, C: Any, G: Any, sizes: Any, independent: Any = None) -> IndependentSystem:
    """Eliminate the states that the invariants g(y) = 0 determine, with G = dg/dy.

    A system dy/dt = f(y, u) with invariants g(y) = 0 has spurious eigenvalues, those of motions off the invariants.
    Small motions on them obey G dy = 0, so that dy = [dz; -G_d^-1 G_i dz] with independent states z and dependent
    ones d, and d(dz)/dt = A_i dy + B_i du. The dependent states are the pivots of a QR decomposition of G with column
    pivoting, with states scaled by their nominal `sizes`; this needs numbers. `independent` fixes the choice, and then
    the function works under `jit`.

    Raises `ModelError` if the rows of G are dependent, as in a singular position of a mechanism.
    """
    G, sizes = jnp.asarray(G) * sizes, np.asarray(sizes)
    if independent is None:
        independent = _independent(G)
    independent = np.asarray(independent)
    dependent = np.setdiff1d(np.arange(G.shape[1]), independent)
    tied = -jnp.linalg.solve(G[:, dependent], G[:, independent])
    basis = jnp.zeros((G.shape[1], len(independent)))
    basis = basis.at[independent, np.arange(len(independent))].set(1.0).at[dependent].set(tied)
    basis = sizes[:, None] * basis / sizes[independent]
    return IndependentSystem(A[independent] @ basis, B[independent], C @ basis, basis, independent)


def _independent(G: Any) -> np.ndarray:
    if is_traced(G):
        raise ModelError(
            "The choice of independent states needs numbers: linearise a model with invariants outside jit, vmap "
            "and grad, or fix the choice."
        )
    matrix = np.asarray(G)
    # Normalised rows, so that the rank does not depend on the units of the constraints.
    norms = np.linalg.norm(matrix, axis=1, keepdims=True)
    _, triangle, pivots = scipy.linalg.qr(matrix / np.where(norms > 0, norms, 1.0), mode="economic", pivoting=True)
    size = np.abs(np.diag(triangle))
    if len(matrix) and (len(size) < len(matrix) or size[-1] <= RANK * size[0]):
        raise ModelError(
            "The constraints between the states are not independent at the operating point, as in a singular position "
            "of a mechanism: linearise at another point."
        )
    return np.sort(pivots[len(matrix) :])


def curvature(invariants: Any, y: Any, direction: Any, independent: np.ndarray) -> Any:
    """d2y/ds2 of the curve on g(y) = 0 whose independent states move along `direction` at constant rate.

    G d2y/ds2 = -d2g/dy2 [direction, direction], with no part in the independent states.
    """

    def first(point: Any) -> Any:
        return jax.jvp(invariants, (point,), (direction,))[1]

    dependent = np.setdiff1d(np.arange(len(y)), independent)
    bend = jax.jvp(first, (y,), (direction,))[1]
    G = jax.jacfwd(invariants)(y)
    return jnp.zeros(len(y)).at[dependent].set(-jnp.linalg.solve(G[:, dependent], bend))
