"""The states on which each value depends, from the plan of its computation."""

import functools as ft
import math
from collections.abc import Sequence

import jax
import jax.numpy as jnp
import numpy as np
import scipy  # imports its parts on use

from .._reduce.element_dependence import element_dependence
from .._reduce.incidence import Pair
from .._reduce.jaxpr import structs
from .._sparse_matrix import Structure
from .affine import computed
from .blocks import Known, evaluate_block
from .groups import Group
from .plan import Plan
from .program import Program


def dependence(plan: Plan, pairs: Sequence[Pair]) -> Structure:
    """The states that the elements of pairs depend on: a row for each element, a column for each element of a state.

    All unknowns of a block with an iteration, or with a dense linear system, depend on all that it reads.
    """
    n = int(plan.starts[-1])
    every = np.arange(n)
    known: dict[int, Structure] = {0: scipy.sparse.csr_array((np.ones(n, np.int32), (every, every)), (n, n))}
    for group in plan.needed({plan.places[pair].segment for pair in pairs}):
        read, members = _read(group, known, n), scipy.sparse.eye_array(len(group.uses), dtype=np.int32)
        inside = _inside(group.program, tuple(read.shape for read in group.reads))
        for i, structure in enumerate(inside):
            found = scipy.sparse.csr_array(scipy.sparse.kron(members, structure) @ read)
            found.data[:] = 1
            known[group.first_segment + i] = found
    if not pairs:
        return scipy.sparse.csr_array((0, n), dtype=np.int32)
    segments, positions = plan.positions(pairs)
    return scipy.sparse.csr_array(scipy.sparse.vstack([known[segment] for segment in segments]))[positions]


def _read(group: Group, known: dict[int, Structure], n: int) -> Structure:
    """The states that each element of the values that the members of a group read depends on, member by member."""
    count = len(group.uses)
    parts, places, total = [scipy.sparse.csr_array((0, n), dtype=np.int32)], [np.zeros((count, 0), int)], 0
    for read in group.reads:
        source = scipy.sparse.csr_array(scipy.sparse.vstack([known[segment] for segment in read.segments]))
        places.append(total + read.elements.reshape(count, -1))
        parts.append(source)
        total += source.shape[0]
    return scipy.sparse.csr_array(scipy.sparse.vstack(parts))[np.concatenate(places, axis=1).ravel()]


@ft.lru_cache(maxsize=256)
def _inside(program: Program, read: tuple[tuple[int, ...], ...]) -> list[Structure]:
    """The structure of each unknown of a program: a row for each element, a column for each element that it reads."""
    sizes, n = [math.prod(shape) for shape in program.shapes], sum(math.prod(shape) for shape in read)
    if program.method == "nonlinear" or (max(sizes, default=1) == 1 and n == len(read)):
        return [scipy.sparse.csr_array(np.ones((size, n), np.int32)) for size in sizes]
    steps = (*program.steps, *program.residuals)
    of_params = {
        arg.number: tuple(aval.shape)
        for step in steps
        for arg, aval in zip(step.args, step.template.jaxpr.in_avals, strict=True)
        if arg.source == "param"
    }
    params = structs([of_params[i] for i in range(len(program.params))])

    def unknowns(params: list[jax.Array], values: list[jax.Array], time: jax.Array) -> list[jax.Array]:
        found = evaluate_block(program, Known(params, values, time), [])
        return [jnp.broadcast_to(computed(value), shape) for value, shape in zip(found, program.shapes, strict=True)]

    closed = jax.make_jaxpr(unknowns)(params, structs(read), *structs([()]))
    return element_dependence(closed, [False] * len(params) + [True] * len(read) + [False])
