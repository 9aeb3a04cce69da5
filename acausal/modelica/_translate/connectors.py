"""Connectors of a model as ports.

Connectors are compatible if their variables are (Modelica 3.6, section 9.3). One with the variables of a port of the
library becomes this port; any other one becomes a port of its own class, which is the same for equal variables.
"""

import dataclasses
import functools as ft
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from components.blocks import Input, Output
from components.electrical import Pin
from components.rotational import Flange as RotationalFlange
from components.thermal import HeatPort
from components.translational import Flange as TranslationalFlange

from ..._declare.annotations import Declaration
from ..._declare.node import Port, leaves_of
from .._syntax.flat import FlatModelica, FlatVariable
from .known import names_in
from .leaves import known_unit
from .nodes import node_class
from .paths import PathTree

_SIGNALS: dict[str, type[Port]] = {"input": Input, "output": Output}
_TYPES = ("Real", "Integer", "Boolean")


@dataclasses.dataclass(frozen=True)
class ConnectorVariable:
    """A variable of a connector."""

    name: str
    unit: str
    dims: tuple[int, ...]
    is_flow: bool


@dataclasses.dataclass(frozen=True)
class Connectors:
    """The ports of a model by the paths of their connectors, and the names of the signals among them."""

    ports: Mapping[str, type[Port]]
    signals: frozenset[str]

    @classmethod
    def of(cls, flat: FlatModelica, tree: PathTree[FlatVariable]) -> "Connectors":
        inputs = [v.name for v in flat.variables.values() if v.causality == "input" and "." not in v.name]
        found = dict(pair for name in (*flat.connectors, *inputs) for pair in _ports(tree.parts.get(name), name))
        ports = {path: port for path, (port, _) in found.items()}
        return cls(ports, frozenset(path for path, (_, is_signal) in found.items() if is_signal))

    def path(self, variable: FlatVariable) -> str:
        """The path of the leaf of a variable."""
        return f"{variable.name}.value" if variable.name in self.signals else variable.name

    def has(self, name: str) -> bool:
        """Whether a variable belongs to a port."""
        return name in self.signals or name.rpartition(".")[0] in self.ports

    def closes(self, residual: Any) -> bool:
        """Whether an equation closes a port. The engine does, if nothing is connected to it."""
        return all(map(self.has, names_in(residual)))


def _ports(branch: PathTree[FlatVariable] | None, path: str) -> Iterator[tuple[str, tuple[type[Port], bool]]]:
    """The ports in a connector: itself, the members of an array, or those that it consists of."""
    if branch is None:
        return
    if branch.item is not None:
        is_open = branch.item.causality == "output" or (branch.item.causality == "input" and not branch.item.binding)
        if _is_plain(branch.item) and is_open:
            yield path, (_signal(branch.item), True)
        return
    for index, member in branch.members.items():
        yield from _ports(member, f"{path}[{','.join(map(str, index))}]")
    variables = [inner.item for inner in branch.parts.values() if inner.item is not None]
    if variables and len(variables) == len(branch.parts) and all(map(_is_plain, variables)):
        yield path, (_port(variables), False)
    elif not any(_is_plain(variable) for variable in variables):
        for name, inner in branch.parts.items():
            yield from _ports(inner if inner.item is None else None, f"{path}.{name}")


def _is_plain(variable: FlatVariable) -> bool:
    """Whether a connection makes the values of a variable equal, or their sum zero."""
    is_special = variable.is_stream or variable.is_expandable or variable.is_overconstrained
    moves = variable.variability not in ("constant", "parameter")
    return variable.type in _TYPES and moves and not is_special and 0 not in variable.dims


def _signal(variable: FlatVariable) -> type[Port]:
    if not variable.dims:
        return _SIGNALS[variable.causality]
    return _own_class((ConnectorVariable("value", "", variable.dims, False),))


def _port(variables: Sequence[FlatVariable]) -> type[Port]:
    own = tuple(
        ConnectorVariable(v.name.rpartition(".")[2], known_unit(v.unit), v.dims, v.is_flow)
        for v in sorted(variables, key=lambda v: v.name)
    )
    return _library_ports().get(own) or _own_class(own)


@ft.cache
def _library_ports() -> Mapping[tuple[ConnectorVariable, ...], type[Port]]:
    return {_variables(port): port for port in (Pin, RotationalFlange, TranslationalFlange, HeatPort)}


def _variables(port: type[Port]) -> tuple[ConnectorVariable, ...]:
    leaves = sorted(leaves_of(port()), key=lambda leaf: leaf.path)
    return tuple(
        ConnectorVariable(leaf.path, leaf.declaration.unit, (), leaf.declaration.role == "flow") for leaf in leaves
    )


@ft.cache
def _own_class(variables: tuple[ConnectorVariable, ...]) -> type[Port]:
    """The class of ports with these variables."""
    declarations = {
        v.name: Declaration("flow" if v.is_flow else "var", v.unit, sizes=v.dims, start=0.0, counts_from_1=True)
        for v in variables
    }
    name = ", ".join(f"flow {v.name}" if v.is_flow else v.name for v in variables)
    return node_class(Port, f"connector ({name})", declarations, {})
