"""Responses of a linear system in time and frequency, traceable."""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
from jax import Array

from .._errors import ModelError
from .._interpret.in_parts import in_parts

SQUARINGS = 64  # maximum in the matrix exponential: enough for all time scales in double precision

Matrices = tuple[Array, Array, Array, Array]


def frequency(matrices: Matrices, w: Array) -> Array:
    """C (i w - A)^-1 B + D for each element of `w`."""
    A, B, C, D = matrices

    def at(w: Array) -> Array:
        return C @ jnp.linalg.solve(1j * w * jnp.eye(len(A)) - A, B + 0j) + D

    return jax.vmap(at)(w.reshape(-1)).reshape(*w.shape, *D.shape)


def step(matrices: Matrices, ts: Array) -> Array:
    """C int_0^t exp(A s) ds B + D; the integral is a block of exp([A, B; 0, 0] t)."""
    A, B, C, D = matrices
    n, m = B.shape
    augmented = jnp.zeros((n + m, n + m)).at[:n, :n].set(A).at[:n, n:].set(B)
    return _at_times(lambda t: C @ _exponential(augmented * t)[:n, n:] + D, ts)


def impulse(matrices: Matrices, ts: Array) -> Array:
    """C exp(A t) B."""
    A, B, C, _ = matrices
    return _at_times(lambda t: C @ _exponential(A * t) @ B, ts)


def _exponential(matrix: Array) -> Array:
    return jax.scipy.linalg.expm(matrix, max_squarings=SQUARINGS) if matrix.shape[0] else matrix


def _at_times(function: Callable[[Any], Any], ts: Array) -> Array:
    if ts.ndim != 1:
        raise ModelError(f"The times of a response are a vector of seconds, not an array of shape {ts.shape}.")
    return in_parts(jax.vmap(function))(ts)
