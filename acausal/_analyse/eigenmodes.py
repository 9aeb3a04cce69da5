"""Eigenmodes of a linear system: their poles, shapes, and shares of the states and of the stored energy."""

import functools as ft
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import scipy
from jaxtyping import Array, Complex, Float

from .._errors import ArgumentError, unknown_part
from .._integrate.results.energy import stored
from .._integrate.setup.user_function import UserFunction, trace
from .._interpret.in_parts import in_parts
from .._reduce.jaxpr import slice_output
from .operating_point import OperatingPoint, invariants_at
from .redundant import curvature
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


NOTHING = 1e-22  # share of the energy of other modes that counts as rounding


def energy_shares(point: OperatingPoint, poles: Array, shapes: Array, independent: tuple[int, ...]) -> Shares:
    """The share of each component with stored energy in each mode; `shapes` are directions of all states.

    With a mode shape v and the Hessian H of a component's stored energy as a function of the states, v^H H v is twice
    its energy in that mode, averaged over a period. The shares are relative to the sum of absolute values.
    """
    quantity, constants = trace(stored, point.system.flat, "energy")
    values = _second_variations(quantity, independent, constants, point, shapes)
    total = jnp.sum(jnp.abs(values), axis=0)
    total = jnp.where(total > NOTHING * jnp.max(total, initial=0.0), total, jnp.inf)
    names = jax.tree_util.tree_unflatten(quantity.tree, range(quantity.n_outputs))
    stores = {name: i for name, i in names.items() if _depends(quantity, len(constants), i)}
    shares = (values / total)[np.array(list(stores.values()), int)]
    return Shares(shares, poles, tuple(stores), "energy")


def _depends(quantity: UserFunction, n_constants: int, output: int) -> bool:
    """Whether a component's stored energy depends on any variable, such as that of a mass."""
    return any(position >= n_constants for position in slice_output(quantity.closed, output).used)


@ft.partial(in_parts, static_argnums=(0, 1))
def _second_variations(
    quantity: UserFunction, independent: tuple[int, ...], constants: list[Array], point: OperatingPoint, v: Array
) -> Array:
    """v^H H v for each output of `quantity` (down) and each column of `v` (across), along the invariants."""
    invariants = invariants_at(point)

    def energies(y: Array) -> Array:
        values = quantity(constants, point.read(quantity.leaves, y))
        return jnp.stack(values) if values else jnp.zeros(0)

    def along(direction: Array) -> Array:
        def slope(y: Array) -> Array:
            return jax.jvp(energies, (y,), (direction,))[1]

        second = jax.jvp(slope, (point.y,), (direction,))[1]
        if invariants is None:
            return second
        bend = curvature(invariants, point.y, direction, np.array(independent))
        return second + jax.jvp(energies, (point.y,), (bend,))[1]

    return jax.vmap(lambda column: along(column.real) + along(column.imag), in_axes=1, out_axes=1)(v)


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
