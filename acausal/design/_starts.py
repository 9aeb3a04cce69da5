"""Searches for the least squares from several starts."""

import itertools
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.stats import qmc

from ._cores import on_all_cores
from ._least_squares import Minimum, Problem, minimise
from ._search import ALIKE


class Ends(NamedTuple):
    """Where searches from several starts ended, row by row; the sum of squares is infinite where the model could not be
    run.
    """

    starts: Float[np.ndarray, "s n"]
    z: Float[np.ndarray, "s n"]
    chi2: Float[np.ndarray, " s"]


def ends_of(problem: Problem, starts: Float[np.ndarray, "s n"], tolerance: float, most: int) -> Ends:
    """The ends of searches from several starts, on all cores. None follows if the first ones all fail."""
    held, z, chi2 = np.zeros(starts.shape[1], bool), np.array(starts), np.full(len(starts), np.inf)

    def search(which: np.ndarray) -> tuple[int, Minimum]:
        return int(which[0]), minimise(problem, starts[which[0]], held, tolerance, most)

    numbers = np.arange(len(starts))
    others = (found for _, found in on_all_cores(search, numbers[1:], most=1))
    # The first search compiles the program for the others.
    for done, (place, found) in enumerate(itertools.chain([search(numbers[:1])], others), start=1):
        z[place], chi2[place] = found.z, found.chi2 if found.computed else np.inf
        if done >= ALIKE and not np.any(np.isfinite(chi2)):
            break
    return Ends(starts, z, chi2)


def starts_between(problem: Problem, first: np.ndarray, n: int) -> Float[np.ndarray, "s n"]:
    """`first`, and further places between the bounds from Sobol's sequence; within one width where there are none."""
    low, high = (np.asarray(bound) for bound in problem.bounds)
    low, high = np.where(np.isfinite(low), low, first - 1.0), np.where(np.isfinite(high), high, first + 1.0)
    points = qmc.Sobol(len(low), rng=0).random_base2(max(n - 2, 0).bit_length())[: n - 1]
    return np.concatenate([first[None], low + points * (high - low)])
