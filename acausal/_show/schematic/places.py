"""Places of glyphs from the order of columns, without overlaps."""

import itertools

import numpy as np

from .glyph import Glyph, Rect
from .graph import Graph
from .levels import Levels
from .programs import least_lengths
from .symbols import Point

BESIDE, BELOW, NEAR = 4, 2, 2  # least distances: of symbols, of outlines below each other, of names


def places(graph: Graph, levels: Levels, spread: int) -> list[Point]:
    """The corners of the glyphs, with the shortest lines for this order. `spread` widens the gaps."""
    y = _down(graph, levels, spread)
    x = _across(graph, levels, y, spread)
    return list(zip(x.tolist(), y[: len(x)].tolist(), strict=True))


def _down(graph: Graph, levels: Levels, spread: int) -> np.ndarray:
    """The upper edges of all items."""
    outlines = [glyph.outline for glyph in graph.glyphs]
    outlines += [Rect(0, 0, 0, 0)] * (len(levels.heights) - len(outlines))
    bounds = [
        (a, b, float(outlines[a].bottom + BELOW + spread - outlines[b].top))
        for column in levels.columns
        for a, b in itertools.pairwise(column)
    ]
    links = [(link.a, link.b, float(link.y_a - link.y_b), link.weight) for link in levels.links]
    return least_lengths(len(levels.heights), links, bounds)


def _across(graph: Graph, levels: Levels, y: np.ndarray, spread: int) -> np.ndarray:
    """The left edges of the glyphs. Names need a gap only from what is beside them."""
    glyphs = [[item for item in column if item < len(graph.glyphs)] for column in levels.columns]
    bounds = []
    for i, j in itertools.combinations(range(len(glyphs)), 2):
        gap = BESIDE + spread + _tracks(levels, i)
        for a, b in itertools.product(glyphs[i], glyphs[j]):
            needed = _needed(graph.glyphs[a], graph.glyphs[b], int(y[b] - y[a]))
            if j == i + 1:
                needed.append(graph.glyphs[a].rect.right + gap)
            bounds += [(a, b, float(max(needed)))] if needed else []
    links = []
    for a, b, weight, _ in graph.pairs():
        (x_a, _), (x_b, _) = (graph.glyphs[end.glyph].turned.port(end.port) for end in (a, b))
        links.append((a.glyph, b.glyph, float(x_a - x_b), weight))
    return least_lengths(len(graph.glyphs), links, bounds)


def _needed(a: Glyph, b: Glyph, down: int) -> list[int]:
    """The least distances of two glyphs so that parts beside each other do not meet."""
    pairs = itertools.product(a.rects, b.rects)
    beside = ((p, q) for p, q in pairs if p.top - 1 < q.bottom + down and q.top + down < p.bottom + 1)
    return [p.right + NEAR - q.left for p, q in beside]


def _tracks(levels: Levels, i: int) -> int:
    """The number of nets with lines between a column and the next, beyond the first two."""
    left, right = (set(levels.columns[k]) for k in (i, i + 1))
    nets = {link.net for link in levels.links if link.a in left and link.b in right}
    return max(len(nets) - 2, 0)
