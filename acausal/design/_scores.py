"""Members of a sample as scores of the standard normal distribution, from which distributions make parameters."""

import warnings

import numpy as np
from jaxtyping import Float

from .._errors import ParameterError


def member_count(n: int) -> int:
    """The number of members, checked; raises `ParameterError` unless it is an integer of at least 2."""
    if isinstance(n, bool) or not isinstance(n, int | np.integer) or n < 2:
        raise ParameterError(f"The number of members is an integer of at least 2, got {n!r}.")
    return int(n)


def sobol_scores(dimensions: int, n: int, seed: int) -> Float[np.ndarray, "n k"]:
    """Scores of `n` members of a scrambled Sobol sequence, which fills the space evenly."""
    from scipy.special import ndtri
    from scipy.stats import qmc

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that n is no power of two
        points = qmc.Sobol(dimensions, rng=np.random.default_rng(seed)).random(n)
    return ndtri(np.clip(points, 1e-12, 1.0 - 1e-12))
