"""Schematic of a diagram: its symbols, tooltips and links."""

import html
from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from .._declare.array import Array
from .._declare.fields import dynamic_fields, parts_of
from .._declare.node import Node, Port
from .._declare.tree import branch, with_unit
from .._tracing import known
from .._units.display import Scale
from .diagram import Diagram
from .schematic.graph import Glyph, Terminal, graph_of
from .schematic.layout import Schematic, Wire, layout
from .schematic.symbols import (
    DARK,
    GRID,
    ROOT,
    Point,
    Symbol,
    Turned,
    box,
    domain_of,
    drawn,
    has_symbols,
    is_input,
    ports_of,
    symbol_of,
    word,
)


class Look(NamedTuple):
    """The colour of a part, its tooltip, and the address to which it links, if any."""

    colour: str
    about: str
    link: str = ""


def svg(
    layout: Schematic, colours: Sequence[str], looks: Mapping[str, Look], inputs: Container[tuple[str, str]]
) -> str:
    """The picture, from the colours of the nets and the looks of the parts by name. Lines end in arrows at inputs."""
    width, height = (GRID * length for length in layout.size)
    size = f'viewBox="0 0 {width} {height}" width="{width}" height="{height}"'
    lines = [_wire(wire, colour) for wire, colour in zip(layout.wires, colours, strict=True)]
    arrows = [
        _arrow(layout, end, colour)
        for net, colour in zip(layout.graph.nets, colours, strict=True)
        for end in net
        if (layout.graph.glyphs[end.glyph].name, end.port) in inputs
    ]
    pairs = zip(layout.graph.glyphs, layout.corners, strict=True)
    parts = [part for glyph, corner in pairs for part in _glyph(glyph, corner, looks)]
    ground = f'<rect width="{width}" height="{height}" fill="white"/>'
    return "\n".join([f"<svg {ROOT} {size}>", ground, *lines, *arrows, *parts, "</svg>"])


def _wire(wire: Wire, colour: str) -> str:
    dots = (f'<circle cx="{GRID * x}" cy="{GRID * y}" r="2.6" fill="{colour}"/>' for x, y in wire.junctions())
    return f'<g stroke="{colour}"><path d="{"".join(_line(run) for run in wire.runs())}"/>{"".join(dots)}</g>'


def _arrow(layout: Schematic, end: Terminal, colour: str) -> str:
    turned, corner = layout.graph.glyphs[end.glyph].turned, layout.corners[end.glyph]
    x, y = (GRID * (p + q) for p, q in zip(corner, turned.port(end.port), strict=True))
    right, down = turned.side(end.port)
    back = ((x + 8 * right + 3.5 * side * down, y + 8 * down + 3.5 * side * right) for side in (-1, 1))
    return f'<path d="M{x} {y}{"".join(f"L{a:g} {b:g}" for a, b in back)}z" fill="{colour}"/>'


def _line(points: Sequence[Point]) -> str:
    return "M" + "L".join(f"{GRID * x} {GRID * y}" for x, y in points)


def _glyph(glyph: Glyph, corner: Point, looks: Mapping[str, Look]) -> Iterator[str]:
    """The symbol with its name, and the references at its ports."""
    left, top = corner
    ports = (*glyph.used, *glyph.references)
    yield _part(glyph.turned, corner, looks[glyph.name], ports, _label(glyph))
    for hanger in glyph.hangers:
        look, (x, y) = looks[hanger.name], hanger.corner
        line = _line([(left + a, top + b) for a, b in hanger.line])
        yield f'<path d="{line}" stroke="{look.colour}"/>'
        yield _part(hanger.turned, (left + x, top + y), look, (), "")


def _part(turned: Turned, corner: Point, look: Look, used: Sequence[str], label: str) -> str:
    width, height = (GRID * length for length in turned.size)
    # The transparent area shows the tooltip between the lines of a symbol.
    area = f'<rect width="{width}" height="{height}" fill="white" fill-opacity="0"/>'
    content = f"<title>{html.escape(look.about)}</title>{area}{drawn(turned, look.colour, used)}{label}"
    group = f'<g transform="translate({GRID * corner[0]} {GRID * corner[1]})">{content}</g>'
    return f'<a href="{html.escape(look.link)}">{group}</a>' if look.link else group


def _label(glyph: Glyph) -> str:
    (left, top, right, bottom), anchor = glyph.label
    x = {"start": left, "middle": (left + right) / 2.0, "end": right}[anchor]
    return word(GRID * x, GRID * (top + bottom) / 2.0, glyph.name, DARK, 11.0, anchor)


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
