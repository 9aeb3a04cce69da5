"""The structure of the Jacobian of a run, if its steps are sparse."""

import functools as ft

import scipy  # imports its parts on use

from ..._evaluate.dependence import dependence
from ..._evaluate.system import System
from ..._linear_solver import LARGEST_INVERSE
from ..._reduce.incidence import Pair
from ..._sparse_matrix import Pattern, pattern_of
from .field import wanted_pairs
from .settings import Settings

SERIAL = 10  # time of a multiplication in the loops of sparse elimination, relative to one of dense elimination
SOLVES = 10  # solutions for each elimination, in a step


def jacobian_pattern(settings: Settings) -> Pattern | None:
    """The structure of the Jacobian of the core of the state vector, if its steps are sparse."""
    system = settings.system
    read = () if settings.integrand is None else tuple(wanted_pairs(system, settings.integrand.leaves))
    return pattern_of_rates(system, read, settings.n_integrals)


@ft.lru_cache(maxsize=16)
def pattern_of_rates(system: System, read: tuple[Pair, ...] = (), n_integrals: int = 0) -> Pattern | None:
    """The structure of the Jacobian of the states and of integrals, each of which may read the same pairs.

    None if dense elimination takes less time, as it does for small models, and for a mass matrix, whose zeros may not
    be pivots.
    """
    n_states = len(system.nominals)
    n = n_states + n_integrals
    if system.mass is not None or n_states <= LARGEST_INVERSE:
        return None
    structure = dependence(system.plan, system.rates)
    if n_integrals:
        row = scipy.sparse.csr_array(dependence(system.plan, read).sum(axis=0)[None] > 0)
        structure = scipy.sparse.csr_array(scipy.sparse.vstack([structure, *([row] * n_integrals)]))
    structure = scipy.sparse.csr_array((structure.data, structure.indices, structure.indptr), (n, n), dtype=bool)
    dense = n_states**3 + SOLVES * n_states * n  # integrals need no elimination
    pattern = pattern_of(structure, most=dense / SERIAL)
    if pattern is None:
        return None
    of = pattern.elimination
    return pattern if SERIAL * (of.work + SOLVES * of.work_of_solve) < dense else None
