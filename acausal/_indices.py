"""Indices as constants of programs."""

import numpy as np
import numpy.typing as npt
from jaxtyping import Bool, UInt32


def unsigned(indices: npt.ArrayLike) -> UInt32[np.ndarray, "..."]:
    """Indices that cannot be negative, so that looking them up needs no operation that asks."""
    return np.asarray(indices, np.uint32)


def behind_filler(is_own: Bool[np.ndarray, "..."]) -> UInt32[np.ndarray, "..."]:
    """Where each place finds its value in a vector of a filler and, behind it, the values of the places that are
    their own; the others find the filler.
    """
    return unsigned(np.where(is_own, np.cumsum(is_own).reshape(is_own.shape), 0))
