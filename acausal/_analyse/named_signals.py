"""Inputs and outputs of a linearised model, by name."""

import dataclasses
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from .._errors import ModelError, suggestion
from .._evaluate.groups import ModelParameters
from .._evaluate.system import System
from .._integrate.setup.expressions import unit_of_expression
from .._integrate.setup.options import names_of
from .._integrate.setup.user_function import as_function
from .._reduce.flat_model import FlatLeaf
from .._unit_check.signal_units import unit_of_leaf

Output = str | Callable[[Any], Any]


class Element(NamedTuple):
    """A scalar in a leaf of the model: element `position` of the flat leaf number `leaf`."""

    leaf: int
    position: int


@dataclasses.dataclass(frozen=True)
class Signals:
    """Names and units of some states, inputs or outputs."""

    names: tuple[str, ...]
    units: tuple[str, ...]


def input_places(system: System, names: Iterable[str]) -> list[Element]:
    """The positions of scalar parameters, by path."""
    places = {
        leaf.name(i): Element(number, i)
        for number, leaf in enumerate(system.flat.own_leaves)
        for i in range(leaf.count)
        if leaf.declaration.role == "param"
    }
    forbidden = _parameters_with_rate(system)
    found = []
    for name in names_of(names, "inputs"):
        if name not in places:
            raise ModelError(_unknown(system, name, "input", "parameter", places))
        leaf = system.flat.leaves[places[name].leaf]
        if leaf.sizes:
            raise ModelError(f"The input {name} is an array of shape {leaf.sizes}: an input is a scalar parameter.")
        if places[name] in forbidden:
            raise ModelError(
                f"The input {name} is in the constraint {forbidden[places[name]]}, whose time derivative is needed: "
                "the response depends on the rate of change of the input, which a state-space form does not contain. "
                "Let it act through a compliant or resistive element, such as a small resistance or a stiff spring."
            )
        found.append(places[name])
    return found


def _unknown(system: System, name: object, role: str, kind: str, known: Iterable[str]) -> str:
    if not isinstance(name, str):
        return f"An {role} is the name of a {kind}, not {name!r}."
    everything = {leaf.name(i) for leaf in system.flat.leaves for i in range(leaf.count)}
    if name in everything:
        return f"The {role} {name} is not a {kind} of the model.{suggestion(name, known)}"
    return f"The model has no {kind} {name!r}.{suggestion(name, known)}"


def _parameters_with_rate(system: System) -> dict[Element, str]:
    """Parameters in equations that were differentiated, with the names of those equations."""
    table, counts = system.reduced.incidence, system.reduced.differentiations
    found: dict[Element, str] = {}
    for row in np.flatnonzero(counts).tolist():
        family, inside = table.place(row)
        for item in family.template.inputs:
            if item.source == "param" and family.instances is not None:
                entry, index = family.instances.place(int(family.members[inside]))
                found[Element(family.instances.leaf(entry, item.slot), index)] = table.row_name(row)
    return found


def with_inputs(params: ModelParameters, places: Sequence[Element], u: Array) -> ModelParameters:
    """Parameters with the numbers `u` as inputs."""
    leaves = dict(params.leaves)
    for i, (leaf, index) in enumerate(places):
        whole = jnp.asarray(leaves[leaf], float)
        leaves[leaf] = whole.reshape(-1).at[index].set(u[i]).reshape(whole.shape)
    return params.changed(leaves)


def input_values(params: ModelParameters, places: Sequence[Element]) -> Array:
    values = [jnp.reshape(params.leaves[leaf], (-1,))[index] for leaf, index in places]
    return jnp.stack(values) if values else jnp.zeros(0)


def input_signals(system: System, places: Sequence[Element]) -> Signals:
    leaves = [system.flat.leaves[place.leaf] for place in places]
    names = tuple(leaf.name(place.position) for leaf, place in zip(leaves, places, strict=True))
    return Signals(names, tuple(unit_of_leaf(system.flat, place.leaf) for place in places))


def state_signals(system: System) -> Signals:
    """Each element of the state vector; `der(x)` has the unit of x per second."""
    names: list[str] = []
    units: list[str] = []
    for (variable, order), name in zip(system.states, system.state_names, strict=True):
        leaf = system.flat.leaves[system.flat.leaf_of_node[system.ordered.table.variables[variable]]]
        elements = _elements(name, leaf, system.plan.shapes[variable])
        names += elements
        units += [leaf.declaration.unit + ("" if order == 0 else "/s" if order == 1 else f"/s{order}")] * len(elements)
    return Signals(tuple(names), tuple(units))


def _elements(name: str, leaf: FlatLeaf, shape: tuple[int, ...]) -> list[str]:
    """A name for each element of an array, in row-major order."""
    return [name + leaf.declaration.element(place) for place in np.ndindex(*shape)]


def output_signals(system: System, outputs: Sequence[Output] | Mapping[str, Output]) -> tuple[Signals, Any]:
    """Names and units of outputs, and a function from a view of the model to the list of their values."""
    if isinstance(outputs, str) or callable(outputs):
        outputs = (outputs,)
    pairs = outputs.items() if isinstance(outputs, Mapping) else [(None, output) for output in outputs]
    names: list[str] = []
    units: list[str] = []
    readers: list[Callable[[Any], list[Any]]] = []
    for position, (given, output) in enumerate(pairs):
        if callable(output):
            names.append(given or f"outputs[{position}]")
            units.append(unit_of_expression(as_function(output, names[-1]), system.flat, "outputs"))
            readers.append(lambda view, function=output: [function(view)])
        else:
            leaf, index = _variable(system, output)
            elements = _elements(given or output, leaf, leaf.sizes)
            names += elements
            number = system.flat.leaves.index(leaf)
            units += [unit_of_leaf(system.flat, number)] * len(elements)
            readers.append(_reader(number, index, leaf))
    return Signals(tuple(names), tuple(units)), lambda view: [value for reader in readers for value in reader(view)]


def _variable(system: System, name: str) -> tuple[FlatLeaf, int]:
    known = {
        leaf.name(i): (leaf, i)
        for leaf in system.flat.leaves
        for i in range(leaf.count)
        if leaf.declaration.is_variable
    }
    if name not in known:
        raise ModelError(_unknown(system, name, "output", "variable", known))
    return known[name]


def _reader(number: int, index: int, leaf: FlatLeaf) -> Callable[[Any], list[Any]]:
    size = math.prod(leaf.sizes)
    return lambda view: list(
        jnp.reshape(jax.tree_util.tree_leaves(view)[number], (-1,))[index * size : (index + 1) * size]
    )
