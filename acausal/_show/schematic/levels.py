"""Items of the columns of a schematic: glyphs, and places where lines pass."""

import dataclasses
import itertools
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from .graph import Graph, Terminal

LONG, STRAIGHT, BENT = 4.0, 2.0, 1.0  # weights of lines


class Link(NamedTuple):
    """A line between items of one column or of neighbouring columns, the left one first.

    `y_a` and `y_b` are the heights in the items at which the line leaves: outside of a glyph for ports above and below.
    """

    net: int
    a: int
    y_a: int
    b: int
    y_b: int
    weight: float


@dataclasses.dataclass(frozen=True)
class Levels:
    """The items of each column from top to bottom, by number: first the glyphs, then the places where lines pass."""

    columns: tuple[tuple[int, ...], ...]
    links: tuple[Link, ...]
    heights: tuple[int, ...]  # of the items


def levels(graph: Graph, column: np.ndarray) -> Levels:
    """The items in the order of the model."""
    items: list[list[int]] = [[] for _ in range(int(column.max(initial=-1)) + 1)]
    for number, place in enumerate(column.tolist()):
        items[place].append(number)
    links: list[Link] = []
    total = len(graph.glyphs)
    for number, net in enumerate(graph.nets):
        for a, b in _tree(net, column):
            passed = range(int(column[a.glyph]) + 1, int(column[b.glyph]))
            chain = [a.glyph, *range(total, total + len(passed)), b.glyph]
            for place, item in zip(passed, chain[1:-1], strict=True):
                items[place].append(item)
            total += len(passed)
            weight = LONG if passed else BENT if any(graph.side(end)[1] for end in (a, b)) else STRAIGHT
            ends = [(a.glyph, _height(graph, a)), *((item, 0) for item in chain[1:-1]), (b.glyph, _height(graph, b))]
            links += [Link(number, *left, *right, weight) for left, right in itertools.pairwise(ends)]
    heights = [glyph.turned.size[1] for glyph in graph.glyphs]
    return Levels(tuple(map(tuple, items)), tuple(links), (*heights, *[0] * (total - len(heights))))


def _tree(net: Sequence[Terminal], column: np.ndarray) -> Iterator[tuple[Terminal, Terminal]]:
    """Pairs that join the ports of a net: each with the nearest to its left, or in the first column the one before."""
    ends = sorted(net, key=lambda end: int(column[end.glyph]))
    for i, end in enumerate(ends[1:], start=1):
        before = [other for other in ends[:i] if column[other.glyph] < column[end.glyph]]
        yield (before or ends[:i])[-1], end


def _height(graph: Graph, end: Terminal) -> int:
    turned = graph.glyphs[end.glyph].turned
    return turned.port(end.port)[1] + turned.side(end.port)[1]
