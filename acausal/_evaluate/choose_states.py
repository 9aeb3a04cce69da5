"""`choose_states`: the structural passes on a model with concrete numbers."""

import functools as ft
from collections.abc import Callable, Sequence
from typing import Literal

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from .._declare.component import Component
from .._declare.layout import complete_leaves
from .._errors import ModelError
from .._numbers import Numbers
from .._reduce.aliases import Family, Merged
from .._reduce.index import Reduced
from .._reduce.jaxpr import as_function
from .._reduce.template import Template
from .._tracing import is_traced
from .building import build, mass_matrix_form
from .packing import ModelParameters
from .starts import Inputs, Starts
from .system import System


def choose_states(model: Component, *, algebraic: Literal["solve", "integrate"] = "solve") -> System:
    """Choose states and sort the equations of a model, pivoting on its numbers at the start values.

    The result fixes the choice: `simulate(model, ..., system=choose_states(model))`. By default, `simulate` chooses
    from the classes alone: the choice does not depend on the numbers and works under `jit`.

    Raises `ModelError` or `ParameterError` for an invalid model.

    `algebraic`: simultaneous blocks are solved within the vector field ("solve"), or their tearing variables become
    algebraic unknowns of the integrator ("integrate": the index-1 mass-matrix form M dy/dt = f(t, y)).
    """
    leaves, _ = complete_leaves(model)
    if any(is_traced(leaf) for leaf in leaves):
        raise ModelError("choose_states(model) needs concrete numbers: call it outside jit, grad and vmap.")
    if algebraic not in ("solve", "integrate"):
        raise ModelError(f'algebraic={algebraic!r} is not known: use "solve" or "integrate".')
    system = build(model, ft.partial(_coefficients, leaves))
    system.intake.check(leaves)
    return system if algebraic == "solve" else mass_matrix_form(system)


def _coefficients(leaves: Sequence[Numbers | None], merged: Merged, reduced: Reduced) -> np.ndarray:
    """The coefficient of each table entry at the start values, for equations that index reduction differentiates."""
    table = reduced.incidence
    starts = Starts(table.flat, merged)
    given = frozenset(i for i in table.flat.variable_leaves if leaves[i] is not None)
    inputs = Inputs(ModelParameters(), starts.pack(leaves), given)
    keys = (table.row * table.n_variables + table.variable) * 16 + table.order
    result = np.zeros(len(keys))
    for index, family in enumerate(table.families):
        first = int(table.offsets[index])
        for row in np.flatnonzero(reduced.differentiations[first : first + len(family.members)]).tolist():
            for position, slope in _slopes(family, row, leaves, starts, inputs):
                variable = table.number_of_node[int(family.nodes[row, position])]
                key = ((first + row) * table.n_variables + variable) * 16 + family.template.inputs[position].order
                result[np.searchsorted(keys, key)] += slope
    return result


def _slopes(
    family: Family, row: int, leaves: Sequence[Numbers | None], starts: Starts, inputs: Inputs
) -> list[tuple[int, float]]:
    template = family.template
    values = [_input(family, row, i, leaves, starts, inputs) for i in range(len(template.inputs))]
    live = [i for i in template.unknowns if int(family.nodes[row, i]) >= 0]
    slopes = _jacobian(template)(*values)
    return [(i, float(np.mean(slopes[i])) * int(family.signs[row, i])) for i in live]


@ft.lru_cache(maxsize=256)
def _jacobian(template: Template) -> Callable[..., Sequence[Array]]:
    """The gradient of the sum over the elements of a residual."""
    residual = as_function(template.jaxpr)
    positions = tuple(range(len(template.inputs)))
    return jax.jit(jax.grad(lambda *values: jnp.sum(residual(*values)), argnums=positions))


def _input(
    family: Family, row: int, position: int, leaves: Sequence[Numbers | None], starts: Starts, inputs: Inputs
) -> Numbers:
    item, shape = family.template.inputs[position], family.template.jaxpr.in_avals[position].shape
    if item.source in ("param", "discrete"):
        assert family.instances is not None
        return jnp.asarray(_parameter(family, row, item.slot, leaves), float)
    node = int(family.nodes[row, position])
    if item.source == "time" or item.order > 0 or node < 0:
        return jnp.zeros(shape)
    return int(family.signs[row, position]) * starts.values(inputs, [node]).reshape(shape)


def _parameter(family: Family, row: int, slot: int, leaves: Sequence[Numbers | None]) -> Numbers | None:
    instances = family.instances
    assert instances is not None
    member, inside = instances.place(int(family.members[row]))
    if slot >= instances.kind.n_own:
        return np.zeros(instances.kind.sizes[slot])
    value = leaves[instances.leaf(member, slot)]
    if value is None:  # a discrete variable with the default start value
        value = np.broadcast_to(
            instances.kind.declarations[slot].guess, instances.stacks[member] + instances.kind.sizes[slot]
        )
    if not instances.stacks[member]:
        return value
    return np.reshape(np.asarray(value), (-1, *instances.kind.sizes[slot]))[inside]
