"""Classes of nodes that are made while a model is translated, and their instances."""

from typing import Any

import equinox as eqx

from ..._declare.annotations import Declaration
from ..._declare.component import Component
from ..._declare.node import derived
from ..._declare.sizes import Sizes


def node_class(base: type, name: str, leaves: dict[str, Declaration], namespace: dict[str, Any]) -> Any:
    """A class of nodes with these leaves, and with the parts that the namespace annotates."""
    fields = {
        name: eqx.field(kw_only=True, default=None, metadata={"declaration": declaration})
        for name, declaration in leaves.items()
    }
    parts = namespace.pop("parts", {})
    annotations = dict.fromkeys(leaves, Any) | dict.fromkeys(parts, Component)
    cls = derived(base, annotations, {**fields, **namespace})
    cls.__name__ = cls.__qualname__ = name
    return cls


def instance(cls: Any, values: dict[str, Any]) -> Any:
    """An instance of a class of nodes, without the checks of constructors."""
    made = object.__new__(cls)
    static = {"nominal": Sizes(), "_past": None} if issubclass(cls, Component) else {}
    for name, value in {**static, **values}.items():
        object.__setattr__(made, name, value)
    return made
