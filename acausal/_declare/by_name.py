"""Parameters of a model by name."""

from collections.abc import Mapping
from typing import Any, TypeVar

import jax

from .._errors import ModelError, suggestion
from .component import Component
from .node import as_parameter, as_start, leaves_of

M = TypeVar("M", bound=Component)


def parameters(model: Component) -> dict[str, Any]:
    """The parameters of a model by their path; of a gradient with respect to a model, the sensitivities."""
    return {leaf.path: leaf.value for leaf in leaves_of(model) if leaf.declaration.role == "param"}


def replace(model: M, values: Mapping[str, Any]) -> M:
    """The model with other values of parameters or start values, by path: `replace(model, {"gearbox.ratio": 5.0})`.

    Raises `ModelError` for a name that the model does not have.
    """
    leaves, structure = jax.tree_util.tree_flatten(model)
    declared = list(leaves_of(model))
    places = {leaf.path: i for i, leaf in enumerate(declared)}
    for name, value in values.items():
        if name not in places:
            raise ModelError(f"The model has no parameter or start value {name!r}.{suggestion(name, places)}")
        index = places[name]
        declaration = declared[index].declaration
        convert = as_parameter if declaration.role == "param" else as_start
        leaves[index] = convert(value, unit=declaration.unit, where=name)
    return structure.unflatten(leaves)
