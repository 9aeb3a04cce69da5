"""Connections: merged across variables, and sums of flows."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from .._declare.array import Array
from .._declare.component import Component, Connection
from .._declare.fields import dynamic_fields, join, parts_of
from .._declare.node import Node, Port
from .._errors import ModelError, complain
from .graph import connected


def children(node: Node, path: str) -> Iterator[tuple[str, Any]]:
    """Parts of a node with their paths; the item of an array of components has a path that ends in `[]`."""
    for name, declaration in dynamic_fields(type(node)):
        if declaration is None:
            here = f"{path}[]" if isinstance(node, Array) else join(path, name)
            yield from parts_of(vars(node)[name], here)


class Joints:
    """Runs `connections()` on a view of the model with node numbers as leaves.

    A port takes part in a connection from outside, as part of a component, or from inside, if a composite connects
    its own port to its parts; the flow counts with opposite signs. So a flow node has two ends, 2 node + side.
    """

    def __init__(self, node_path: Callable[[int], str], *, split: bool = False) -> None:
        self._path = node_path
        self._split = split  # whether the elements of array variables are nodes of their own
        self.across: list[tuple[int, int]] = []
        self.flows: list[tuple[int, int]] = []
        self.joined_outside: list[np.ndarray] = []
        self.need: list[int] = []

    def visit(self, node: Node, path: str, *, is_root: bool = False) -> None:
        parts = list(children(node, path))
        own = {id(part) for _, part in parts if isinstance(part, Port)}
        if isinstance(node, Component):
            if type(node).connections is not Component.connections:
                for connection in node.connections():
                    try:
                        self._join(connection, own, path or type(node).__name__)
                    except ModelError as error:
                        complain(error)
            if not is_root:
                self._note_needs(parts)
        for part_path, part in parts:
            if isinstance(part, Component):
                self.visit(part, part_path)

    def _note_needs(self, parts: list[tuple[str, Any]]) -> None:
        for _, part in parts:
            if isinstance(part, Port) and type(part).needs_connection:
                self.need.extend(int(node) for node in np.ravel(_first_ids(part)))

    def _join(self, connection: Connection, own: set[int], where: str) -> None:
        ports = connection.ports
        if len(ports) < 2 or not all(isinstance(port, Port) for port in ports):
            kinds = ", ".join(type(port).__name__ for port in ports)
            raise ModelError(f"{where}: connect(...) takes two or more ports, got ({kinds}). Name the port of a part.")
        head = ports[0]
        sides = [1 if id(port) in own else 0 for port in ports]
        for port, side in zip(ports, sides, strict=True):
            if side == 0:
                self.joined_outside.append(np.ravel(_first_ids(port)))
        for port, side in zip(ports[1:], sides[1:], strict=True):
            self._pair(head, sides[0], port, side, where)

    def _pair(self, a: Port, side_a: int, b: Port, side_b: int, where: str) -> None:
        self._check_alike(a, b, where)
        for name, declaration in dynamic_fields(type(a)):
            own = len(declaration.sizes or ()) if declaration is not None and self._split else 0
            left, right = _spread(vars(a)[name], vars(b)[name], where.count("[]"), own)
            if np.shape(left) != np.shape(right):
                raise ModelError(
                    f"{where}: {self._name(a)} and {self._name(b)} stand for {np.size(left)} and {np.size(right)} "
                    "ports. Select equally many members of both arrays, or a single one."
                )
            is_flow = declaration is not None and declaration.role == "flow"
            pairs = np.ravel(left).tolist(), np.ravel(right).tolist()
            if is_flow:
                self.flows += [(2 * i + side_a, 2 * j + side_b) for i, j in zip(*pairs, strict=True)]
            else:
                self.across += zip(*pairs, strict=True)

    def _check_alike(self, a: Port, b: Port, where: str) -> None:
        alike = type(a) is type(b) or _family(type(a)) & _family(type(b))
        if not alike:
            raise ModelError(
                f"{where}: {self._name(a)} is a {type(a).__name__} and {self._name(b)} a {type(b).__name__}; only "
                "ports of one kind can be connected. Put a component between them that converts one into the other."
            )

    def _name(self, port: Port) -> str:
        return self._path(int(np.ravel(_first_ids(port))[0])).rpartition(".")[0]

    def resolve(self, flow_nodes: np.ndarray) -> tuple[np.ndarray, list]:
        """Pairs of merged nodes, and the sets of signed flows that sum to zero."""
        connected = set(np.concatenate(self.joined_outside).tolist()) if self.joined_outside else set()
        for node in self.need:
            if node not in connected:
                port = self._path(node).rpartition(".")[0]
                complain(ModelError(f"{port} is not connected: it needs a connection that determines its value."))
        across, edges = (np.array(pairs, int).reshape(-1, 2) for pairs in (self.across, self.flows))
        ends = np.unique(np.concatenate([2 * flow_nodes, np.ravel(edges)]))
        return across, _flow_sets(ends, edges)


def _spread(a: np.ndarray, b: np.ndarray, around: int, own: int) -> tuple[np.ndarray, np.ndarray]:
    """Node numbers of two ports, those of a single port repeated for each member of an array.

    `around` is the number of axes of arrays around the connecting component; the last `own` axes are those of a
    variable.
    """
    few, many = (a, b) if np.ndim(a) <= np.ndim(b) else (b, a)
    if np.ndim(few) == np.ndim(many) or np.ndim(few) != around + own:
        return a, b
    single = np.expand_dims(few, tuple(range(around, around + np.ndim(many) - np.ndim(few))))
    each = np.broadcast_to(single, np.shape(many))
    return (each, b) if few is a else (a, each)


def _flow_sets(ends: np.ndarray, edges: np.ndarray) -> list[tuple[tuple[int, ...], tuple[int, ...]]]:
    if len(ends) == 0:
        return []
    n_sets, label = connected(np.searchsorted(ends, edges), len(ends))
    order = np.argsort(label, kind="stable")
    bounds = np.searchsorted(label[order], np.arange(n_sets + 1))
    members = ends[order].tolist()
    sets = []
    for start, stop in zip(bounds[:-1].tolist(), bounds[1:].tolist(), strict=True):
        nodes = tuple(end >> 1 for end in members[start:stop])
        sets.append((nodes, tuple(-1 if end & 1 else 1 for end in members[start:stop])))
    return sorted(sets)


def _family(cls: type[Port]) -> set[type]:
    """Common partial bases of connectable ports of different classes, such as `Signal` for `Input` and `Output`."""
    return {base for base in cls.__mro__ if issubclass(base, Port) and base not in (Port, cls)}


def _first_ids(port: Port) -> np.ndarray:
    name, _ = dynamic_fields(type(port))[0]
    return vars(port)[name]
