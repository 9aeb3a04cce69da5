"""Causes of failures: linear blocks that are singular up to rounding, and the unknown that belongs to a failure."""

import functools as ft
from collections.abc import Iterable

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import PyTree

from .._indices import joined
from .._interpret.in_parts import in_parts
from .._numbers import Numbers
from .._reduce.aliases import ZERO
from .._reduce.incidence import Pair
from .._reduce.tear import Torn
from .affine import Value
from .blocks import tear_matrix
from .common_subexpressions import once
from .groups import Group, ModelParameters, Segments, SlotValues, over_members
from .starts import Inputs
from .system import System

CHANGE = 1e-6  # relative perturbation of the inputs of a determinant
GROWTH = 1e7  # growth of a determinant by the perturbation above which it counts as zero
GOLDEN = 0.5 * (5.0**0.5 - 1.0)


def singular_blocks(system: System, store: Segments, inputs: Inputs) -> list[Array]:
    """For each linear block, in the order of `linear_blocks`, whether it is singular up to rounding.

    If coefficients cancel, as in 0.3 - 0.1 * 3.0, a rounding error remains instead of zero, and no NaN appears. But the
    determinant is then much smaller than after a small perturbation of its inputs.
    """
    groups = _linear_groups(system)
    slots = {key: inputs.params.slots[key] for group in groups for key in group.program.params}
    segments = {segment: store.segments[segment] for group in groups for segment in group.depends}

    def matrices(slots: dict[tuple[int, int], SlotValues], segments: dict[int, Value]) -> list[Array]:
        params, values = ModelParameters(slots), Segments(store.time, segments)
        return [
            over_members(group, values, params, lambda known, _, g=group: tear_matrix(g.program, known), [])
            for group in groups
        ]

    numbers = _plain_and_changed((slots, segments))
    found = jax.vmap(lambda numbers: once(lambda: matrices(*numbers)), axis_size=2)(numbers) if groups else []
    sizes = map(_log_determinant, found)
    return [jnp.any(changed - plain > np.log(GROWTH), axis=1) for plain, changed in sizes]


def linear_blocks(system: System) -> list[Pair]:
    """The first unknown of each linear block."""
    return [use.gives[0] for group in _linear_groups(system) for use in group.uses]


def _linear_groups(system: System) -> list[Group]:
    return [group for group in system.plan.groups if group.program.method == "linear"]


def _plain_and_changed(numbers: PyTree) -> PyTree:
    """The numbers, stacked with perturbed ones. The perturbations differ, so that they do not cancel."""
    leaves, structure = jax.tree.flatten(numbers)
    starts = np.cumsum([1, *map(np.size, leaves)]).tolist()

    def both(x: Numbers, start: int) -> Numbers:
        share = ((start + np.arange(np.size(x))) * GOLDEN % 1.0).reshape(np.shape(x))
        return np.stack([np.ones(share.shape), 1.0 + CHANGE * share]) * x

    return structure.unflatten(map(both, leaves, starts))


def _log_determinant(matrices: Array) -> Array:
    """The logarithm of determinants, since that of a large matrix may overflow or underflow."""
    if matrices.shape[-1] == 1:
        return jnp.log(jnp.abs(matrices[..., 0, 0]))
    return jnp.linalg.slogdet(matrices)[1]


def first_not_finite(system: System, t: Numbers, y: Array, inputs: Inputs) -> Pair | None:
    """The first unknown, in the order of computation, that is not finite at a point."""
    return next(iter(_marked(system.plan.places, _not_finite_at(system, t, y, inputs))), None)


def insolvable(system: System, t: Numbers, y: Array, inputs: Inputs) -> tuple[list[Pair], list[Pair]]:
    """The unknowns that are not finite at a point, and the first unknowns of linear blocks that are singular there."""
    not_finite, singular = _insolvable_at(system, t, y, inputs)
    return _marked(system.plan.places, not_finite), _marked(linear_blocks(system), singular)


def _marked(pairs: Iterable[Pair], mask: Array) -> list[Pair]:
    return [pair for pair, is_marked in zip(pairs, np.asarray(mask), strict=True) if is_marked]


@ft.partial(in_parts, static_argnums=(0,))
def _not_finite_at(system: System, t: Numbers, y: Array, inputs: Inputs) -> Array:
    return _not_finite(system, system.evaluate_all(t, y, inputs))


@ft.partial(in_parts, static_argnums=(0,))
def _insolvable_at(system: System, t: Numbers, y: Array, inputs: Inputs) -> tuple[Array, Array]:
    store = system.evaluate_all(t, y, inputs)
    return _not_finite(system, store), joined(singular_blocks(system, store, inputs))


def _not_finite(system: System, store: Segments) -> Array:
    """Whether each unknown is not finite."""
    plan = system.plan
    values = [
        store.flat(place.segment)[place.start : place.start + plan.size(pair[0])] for pair, place in plan.places.items()
    ]
    return jnp.asarray([~jnp.all(jnp.isfinite(value)) for value in values], bool)


def block_of(system: System, pair: Pair) -> Torn | None:
    """The simultaneous block of a pair; None for other pairs."""
    unknowns = system.ordered.unknowns
    return next((torn for torn in system.torn if torn.tears and pair in [unknowns[u] for u in torn.unknowns]), None)


def without_storage(system: System, block: Torn) -> list[tuple[str, str]]:
    """Connections without storage in a block that has to determine their level.

    For each, the connected ports and a component that could store the flow.
    """
    table, flat, representative = system.ordered.table, system.flat, system.merged.representative
    owners = {table.row_name(row).rpartition(".")[0] for row in block.rows}
    met: dict[int, tuple[list[str], list[str], str]] = {}
    for leaf in flat.leaves:
        if leaf.port is None or not leaf.port.storage or leaf.declaration.role != "var":
            continue
        for node in leaf.nodes:
            root = int(representative[node])
            if root != ZERO and _level(system, table.number_of_node[root]) >= block.level:
                port = flat.node_name(node).rpartition(".")[0]
                ports, holders, _ = met.setdefault(root, ([], [], leaf.port.storage))
                ports.append(port)
                holders.append(port.rpartition(".")[0])
    return [(" and ".join(ports), storage) for ports, holders, storage in met.values() if owners & set(holders)]


def _level(system: System, variable: int) -> int:
    """Position of a variable in the order of computation; -1 for a state."""
    unknowns = system.ordered.unknowns
    return next((torn.level for torn in system.torn if (variable, 0) in [unknowns[u] for u in torn.unknowns]), -1)
