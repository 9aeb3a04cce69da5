"""Padding of rows to a few fixed sizes, so that runs of different lengths share compiled programs."""

from typing import Any

import jax
import numpy as np
from jax import Array

from ..._tracing import is_traced, within_transformation

NUMBERS = (128, 1024)  # larger sizes, and those inside transformations, are powers of two
LEAST = 16


def shared(n: int) -> np.ndarray:
    """The indices of n rows, padded with the last index to the number of rows of a program."""
    rounded = max(LEAST, 1 << (n - 1).bit_length())
    if not within_transformation():
        rounded = next((number for number in NUMBERS if number >= n), rounded)
    return np.minimum(np.arange(rounded), n - 1)


def chosen(rows: Array | np.ndarray, which: Any) -> Array | np.ndarray:
    """The rows selected by an index. Known rows are selected with numpy, because jax compiles for each number of rows,
    even for `jnp.asarray` of them.
    """
    if is_traced(rows) or isinstance(rows, np.ndarray):
        return rows[which]
    return jax.device_put(np.asarray(rows)[which])
