"""Schematic of a diagram: its symbols, tooltips and links."""

from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

from .._declare.array import Array
from .._declare.fields import dynamic_fields, parts_of
from .._declare.node import Node, Port
from .._declare.tree import branch, with_unit
from .._tracing import known
from .._units.display import Scale
from .diagram import Diagram
from .schematic.graph import graph_of
from .schematic.layout import Schematic, layout
from .schematic.svg import Look, svg
from .schematic.symbols import Symbol
from .symbol import box, domain_of, has_symbols, is_input, ports_of, symbol_of

TERMINAL = Symbol(20, 20, {"": (20, 10)}, "M4 10a4 4 0 1 0 8 0a4 4 0 1 0-8 0zM12 10h8")
MOST = 30  # lines of a tooltip


def diagram_svg(diagram: Diagram) -> str:
    """See `Diagram.svg`."""
    found = schematic(diagram)
    colours = [diagram.colours[diagram.joints[number].domain] for number in found.graph.net_of]
    looks = {path: _look(diagram, path) for path in diagram.boxes}
    return svg(found, colours, looks, _inputs(diagram))


def schematic(diagram: Diagram) -> Schematic:
    """The layout of the components of a diagram and of the lines between them."""
    joints = [[(path, port) for path, ports in joint.ports for port in ports.split(", ")] for joint in diagram.joints]
    used: dict[str, list[str]] = {path: [] for path in diagram.boxes}
    for path, port in (end for joint in joints for end in joint):
        used[path].append(port)
    symbols = {path: _symbol(_one(diagram._parts[path]), ports) for path, ports in used.items()}
    inputs = _inputs(diagram)
    signals = {i for i, joint in enumerate(joints) if inputs.intersection(joint)}
    return layout(graph_of(symbols, joints, signals))


def _inputs(diagram: Diagram) -> set[tuple[str, str]]:
    """The ports that read signals, each with the path of its component."""
    kinds = {path: ports_of(_one(diagram._parts[path])) for path in diagram.boxes}
    return {(path, port) for path, ports in kinds.items() for port, kind in ports.items() if is_input(kind)}


def _one(part: Node) -> Node:
    """The component itself; of an array, the item that stands for all."""
    return part.item if isinstance(part, Array) else part


def _symbol(part: Node, used: Iterable[str]) -> Symbol:
    """The symbol of a part. Connections may name ports of its own parts, which only a box can show."""
    if isinstance(part, Port):
        return TERMINAL
    inner = {name: Port for name in used if name not in ports_of(part)}
    return box(type(part).__name__, {**ports_of(part), **inner}) if inner else symbol_of(part)


def _look(diagram: Diagram, path: str) -> Look:
    part = _one(diagram._parts[path])
    rows = [f"{name} = {text}" for name, text in _parameters(part)]
    rows += [f"{name}: {text}" for name, text in _results(_one(diagram._values[path]))] if diagram._values else []
    rows = rows if len(rows) <= MOST else [*rows[:MOST], f"... and {len(rows) - MOST} more"]
    cls = type(part)
    link = f"{diagram._links}{domain_of(cls)}.html#{cls.__name__}" if diagram._links and has_symbols(cls) else ""
    return Look(diagram.colour_of(path), "\n".join([f"{path}: {diagram.boxes[path]}", *rows]), link)


def _parameters(part: Node) -> Iterator[tuple[str, str]]:
    """Parameters in their display units, and options."""
    given = {name: leaf for name, leaf in dynamic_fields(type(part)) if leaf is not None}
    yield from ((name, text) for name, text in branch(part).values if name not in given)
    for name, leaf in given.items():
        if leaf.role == "param" and getattr(part, name) is not None:
            yield name, _shown(getattr(part, name), leaf.unit)


def _results(part: Node, path: str = "") -> Iterator[tuple[str, str]]:
    """The final value and the range of each variable of a part and of its ports."""
    for name, leaf in dynamic_fields(type(part)):
        value = getattr(part, name)
        if leaf is None:
            ports = (pair for pair in parts_of(value, f"{path}{name}") if isinstance(pair[1], Port))
            for port_path, port in ports:
                yield from _results(port, f"{port_path}.")
        elif leaf.role != "param" and (numbers := known(value)) is not None and np.ndim(numbers) == 1:
            low, high = (_shown(bound, leaf.unit) for bound in (np.min(numbers), np.max(numbers)))
            yield f"{path}{name}", f"{_shown(numbers[-1], leaf.unit)} at the end, from {low} to {high}"


def _shown(value: Any, unit: str) -> str:
    scale = Scale.of(unit)
    return with_unit(scale.value(value), scale.unit)
