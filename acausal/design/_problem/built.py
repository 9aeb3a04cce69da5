"""Constructor arguments as free parameters: numbers from which a component computes its parameters when it is built."""

import dataclasses
import functools as ft
from collections.abc import Mapping
from typing import Any

import jax
import numpy as np

from ..._declare.by_name import arguments_of, with_arguments
from ..._declare.component import Component
from ..._declare.fields import join
from ..._declare.node import Node, leaves_of, nodes_of
from ..._errors import ModelError
from ..._reduce.jaxpr import slice_output
from ..._units.quantity import magnitude


@dataclasses.dataclass(frozen=True, eq=False)
class Built:
    """A component to be built with other arguments, and the leaves that each of them determines."""

    path: str
    _node: Node
    determined: Mapping[str, frozenset[str]]  # paths in the component, by argument
    units: Mapping[str, str]  # of the arguments that are values of a parameter
    values: Mapping[str, float]  # of the arguments

    def leaves(self, arguments: Mapping[str, Any]) -> dict[str, Any]:
        """The leaves that some arguments determine, by path in the model."""
        made = with_arguments(self._node, arguments, self.path)
        names = frozenset().union(*(self.determined[name] for name in arguments))
        return {join(self.path, leaf.path): leaf.value for leaf in leaves_of(made) if leaf.path in names}


def built_parts(model: Component, paths: set[str]) -> dict[str, Built]:
    """The component of each path that names a numeric constructor argument. Other paths are left out."""
    nodes, found = dict(nodes_of(model)), {}
    for above in {path.rpartition(".")[0] for path in paths} & nodes.keys():
        names = {path.rpartition(".")[2]: path for path in paths if path.rpartition(".")[0] == above}
        leaves = {leaf.path for leaf in leaves_of(nodes[above])}
        given = arguments_of(nodes[above]) or {}
        values = {name: given[name] for name in names if name not in leaves and _is_number(given.get(name))}
        if values:
            made = _built(above, nodes[above], values)
            found |= {names[name]: made for name in values}
    return found


def _is_number(value: object) -> bool:
    number = magnitude(value, "")
    return isinstance(number, int | float | np.ndarray | jax.Array) and np.ndim(number) == 0 and number is not True


def _built(path: str, node: Node, values: Mapping[str, object]) -> Built:
    numbers = {name: float(magnitude(value, "")) for name, value in values.items()}
    leaves = [leaf for leaf in leaves_of(node) if leaf.value is not None]
    determined, units = {}, {}
    for name, number in numbers.items():
        of_argument = ft.partial(_values, node, path, name, [leaf.path for leaf in leaves])
        try:
            closed = jax.make_jaxpr(of_argument)(number)
        except (ModelError, jax.errors.TracerArrayConversionError, jax.errors.ConcretizationTypeError) as error:
            raise ModelError(
                f"{join(path, name)} cannot be varied: the constructor of {type(node).__name__} needs its value. Vary "
                "the parameters that it computes."
            ) from error
        own = [leaf for i, leaf in enumerate(leaves) if slice_output(closed, i).used]
        determined[name] = frozenset(leaf.path for leaf in own)
        equal = {leaf.declaration.unit for leaf in own if np.array_equal(leaf.value, number)}
        units[name] = equal.pop() if len(equal) == 1 else ""
    return Built(path, node, determined, units, numbers)


def _values(node: Node, path: str, name: str, leaves: list[str], value: Any) -> list[Any]:
    """The leaves of a node that is built with another argument."""
    made = {leaf.path: leaf.value for leaf in leaves_of(with_arguments(node, {name: value}, path))}
    return [made[leaf] for leaf in leaves]
