"""Layout of a schematic: places of glyphs, and lines between them."""

import dataclasses
import itertools
from collections.abc import Iterator

from ..._errors import ModelError
from .columns import columns, standing
from .glyph import Glyph
from .graph import Graph
from .levels import levels
from .order import ordered
from .places import places
from .routing import NoRoute, PortEnd, Wire, routed
from .symbols import Point

MARGIN = 4  # around everything
MOST = 6  # tries with wider and wider gaps


@dataclasses.dataclass(frozen=True)
class Schematic:
    """Shapes with their corners, and the wires of the nets, on a grid of a given size."""

    graph: Graph
    corners: tuple[Point, ...]
    wires: tuple[Wire, ...]
    size: Point


def layout(graph: Graph) -> Schematic:
    """The layout of a graph in columns; gaps that are too narrow for the lines are widened."""
    graph, x = standing(graph)
    order = ordered(levels(graph, columns(graph, x)))
    for spread in range(MOST):
        corners, size = _moved_inside(graph, places(graph, order, spread))
        try:
            return Schematic(graph, corners, tuple(_wires(graph, corners, size)), size)
        except NoRoute:
            continue
    raise ModelError(
        "The lines of the diagram find no way between its symbols: draw fewer levels, or a part of the model."
    )


def _moved_inside(graph: Graph, corners: list[Point]) -> tuple[tuple[Point, ...], Point]:
    rects = [glyph.outline.moved(*corner) for glyph, corner in zip(graph.glyphs, corners, strict=True)]
    left, top = (min((rect[i] for rect in rects), default=0) - MARGIN for i in (0, 1))
    right, bottom = (max((rect[i] for rect in rects), default=0) + MARGIN for i in (2, 3))
    return tuple((x - left, y - top) for x, y in corners), (right - left, bottom - top)


def _wires(graph: Graph, corners: tuple[Point, ...], size: Point) -> list[Wire]:
    blocked = {point for glyph, corner in zip(graph.glyphs, corners, strict=True) for point in _covered(glyph, corner)}
    nets = []
    for net in graph.nets:
        ends = []
        for number, port in net:
            turned, (x, y) = graph.glyphs[number].turned, corners[number]
            right, down = turned.port(port)
            ends.append(PortEnd((x + right, y + down), turned.side(port)))
        nets.append(ends)
    return routed(nets, blocked, size)


def _covered(glyph: Glyph, corner: Point) -> Iterator[Point]:
    """The points of the grid that a glyph covers. Lines may touch the edge of a label, but not a symbol."""
    left, top, right, bottom = glyph.label.rect
    inside = ((x, y) for x in range(left, right + 1) for y in range(top + 1, bottom))
    lines = (point for hanger in glyph.hangers for a, b in itertools.pairwise(hanger.line) for point in _between(a, b))
    rects = (glyph.rect, *(hanger.rect for hanger in glyph.hangers))
    for x, y in itertools.chain(inside, lines, *(rect.points() for rect in rects)):
        yield corner[0] + x, corner[1] + y


def _between(a: Point, b: Point) -> Iterator[Point]:
    xs, ys = (range(min(pair), max(pair) + 1) for pair in zip(a, b, strict=True))
    return itertools.product(xs, ys)
