"""Opened loops: a parameter drives a signal in place of its source."""

import copy
import functools as ft
from collections.abc import Sequence
from typing import Any, NamedTuple

from .._declare.annotations import Param, Scalar
from .._declare.by_name import replace
from .._declare.component import Component, Connection, Connections, eq
from .._declare.node import Port, derived, extended, leaves_of
from .._errors import ModelError
from .._evaluate.building import system_of
from .operating_point import OperatingPoint

FIELD = "_opened_"


class Break(NamedTuple):
    """An opened loop: the port, and the parameter that replaces its signal."""

    port: str
    signal: str
    parameter: str


def opened(model: Component, ports: Sequence[str]) -> tuple[Component, list[Break]]:
    """The model with loops opened at ports with one variable and no flow."""
    breaks = []
    for number, port in enumerate(ports):
        model, found = _broken(model, port, f"{FIELD}{number}")
        breaks.append(found)
    return model, breaks


def continued(model: Component, point: OperatingPoint, breaks: Sequence[Break]) -> tuple[Component, Component]:
    """The opened model, whose new parameters have the values of the signals at a point of the closed model, and a view
    of the opened model at that point.
    """
    flat, system = point.system.flat, system_of(model)
    values = dict(zip((leaf.path for leaf in flat.leaves), point.read(range(len(flat.leaves)), point.y), strict=True))
    for one in breaks:
        owner = one.parameter.removesuffix("k")
        values |= {
            one.parameter: values[one.signal],
            owner + one.signal.replace(one.port, "port", 1): values[one.signal],
        }
    view = system.flat.structure.unflatten([values[leaf.path] for leaf in system.flat.own_leaves])
    return replace(model, {one.parameter: values[one.signal] for one in breaks}), view


def _broken(model: Component, path: str, field: str) -> tuple[Component, Break]:
    parts = path.split(".")
    owners: list[Any] = [model]
    for part in parts:
        owners.append(getattr(owners[-1], part, None))
    port: Any = owners[-1]
    leaves = list(leaves_of(port)) if isinstance(port, Port) else []
    if len(leaves) != 1 or leaves[0].declaration.role != "var":
        raise ModelError(f"{path!r} is not a signal: to open a loop, name a port of one value, such as 'controller.y'.")
    for depth in range(len(parts) - 2, -1, -1):
        if any(port is other for connection in owners[depth].connections() for other in connection.ports):
            break
    else:
        raise ModelError(f"{path} is not connected, so there is no loop to open.")
    prefix = "".join(f"{part}." for part in parts[:depth])
    kind: Any = type(port)
    cls = _opened_class(type(owners[depth]), ".".join(parts[depth:]), field, kind)
    made: Any = extended(owners[depth], cls, **{field: _source_class(kind)()})
    for owner, part in zip(reversed(owners[:depth]), reversed(parts[:depth]), strict=True):
        made = _changed(owner, part, made)
    return made, Break(path, f"{path}.{leaves[0].path}", f"{prefix}{field}.k")


def _changed(owner: Component, name: str, value: Any) -> Any:
    made = copy.copy(owner)
    object.__setattr__(made, name, value)
    return made


class _Opening(Component, partial=True):
    """A source that drives a port with the value of a parameter."""

    k: Param[Scalar, ""] = 0.0


@ft.cache
def _source_class(port: Any) -> Any:
    (leaf,) = leaves_of(port())

    def equations(self: Any, d: Any) -> Any:
        return dict(opened=eq(getattr(self.port, leaf.path), self.k, check_units=False))

    return derived(_Opening, {"port": port}, {"port": port(), "equations": equations})


@ft.cache
def _opened_class(cls: Any, path: str, field: str, port: Any) -> Any:
    """The class with connections in which another source drives one of its signals."""

    def connections(self: Any) -> Connections:
        signal, source = ft.reduce(getattr, path.split("."), self), getattr(self, field).port
        return tuple(_moved(connection, signal, source) for connection in cls.connections(self))

    return derived(cls, {field: _source_class(port)}, {"connections": connections})


def _moved(connection: Connection, signal: Port, source: Port) -> Connection:
    return Connection(tuple(source if port is signal else port for port in connection.ports))
