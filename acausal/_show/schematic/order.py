"""Items of the columns of a schematic, glyphs and places where lines pass, in an order with few crossings."""

import dataclasses
import itertools
from collections import defaultdict
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


SWEEPS, TRIES = 12, 8
UPSIDE_DOWN, AWAY, BACK = 2.0, 0.5, 0.4  # costs beside those of crossings


def ordered(levels: Levels) -> Levels:
    """The order with the least cost that was found, from several starts.

    The cost counts crossings, and lines within a column that do not leave towards their ends or pass others.
    """
    rng, best, least = np.random.default_rng(0), _Order(levels), np.inf
    for trial in range(TRIES):
        found = _Order(levels)
        if trial:
            found.columns = [[column[i] for i in rng.permutation(len(column))] for column in levels.columns]
        found.sweep()
        found.swap()
        cost = sum(found.crossings(i) + found.within(i) for i in range(len(found.columns)))
        if cost < least - 1e-9:
            best, least = found, cost
        if least == 0.0:
            break
    return dataclasses.replace(levels, columns=tuple(map(tuple, best.columns)))


class _Order:
    """An order that is improved in place."""

    def __init__(self, levels: Levels) -> None:
        self.columns = [list(column) for column in levels.columns]
        self._heights = levels.heights
        self._level = {item: i for i, column in enumerate(levels.columns) for item in column}
        self._near: dict[int, list[int]] = {item: [] for item in self._level}
        self._before: dict[int, list[Link]] = defaultdict(list)  # links to the column before
        self._inside: dict[int, list[Link]] = defaultdict(list)
        for link in levels.links:
            is_inside = self._level[link.a] == self._level[link.b]
            (self._inside if is_inside else self._before)[self._level[link.b]].append(link)
            self._near[link.a].append(link.b)
            self._near[link.b].append(link.a)

    def sweep(self) -> None:
        """Sort columns by the mean places of neighbours, to the right and to the left."""
        for number in range(SWEEPS):
            step = 1 if number % 2 else -1
            for i in range(len(self.columns))[::step]:
                place = {item: (k + 0.5) / len(column) for column in self.columns for k, item in enumerate(column)}
                known = {
                    item: [place[other] for other in self._near[item] if (i - self._level[other]) * step > 0]
                    for item in self.columns[i]
                }
                self.columns[i].sort(
                    key=lambda item, known=known, place=place: float(np.mean(known[item] or place[item]))
                )

    def swap(self) -> None:
        """Swap neighbours in a column while this lowers the cost."""
        is_better = True
        while is_better:
            is_better = False
            for i, column in enumerate(self.columns):
                for k in range(len(column) - 1):
                    before = self._around(i)
                    column[k : k + 2] = column[k : k + 2][::-1]
                    if self._around(i) < before - 1e-9:
                        is_better = True
                    else:
                        column[k : k + 2] = column[k : k + 2][::-1]

    def _around(self, i: int) -> float:
        return self.crossings(i) + self.crossings(i + 1) + self.within(i)

    def crossings(self, i: int) -> float:
        """The crossings of lines between a column and the one before, and the cost of lines that turn back."""
        left, right = (self._places(level) if 0 <= level < len(self.columns) else {} for level in (i - 1, i))
        ends = [
            (link, self._end(left, link.a, link.y_a), self._end(right, link.b, link.y_b)) for link in self._before[i]
        ]
        cost = sum(BACK * self._turns_back(link, b / len(right) - a / len(left)) for link, a, b in ends)
        return cost + sum(
            link.net != other.net and (a - c) * (b - d) < 0
            for (link, a, b), (other, c, d) in itertools.combinations(ends, 2)
        )

    def within(self, i: int) -> float:
        """The cost of lines within a column."""
        place, cost = self._places(i), 0.0
        for link in self._inside[i]:
            apart = place[link.b] - place[link.a]
            cost += UPSIDE_DOWN * self._turns_back(link, apart) + AWAY * (abs(apart) - 1)
        return cost

    def _turns_back(self, link: Link, down: float) -> int:
        """The number of ends, above or below an item, at which a line leaves away from its other end."""
        found = 0
        for item, y, way in ((link.a, link.y_a, down), (link.b, link.y_b, -down)):
            leaves = (y > self._heights[item]) - (y < 0)
            found += leaves * way < 0
        return found

    def _places(self, i: int) -> dict[int, int]:
        return {item: k for k, item in enumerate(self.columns[i])}

    def _end(self, places: dict[int, int], item: int, y: int) -> float:
        return places[item] + 0.9 * (y + 1) / (self._heights[item] + 2)
