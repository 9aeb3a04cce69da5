"""A schematic as SVG."""

import html
from collections.abc import Container, Iterator, Mapping, Sequence
from typing import NamedTuple

from .drawing import DARK, ROOT, drawn, word
from .glyph import Glyph
from .graph import Terminal
from .layout import Schematic
from .routing import Wire
from .symbols import GRID, Point, Turned


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
