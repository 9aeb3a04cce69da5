"""A model whose open signal inputs are driven from outside."""

import functools as ft
from collections.abc import Sequence
from typing import Any

from ..._declare.annotations import Scalar, Var, prefer
from ..._declare.component import Component, Connections, Equations, connect, eq
from ..._declare.node import Port, derived, extended, leaves_of, nodes_of
from ..._errors import ModelError, suggestion

FIELD = "_inputs"


class FromOutside(Component, partial=True):
    """A source of a signal that changes between evaluations only: a state with the rate 0.

    As a state it has exact derivatives, like any other.
    """

    value: Var[Scalar, "", prefer] = 0.0

    def equations(self, d: Any) -> Equations:
        return dict(held=eq(d.value))


@ft.cache
def _source(port: Any) -> Any:
    """A source for a class of signal port."""
    (leaf,) = leaves_of(port())

    def equations(self: Any, d: Any) -> Equations:
        held = FromOutside.equations(self, d)
        return held | dict(signal=eq(getattr(self.port, leaf.path), self.value, check_units=False))

    return derived(FromOutside, {"port": port}, {"port": port(), "equations": equations})


def driven(model: Component, inputs: Sequence[str]) -> tuple[Component, list[str]]:
    """The model with sources at its open inputs, and the paths of the variables that hold their values.

    Raises `ModelError` for a name that is not an open signal input.
    """
    if not inputs:
        return model, []
    ports = {path: node for path, node in nodes_of(model) if isinstance(node, Port) and type(node).needs_connection}
    for name in inputs:
        if inputs.count(name) > 1:
            raise ModelError(f"inputs names {name} more than once.")
        if name not in ports:
            raise ModelError(
                f"{name!r} is not an open signal input, such as a block's u.{suggestion(name, ports)} Quantities that "
                "are constant during a run are parameters, which an FMU can set too."
            )
    classes: tuple[Any, ...] = tuple(type(ports[name]) for name in inputs)
    own_class: Any = type(model)
    cls = _driven_class(own_class, tuple(inputs), classes)
    fields = {}
    for i, (name, port) in enumerate(zip(inputs, classes, strict=True)):
        (leaf,) = leaves_of(ports[name])
        start = leaf.value if leaf.value is not None else leaf.declaration.guess
        fields[f"{FIELD}{i}"] = _source(port)(value=float(start))
    return extended(model, cls, **fields), [f"{name}.value" for name in fields]


@ft.cache
def _driven_class(cls: Any, inputs: tuple[str, ...], ports: tuple[Any, ...]) -> Any:
    def connections(self: Any) -> Connections:
        nodes: dict[str, Any] = dict(nodes_of(self))
        own = [connect(getattr(self, f"{FIELD}{i}").port, nodes[name]) for i, name in enumerate(inputs)]
        return (*cls.connections(self), *own)

    fields = {f"{FIELD}{i}": _source(port) for i, port in enumerate(ports)}
    return derived(cls, fields, {"connections": connections})
