"""`diagram`: the components of a model and their connections."""

import dataclasses
import io
from collections.abc import Iterator
from typing import Any

import numpy as np

from .._declare.array import Array
from .._declare.component import Component
from .._declare.node import Node, Port
from .._errors import ModelError
from .._extras import Axes
from .._reduce.connections import children
from .._reduce.flat_model import FlatModel
from .._reduce.flatten import flatten
from .._reduce.graph import connected

COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#8a6d00", "#56b4e9", "#7f3c8d", "#444444")


@dataclasses.dataclass(frozen=True)
class Joint:
    """Connected ports, each as the path of its box and its name within it."""

    domain: str
    ports: tuple[tuple[str, str], ...]

    @property
    def boxes(self) -> tuple[str, ...]:
        return tuple(dict.fromkeys(box for box, _ in self.ports))


@dataclasses.dataclass(frozen=True)
class Diagram:
    """Components and connections. `print` shows the input of Graphviz, `plot()` the picture.

    `boxes`: the class of each component by path. `joints`: sets of connected ports.
    """

    name: str
    boxes: dict[str, str]
    joints: tuple[Joint, ...]

    @property
    def colours(self) -> dict[str, str]:
        """The colour of each domain."""
        domains = dict.fromkeys(joint.domain for joint in self.joints)
        return {domain: COLOURS[i % len(COLOURS)] for i, domain in enumerate(domains)}

    def colour_of(self, box: str) -> str:
        """The colour of the domain of a box; grey for several domains or none."""
        domains = {joint.domain for joint in self.joints if box in joint.boxes}
        return self.colours[domains.pop()] if len(domains) == 1 else "#666666"

    def __str__(self) -> str:
        return "\n".join([f'graph "{self.name}" {{', "  layout=neato; overlap=false;", *self._lines(), "}"])

    def _lines(self) -> Iterator[str]:
        for path, kind in self.boxes.items():
            yield f'  "{path}" [shape=box, label="{path}\\n{kind}", color="{self.colour_of(path)}"];'
        for number, joint in enumerate(self.joints):
            colour = f'color="{self.colours[joint.domain]}"'
            if len(joint.ports) == 2:
                (a, port_a), (b, port_b) = joint.ports
                yield f'  "{a}" -- "{b}" [{colour}, taillabel="{port_a}", headlabel="{port_b}"];'
                continue
            yield f'  "joint {number}" [shape=point, {colour}];'
            for box, port in joint.ports:
                yield f'  "joint {number}" -- "{box}" [{colour}, headlabel="{port}"];'

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw components as boxes and connections as lines, coloured by domain; returns the matplotlib axes."""
        from .diagram_plot import plot_diagram

        return plot_diagram(self, ax)

    def _repr_png_(self) -> bytes:
        """The picture for a notebook."""
        from .._extras import pyplot

        picture = io.BytesIO()
        figure: Any = self.plot().figure
        figure.savefig(picture, format="png", dpi=100)
        pyplot().close(figure)
        return picture.getvalue()


def diagram(model: Component, depth: int | None = 1) -> Diagram:
    """The components of a model and their connections, coloured by domain.

    `depth`: the number of levels of parts shown; 1 shows the parts of the model itself, None shows all parts that
    have no parts. An array of components is one box. A domain is the package of the class of a port.

    Raises `ModelError` if the connections are wrong.
    """
    if not isinstance(model, Component):
        raise ModelError(f"{model!r} is no component: draw a model.")
    if depth is not None and (isinstance(depth, bool) or not isinstance(depth, int) or depth < 1):
        raise ModelError(f"depth must be a positive integer, or None for all levels, got {depth!r}.")
    name = type(model).__name__
    boxes = dict(_boxes(model, "", depth)) or {name: name}
    kinds = dict(_ports(model, ""))
    found = (_joint(ports, boxes, kinds) for ports in _joined_ports(flatten(model)))
    joints = dict.fromkeys(joint for joint in found if len(joint.ports) > 1)
    return Diagram(name, boxes, tuple(joints))


def _boxes(node: Node, path: str, depth: int | None) -> Iterator[tuple[str, str]]:
    """The boxes below a node, each with its class."""
    below = None if depth is None else depth - 1
    for here, part in children(node, path):
        if isinstance(part, Array):
            yield f"{here}[]", f"{part.n} × {type(part.item).__name__}"
        elif isinstance(part, Component):
            yield from (list(_boxes(part, here, below)) if below != 0 else []) or [(here, type(part).__name__)]


def _ports(node: Node, path: str) -> Iterator[tuple[str, type[Port]]]:
    """All ports by path."""
    for here, part in children(node, path):
        if isinstance(part, Port):
            yield here, type(part)
        elif isinstance(part, Component):
            yield from _ports(part, here)


def _joined_ports(flat: FlatModel) -> Iterator[list[str]]:
    """The paths of connected ports, directly or through those of composites; members of arrays count as one."""
    nodes, pairs = np.unique(flat.across, return_inverse=True)
    count, label = connected(pairs.reshape(-1, 2), len(nodes)) if len(nodes) else (0, nodes)
    ports: list[list[str]] = [[] for _ in range(count)]
    for node, number in zip(nodes.tolist(), label.tolist(), strict=True):
        ports[number].append(flat.leaves[flat.leaf_of_node[node]].path.rpartition(".")[0])
    yield from ports


def _joint(ports: list[str], boxes: dict[str, str], kinds: dict[str, type[Port]]) -> Joint:
    """Connected ports, seen from outside of the boxes."""
    seen: dict[str, set[str]] = {}
    for port in ports:
        box = next((port[:end] for end in _ends(port) if port[:end] in boxes), None)
        if box is not None:
            seen.setdefault(box, set()).add(port[len(box) + 1 :])
    outer = {box: min(name.count(".") for name in names) for box, names in seen.items()}
    named = {box: sorted(name for name in names if name.count(".") == outer[box]) for box, names in seen.items()}
    kind = next((kinds[port] for port in ports if port in kinds), Port)
    return Joint(_domain(kind), tuple((box, ", ".join(names)) for box, names in sorted(named.items())))


def _ends(path: str) -> list[int]:
    """The ends of the paths of a port's owners, the innermost first."""
    return [i for i in range(len(path) - 1, 0, -1) if path[i] == "."]


def _domain(kind: type[Port]) -> str:
    """The package of a port's class; in a script, the class."""
    public = [name for name in kind.__module__.split(".") if not name.startswith("_")]
    return public[-1] if public else kind.__name__
