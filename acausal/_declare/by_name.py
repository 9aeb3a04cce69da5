"""Parameters of a model by name."""

from collections.abc import Mapping
from typing import Any, TypeVar

from .._errors import ModelError, suggestion
from .annotations import Declaration
from .component import Component
from .converters import CONVERTERS
from .layout import rebuilt
from .node import leaves_of

M = TypeVar("M", bound=Component)


def parameters(model: Component) -> dict[str, Any]:
    """The parameters of a model by their path; of a gradient with respect to a model, the sensitivities."""
    return {leaf.path: leaf.value for leaf in leaves_of(model) if leaf.declaration.role == "param"}


def replace(model: M, values: Mapping[str, Any]) -> M:
    """The model with other values of parameters or start values, by path: `replace(model, {"gearbox.ratio": 5.0})`.

    None takes a start value back, so that it counts as not given.

    Raises `ModelError` for a name that the model does not have.
    """
    known = {leaf.path for leaf in leaves_of(model)}
    for name in values:
        if name not in known:
            raise ModelError(f"The model has no parameter or start value {name!r}.{suggestion(name, known)}")

    def new(path: str, declaration: Declaration, value: Any) -> Any:
        if path not in values:
            return value
        return CONVERTERS[declaration.role](values[path], unit=declaration.unit, where=path)

    return rebuilt(model, new)
