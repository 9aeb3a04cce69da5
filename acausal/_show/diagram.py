"""`diagram`: the components of a model and their connections."""

import dataclasses
import functools as ft
import itertools
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from .._declare.array import Array
from .._declare.component import Component
from .._declare.node import Node, Port
from .._errors import ModelError
from .._integrate.results.solution import Solution
from .._reduce.flat_model import FlatModel
from .._reduce.flatten import children, flatten
from .._reduce.graph import connected
from .schematic.symbols import colour_of_class, domain_of

COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#8a6d00", "#56b4e9", "#7f3c8d", "#444444")


@dataclasses.dataclass(frozen=True)
class Joint:
    """Connected ports, each as the path of its box and its name within it."""

    domain: str
    ports: tuple[tuple[str, str], ...]
    colour: str | None = None  # that the package of the domain gives

    @property
    def boxes(self) -> tuple[str, ...]:
        return tuple(dict.fromkeys(box for box, _ in self.ports))


@dataclasses.dataclass(frozen=True)
class Diagram:
    """Components and connections. A notebook shows the schematic; `print` shows the input of Graphviz.

    `boxes`: the class of each component by path. `joints`: sets of connected ports.
    """

    name: str
    boxes: dict[str, str]
    joints: tuple[Joint, ...]
    _parts: Mapping[str, Node] = dataclasses.field(compare=False, repr=False)
    _values: Mapping[str, Node] = dataclasses.field(compare=False, repr=False)  # trajectories
    _links: str = dataclasses.field(compare=False, repr=False)

    @property
    def colours(self) -> dict[str, str]:
        """The colour of each domain: that of its package, or one that no package of the model has."""
        domains = {joint.domain: joint.colour for joint in self.joints}
        others = itertools.cycle([colour for colour in COLOURS if colour not in domains.values()] or COLOURS)
        return {domain: colour or next(others) for domain, colour in domains.items()}

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

    @ft.cached_property
    def svg(self) -> str:
        """The schematic as SVG: a symbol for each component, with its class and values as a tooltip."""
        from .diagram_svg import diagram_svg

        return diagram_svg(self)

    def _repr_svg_(self) -> str:
        """The picture for a notebook."""
        return self.svg

    def save(self, file: str | Path) -> None:
        """Write the schematic to an SVG file."""
        path = Path(file)
        if path.suffix != ".svg":
            raise ModelError(f"A diagram is saved as SVG: name the file {path.stem}.svg, not {path.name}.")
        path.write_text(self.svg, encoding="utf-8")


def diagram(model: Component | Solution[Any], depth: int | None = 1, *, links: str = "") -> Diagram:
    """A schematic of a model: its components and connections, coloured by domain.

    `depth`: the number of levels of parts shown; 1 shows the parts of the model itself, None shows all parts that
    have no parts. An array of components is one box. A domain is the package of the class of a port. For a solution,
    the tooltips show the final value and the range of each variable. `links` is the address of a reference with a page
    for each domain, to which the symbols link.

    Raises `ModelError` if the connections are wrong.
    """
    if isinstance(model, Solution) and model.is_batched:
        raise ModelError("The solution is a batch: select one run with jax.tree_util.tree_map(lambda x: x[i], sol).")
    shown = model.final if isinstance(model, Solution) else model
    if not isinstance(shown, Component):
        raise ModelError(f"{model!r} is no component: draw a model.")
    if depth is not None and (isinstance(depth, bool) or not isinstance(depth, int) or depth < 1):
        raise ModelError(f"depth must be a positive integer, or None for all levels, got {depth!r}.")
    name = type(shown).__name__
    parts = _parts(shown, depth)
    boxes = {path: part._shown()[0] for path, part in parts.items()}
    kinds = dict(_ports(shown, ""))
    found = (_joint(ports, boxes, kinds) for ports in _joined_ports(flatten(shown)))
    joints = tuple(dict.fromkeys(joint for joint in found if len(joint.ports) > 1))
    joined = {box for joint in joints for box in joint.boxes}
    boxes = {path: kind for path, kind in boxes.items() if path in joined or not isinstance(parts[path], Port)}
    values = _parts(model.values, depth) if isinstance(model, Solution) else {}
    return Diagram(name, boxes, joints, parts, values, links)


def _parts(model: Component, depth: int | None) -> dict[str, Node]:
    """The components that are drawn, and the ports of the model itself; a model without parts is drawn as a whole."""
    found = dict(_boxes(model, "", depth))
    ports = {path: part for path, part in children(model, "") if isinstance(part, Port)}
    return {**found, **ports} if found else {type(model).__name__: model}


def _boxes(node: Node, path: str, depth: int | None) -> Iterator[tuple[str, Component]]:
    """The components below a node that are drawn as a whole."""
    below = None if depth is None else depth - 1
    for here, part in children(node, path):
        if isinstance(part, Array):
            yield f"{here}[]", part
        elif isinstance(part, Component):
            yield from (list(_boxes(part, here, below)) if below != 0 else []) or [(here, part)]


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
        box = next((port[:end] for end in _ends(port) if port[:end] in boxes), port if port in boxes else None)
        if box is not None:
            seen.setdefault(box, set()).add(port[len(box) + 1 :])
    outer = {box: min(name.count(".") for name in names) for box, names in seen.items()}
    named = {box: sorted(name for name in names if name.count(".") == outer[box]) for box, names in seen.items()}
    kind = next((kinds[port] for port in ports if port in kinds), Port)
    ports_of_boxes = tuple((box, ", ".join(names)) for box, names in sorted(named.items()))
    return Joint(domain_of(kind), ports_of_boxes, colour_of_class(kind))


def _ends(path: str) -> list[int]:
    """The ends of the paths of a port's owners, the innermost first."""
    return [i for i in range(len(path) - 1, 0, -1) if path[i] == "."]
