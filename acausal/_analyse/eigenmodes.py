"""Modes of a linear system: poles, damping, shapes, and participation."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Complex, Float

from .._errors import unknown_part
from .table import aligned, number, pole_name, share_table, shown, without_rounding


class Shares(eqx.Module):
    """The share of each row in each mode. `print` shows a table with one column for a conjugate pair.

    `shares["load.w"]` are the shares of one row in all modes.
    """

    values: Float[Array, "rows modes"]
    poles: Complex[Array, " modes"]
    names: tuple[str, ...] = eqx.field(static=True)
    title: str = eqx.field(static=True)

    def __getitem__(self, name: str) -> Array:
        if name not in self.names:
            raise unknown_part(name, self.names, f"{self.title} share")
        return self.values[self.names.index(name)]

    def __str__(self) -> str:
        return share_table(self.title, self.names, self.values, self.poles)


class Modes(eqx.Module):
    """The modes of a linear system, in ascending order of |pole|. `print` shows a table, one line for a conjugate pair.

    - `poles`: eigenvalues of A in 1/s.
    - `shapes`: right eigenvectors as columns, in the units of the states; the largest element, relative to the
      nominal sizes, equals its nominal size.
    - `participation`: |v_k w_k| of state k in a mode with right and left eigenvectors v and w, in columns that sum to 1
      (Perez-Arriaga, Verghese, Schweppe 1982). It does not depend on the units of the states.
    """

    poles: Complex[Array, " modes"]
    shapes: Complex[Array, "states modes"]
    participation: Shares

    @property
    def frequency(self) -> Array:
        """The undamped frequency |pole| / 2 pi in Hz."""
        return jnp.abs(self.poles) / (2.0 * jnp.pi)

    @property
    def damping_ratio(self) -> Array:
        """-Re(pole) / |pole|: 1 for a decay, 0 for an undamped oscillation, negative for growth; NaN at pole 0."""
        return 0.0 - self.poles.real / jnp.abs(self.poles)

    @property
    def time_constant(self) -> Array:
        """-1 / Re(pole) in s, the decay time of the envelope to 1/e; negative for growth, infinite without damping."""
        return jnp.where(self.poles.real == 0.0, jnp.inf, -1.0 / self.poles.real)

    def __str__(self) -> str:
        exact = eqx.tree_at(lambda modes: modes.poles, self, jnp.asarray(without_rounding(self.poles)))
        poles = np.asarray(exact.poles)
        columns = [np.asarray(column) for column in (exact.frequency, exact.damping_ratio, exact.time_constant)]
        head = ["pole [1/s]", "frequency [Hz]", "damping ratio", "time constant [s]", "states that take part"]
        lines = [
            [pole_name(poles[i]), *(number(column[i]) for column in columns), self._leading(i)] for i in shown(poles)
        ]
        width = max(len(line[-1]) for line in [head, *lines])
        return aligned([[*line[:-1], line[-1].ljust(width)] for line in [head, *lines]])

    def _leading(self, mode: int) -> str:
        """The states with the largest shares: those that make up most of the mode, at most three."""
        shares = np.asarray(self.participation.values)[:, mode]
        order = np.argsort(-shares, kind="stable")[:3]
        return ", ".join(f"{self.participation.names[k]} {shares[k]:.0%}" for k in order if shares[k] >= 0.1)


def poles_of(A: Any) -> Array:
    """Eigenvalues in ascending order of magnitude; in a conjugate pair, the one above the real axis comes first."""
    if A.shape[-1] == 0:
        return jnp.zeros(A.shape[:-1], complex)
    values = _eigenvalues(A)
    return jnp.take_along_axis(values, _order(values), axis=-1)


def _eigenvalues(A: Array) -> Array:
    """Eigenvalues from the eigenvectors, whose derivatives give second derivatives of eigenvalues."""
    return jax.lax.linalg.eig(A, compute_left_eigenvectors=False, enable_eigvec_derivs=True)[0]


def modes_of(A: Any, sizes: np.ndarray, names: tuple[str, ...]) -> Modes:
    """The modes of dx/dt = A x, for states scaled by their nominal `sizes`."""
    if len(sizes) == 0:
        poles, vectors = jnp.zeros(0, complex), jnp.zeros((0, 0), complex)
    else:
        # The results here do not depend on the length and phase of eigenvectors.
        poles, vectors = jax.lax.linalg.eig(A, compute_left_eigenvectors=False, enable_eigvec_derivs=True)
    order = _order(poles)
    poles, vectors = poles[order], vectors[:, order]
    weights = jnp.abs(vectors * jnp.linalg.inv(vectors).T)
    shares = weights / jnp.sum(weights, axis=0)
    participation = Shares(shares, poles, names, "participation")
    return Modes(poles, sizes[:, None] * _normalised(vectors), participation)


def _order(values: Array) -> Array:
    return jnp.argsort(jnp.abs(jax.lax.stop_gradient(values)), axis=-1, stable=True)


def _normalised(vectors: Array) -> Any:
    """Columns whose largest element is 1."""
    if vectors.shape[0] == 0:
        return vectors
    largest = jnp.argmax(jnp.abs(vectors), axis=0)
    return vectors / jnp.take_along_axis(vectors, largest[None], axis=0)
