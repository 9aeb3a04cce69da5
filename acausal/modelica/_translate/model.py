"""The component class of translated models."""

from typing import TYPE_CHECKING, Any, ClassVar

import jax

from ..._declare.component import Component
from .._syntax.flat import ExperimentAnnotation

if TYPE_CHECKING:
    from .._syntax.flat import FlatModelica


class ModelicaModel(Component, partial=True):
    """A Modelica model. Parameters and variables are attributes by their Modelica path, as in `model.inertia1.w`.

    Members of arrays of components count from 1, as in Modelica: `model.cell[1]` is the first. `experiment` has the
    times, in s, and the tolerance of the annotation of the model: `simulate(model, model.experiment.stop)`.
    """

    flat: ClassVar["FlatModelica"]
    experiment: ClassVar[ExperimentAnnotation] = ExperimentAnnotation()

    if TYPE_CHECKING:  # the attributes are known when a model is loaded

        def __getattr__(self, name: str) -> Any: ...

    def __reduce__(self) -> Any:
        leaves = jax.tree_util.tree_leaves(self)
        return _rebuilt, (type(self).flat, leaves, [leaf is not None for leaf in _all_leaves(self)])


def _all_leaves(model: ModelicaModel) -> list[Any]:
    return jax.tree_util.tree_leaves(model, is_leaf=lambda x: x is None)


def _rebuilt(flat: "FlatModelica", leaves: list[Any], given: list[bool]) -> ModelicaModel:
    """A model from its flat model and its leaves, which are None where no start value is given."""
    from .build import component

    blank = component(flat)
    values = iter(leaves)
    whole = [next(values) if is_given else None for is_given in given]
    structure = jax.tree_util.tree_structure(blank, is_leaf=lambda x: x is None)
    return jax.tree_util.tree_unflatten(structure, whole)
