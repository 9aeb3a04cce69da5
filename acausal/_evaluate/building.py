"""`build`: all structural passes, from a model to its system, and `choose_states`, which runs them with numbers."""

import dataclasses
import functools as ft
from collections.abc import Callable, Sequence
from typing import Any, Literal

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.tree_util import PyTreeDef

from .._declare.component import Component
from .._declare.layout import complete, complete_leaves, layout_of
from .._declare.node import check_is_node
from .._errors import ModelError, StructureError
from .._garbage import seldom_collected
from .._jax_settings import check_precision
from .._made_once import made_once
from .._numbers import Numbers
from .._reduce.aliases import Family, Merged, merge
from .._reduce.cancel import reduced_exactly
from .._reduce.class_equations import templates
from .._reduce.flat_model import FlatModel, Instances
from .._reduce.flatten import flatten
from .._reduce.incidence import Pair, ranges_of_pair
from .._reduce.index import Reduced
from .._reduce.jaxpr import as_function
from .._reduce.jumps import warn_of_jumps
from .._reduce.preferred import with_preferred
from .._reduce.sort import Sorted, sort
from .._reduce.states import select_states
from .._reduce.tear import Torn, tear
from .._reduce.template import Template
from .._reduce.traced import is_reversible
from .._tracing import is_traced
from .._unit_check.model_units import check_units
from .groups import ModelParameters
from .plan import Plan
from .program import program_of
from .starts import Inputs, Starts
from .system import System


@seldom_collected()
def build(model: Component, values: Callable[[Merged, Reduced], np.ndarray] | None = None) -> System:
    """Run the structural passes. `values` gives the numbers for the choice of states; see `select_states`."""
    flat, merged, reduced = _reduced(model)
    _check_all_determined(flat, merged, reduced)
    pivots = None if values is None else values(merged, reduced)
    chosen = select_states(reduced, pivots)
    ordered = sort(chosen)
    ordered.states.sort(key=_layout(ordered))
    torn = [tear(ordered, block) for block in ordered.blocks]
    _check_loops(ordered, torn)
    kinds = {id(instances): index for index, instances in enumerate(flat.instances)}
    plan = _plan(ordered, torn, kinds, [])
    return System(flat, merged, reduced, chosen, ordered, torn, plan, kinds, [], (_again, (_shapes(model), pivots)))


def system_of(model: Component) -> System:
    """The system of a model, from its structure alone; cached."""
    check_is_node(model)
    leaves, structure = jax.tree_util.tree_flatten(model)
    return system_of_leaves(structure, leaves)


def system_of_leaves(structure: PyTreeDef, leaves: Sequence[Numbers]) -> System:
    """The same from the leaves of a model."""
    check_precision()
    return _system(structure, tuple(() if isinstance(leaf, float) else np.shape(leaf) for leaf in leaves))


@ft.lru_cache(maxsize=256)
def _system(structure: PyTreeDef, shapes: tuple[tuple[int, ...], ...]) -> System:
    """The same system for a model with and without start values."""
    layout = layout_of(structure)
    return _complete(layout.structure, tuple(() if shape is None else shape for shape in layout.spread(shapes)))


@made_once(maxsize=4096)
def _complete(structure: PyTreeDef, shapes: tuple[tuple[int, ...], ...]) -> System:
    """The system of all complete models with this tree structure and leaves of these shapes.

    It is cached for longer than by `_system`, so that `_again` finds the system that a model has.
    """
    return build(structure.unflatten(list(map(_shape, shapes))))


def check_structure(model: object, system: System, what: str) -> None:
    """Raise if a model, or a view of one, differs in structure from the model of the system."""
    if layout_of(jax.tree_util.tree_structure(model)).structure != system.flat.structure:
        raise ModelError(
            f"{what} has another structure than the model of the system, a {system.name}: the class, "
            "the parts and the static fields must be equal."
        )


def _shapes(model: Component) -> Component:
    """A model with the shapes of its leaves in place of their values, from which its system can be rebuilt."""
    leaves, structure = jax.tree_util.tree_flatten(complete(model))
    return structure.unflatten([_shape(np.shape(leaf)) for leaf in leaves])


@ft.lru_cache(maxsize=1024)
def _shape(shape: tuple[int, ...]) -> jax.ShapeDtypeStruct:
    return jax.ShapeDtypeStruct(shape, float)


def _again(model: Component, pivots: np.ndarray | None) -> System:
    """The rebuilt system, possibly in another process."""
    if pivots is not None:
        return build(model, lambda merged, reduced: pivots)
    leaves, structure = jax.tree_util.tree_flatten(model)
    return _complete(structure, tuple(leaf.shape for leaf in leaves))


def _reduced(model: Component) -> tuple[FlatModel, Merged, Reduced]:
    """The reduced equations. Arrays stay whole unless the model determines one in parts, or equations read parts of
    one.
    """
    flat = flatten(model)
    check_units(flat)
    warn_of_jumps(flat)
    if not any(_reads_stacked_parts(flat, instances) for instances in flat.instances):
        try:
            return flat, *_with_preferred(flat)
        except StructureError:
            has_arrays = any(leaf.sizes and leaf.declaration.is_variable for leaf in flat.leaves)
            if not has_arrays and not any(_equates_arrays(instances) for instances in flat.instances):
                raise
    flat = flatten(model, split=True)
    return flat, *_with_preferred(flat)


def _with_preferred(flat: FlatModel) -> tuple[Merged, Reduced]:
    merged, reduced = reduced_exactly(flat, merge(flat))
    return merged, with_preferred(reduced)


def _reads_stacked_parts(flat: FlatModel, instances: Instances) -> bool:
    """Whether equations read variables of an array of parts, whose members are separate nodes."""
    sizes = instances.kind.sizes
    try:
        stated = templates(instances.kind)
    except ModelError:  # raised again when the equations are assembled
        return False
    inputs = {item for template in stated for item in template.inputs if item.source == "var"}
    return any(sizes[item.slot] != flat.leaves[instances.leaf(0, item.slot)].sizes for item in inputs)


def _equates_arrays(instances: Instances) -> bool:
    return any(template.shape for template in templates(instances.kind))


def _check_all_determined(flat: FlatModel, merged: Merged, reduced: Reduced) -> None:
    if reduced.incidence.n_rows == 0 and flat.n_nodes == 0:
        raise StructureError("The model has no variables: give it components with equations.")
    nodes = np.unique(merged.representative)
    missing = np.setdiff1d(nodes[nodes >= 0], reduced.incidence.variables)
    if len(missing):
        names = ", ".join(flat.placed_name(int(node)) for node in missing[:10])
        raise StructureError(
            f"Too few equations: no equation determines {names}.\n  Remedy: add one, connect the port of the "
            "variable, or remove the variable."
        )


def _check_loops(ordered: Sorted, torn: list[Torn]) -> None:
    table = ordered.table
    for row in [row for block in torn if block.method == "nonlinear" for row in block.rows]:
        if not is_reversible(table.place(row)[0].template.jaxpr):
            raise ModelError(
                f"{table.row_name(row)} contains a loop of variable length (jax.lax.while_loop), and "
                "is solved simultaneously with other equations, which needs derivatives in reverse mode. "
                "Remedy: a loop of fixed length (jax.lax.scan, or fori_loop between two plain numbers), or a variable "
                "of its own for the result, with its derivative stated by jax.custom_jvp."
            )


def mass_matrix_form(system: System) -> System:
    """The same system with the tearing variables of its simultaneous blocks as algebraic unknowns of the integrator."""
    algebraic = [system.ordered.unknowns[unknown] for torn in system.torn for unknown in torn.tears]
    explicit = [Torn(torn.steps, [], [], "explicit", torn.level) for torn in system.torn if torn.steps]
    plan = _plan(system.ordered, explicit, system.kind_index, algebraic)
    made = (mass_matrix_form, (system,))
    return dataclasses.replace(system, plan=plan, algebraic=algebraic, made=made, solved=system)


def _plan(ordered: Sorted, torn: list[Torn], kinds: dict[int, int], algebraic: list[Pair]) -> Plan:
    table = ordered.table
    uses = [(block.level, program_of(ordered, block, kinds)) for block in torn]
    shapes = [table.flat.leaves[leaf].sizes for leaf in table.flat.leaf_of_node[table.variables]]
    states = [*ordered.states, *algebraic]
    ranges = {pair: found for pair in states if (found := ranges_of_pair(table, pair))}
    return Plan(uses, states, shapes, ranges)


def _layout(ordered: Sorted) -> Any:
    """States of like components side by side, so that vectorised evaluation reads one slice."""
    flat = ordered.table.flat
    group = np.full(flat.n_nodes, -1)
    for index, instances in enumerate(flat.instances):
        nodes = flat.nodes(instances)
        for slot in range(nodes.shape[1]):
            members = nodes[nodes[:, slot] >= 0, slot]
            group[members] = index * 1000 + slot

    def key(pair: Pair) -> tuple[int, int, int]:
        node = int(ordered.table.variables[pair[0]])
        return int(group[node]), pair[1], node

    return key


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
