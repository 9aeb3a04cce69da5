"""The states on which each value depends, from the plan of its computation."""

from collections.abc import Sequence

import numpy as np
import scipy  # imports its parts on use

from .._reduce.incidence import Pair
from .._sparse_order import Structure
from .groups import Group
from .plan import Plan


def dependence(plan: Plan, pairs: Sequence[Pair]) -> Structure:
    """The states that the elements of pairs depend on: a row for each element, a column for each element of a state.

    A block depends on all that it reads, so a block of array variables hides which of their elements depend on which.
    """
    n = int(plan.starts[-1])
    every = np.arange(n)
    known: dict[int, Structure] = {0: scipy.sparse.csr_array((np.ones(n, np.int32), (every, every)), (n, n))}
    for group in plan.needed({plan.places[pair].segment for pair in pairs}):
        read = _read(group, known, n)
        for i, shape in enumerate(group.program.shapes):
            size = int(np.prod(shape))
            known[group.first_segment + i] = read[np.repeat(np.arange(len(group.uses)), size)] if size != 1 else read
    if not pairs:
        return scipy.sparse.csr_array((0, n), dtype=np.int32)
    segments, positions = plan.positions(pairs)
    return scipy.sparse.csr_array(scipy.sparse.vstack([known[segment] for segment in segments]))[positions]


def _read(group: Group, known: dict[int, Structure], n: int) -> Structure:
    """The states that each member of a group depends on."""
    count = len(group.uses)
    total = scipy.sparse.csr_array((count, n), dtype=np.int32)
    for read in group.reads:
        source = scipy.sparse.csr_array(scipy.sparse.vstack([known[segment] for segment in read.segments]))
        elements = read.elements.reshape(count, -1)
        member = np.repeat(np.arange(count), elements.shape[1])
        chosen = scipy.sparse.csr_array(
            (np.ones(len(member), np.int32), (member, elements.ravel())), (count, len(source.indptr) - 1)
        )
        total = total + chosen @ source
        total.data[:] = 1
    return total
