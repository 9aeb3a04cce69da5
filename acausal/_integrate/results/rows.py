"""How many rows a program is compiled for: a few numbers of them, so that runs that differ in it share programs."""

from typing import Any

import jax
import numpy as np
from jax import Array

from ..._tracing import is_traced, within_transformation

NUMBERS = (128, 1024)  # beyond these, and where rows are differentiated or batched, powers of two
LEAST = 16


def shared(n: int) -> np.ndarray:
    """The indices of n rows, with the last one repeated up to the number of rows of a program."""
    rounded = max(LEAST, 1 << (n - 1).bit_length())
    if not within_transformation():
        rounded = next((number for number in NUMBERS if number >= n), rounded)
    return np.minimum(np.arange(rounded), n - 1)


def chosen(rows: Array | np.ndarray, which: Any) -> Array | np.ndarray:
    """What an index chooses. Outside of transformations numpy does: jax compiles anew for each number of rows, also for
    `jnp.asarray` of them.
    """
    if is_traced(rows) or isinstance(rows, np.ndarray):
        return rows[which]
    return jax.device_put(np.asarray(rows)[which])
