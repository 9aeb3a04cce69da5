"""Layout of a schematic: places of glyphs, and orthogonal lines around them, with few bends and crossings."""

import dataclasses
import heapq
import itertools
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

from ..._errors import ModelError
from .graph import Glyph, Graph
from .order import levels, ordered
from .places import columns, places, standing
from .symbols import Point

BEND, CROSSING, CLOSE = 3.0, 8.0, 0.4  # costs in units of length
ROUNDS = 2  # of removing each line and drawing it again

Edge = tuple[Point, Point]
State = tuple[Point, Point]  # a point and the direction of arrival


class PortEnd(NamedTuple):
    """A port and the direction in which its line leaves."""

    at: Point
    out: Point

    @property
    def stub(self) -> Point:
        return _moved(self.at, self.out)


@dataclasses.dataclass(frozen=True)
class Wire:
    """The lines of a net as edges of the grid, each from its left or upper point."""

    edges: frozenset[Edge]

    def runs(self) -> Iterator[Edge]:
        """The longest straight pieces."""
        for axis in (0, 1):
            starts = {a: b for a, b in self.edges if a[axis] != b[axis]}
            for a in sorted(starts.keys() - set(starts.values())):
                b = a
                while b in starts:
                    b = starts[b]
                yield a, b

    def junctions(self) -> list[Point]:
        """The points at which three or four lines meet."""
        count: dict[Point, int] = defaultdict(int)
        for edge in self.edges:
            for point in edge:
                count[point] += 1
        return sorted(point for point, lines in count.items() if lines > 2)


class NoRoute(Exception):
    """Raised if a port of a net cannot be reached. The argument is the number of the net."""


def routed(nets: Sequence[Sequence[PortEnd]], blocked: set[Point], size: Point) -> list[Wire]:
    """Lines for all nets on a grid of a given size. Raises `NoRoute` if there is no space for one.

    Short nets are drawn first. If others leave no way to a net, all are drawn again, this one first.
    """
    order = sorted(range(len(nets)), key=lambda number: _extent(nets[number]))
    for left in reversed(range(len(nets) + 1)):
        router = _Router(nets, blocked, size)
        try:
            for number in order:
                router.draw(number)
        except NoRoute as failure:
            if not left:
                raise
            order.sort(key=lambda number, first=failure.args[0]: number != first)
        else:
            return _improved(router, order)
    return []


def _improved(router: "_Router", order: list[int]) -> list[Wire]:
    """The lines after each net was drawn again, beside all others."""
    for number in order * ROUNDS:
        router.erase(number)
        router.draw(number)
    return [Wire(frozenset(edges)) for edges in router.edges]


def _extent(net: Sequence[PortEnd]) -> int:
    xs, ys = zip(*(end.at for end in net), strict=True)
    return max(xs) - min(xs) + max(ys) - min(ys)


def _moved(point: Point, by: Point) -> Point:
    return point[0] + by[0], point[1] + by[1]


def _edge(a: Point, b: Point) -> Edge:
    return (a, b) if a < b else (b, a)


def _is_across(edge: Edge, way: Point) -> bool:
    (a, b), (c, d) = edge
    return (a == c) == (way[0] != 0) and (b == d) == (way[1] != 0)


class _Router:
    def __init__(self, nets: Sequence[Sequence[PortEnd]], blocked: set[Point], size: Point) -> None:
        self._nets, self._blocked, self._size = nets, blocked, size
        self._close = {_moved(point, way) for point in blocked for way in ((1, 0), (-1, 0), (0, 1), (0, -1))}
        self._reserved = {end.stub: number for number, net in enumerate(nets) for end in net}
        self._user: dict[Edge, int] = {}
        self._lines: dict[Point, dict[int, set[Edge]]] = defaultdict(lambda: defaultdict(set))  # at a point, by net
        self.edges: list[set[Edge]] = [set() for _ in nets]

    def erase(self, number: int) -> None:
        for edge in self.edges[number]:
            del self._user[edge]
            for point in edge:
                self._lines[point].pop(number, None)
        self.edges[number] = set()

    def draw(self, number: int) -> None:
        """Join each port with the nearest that is already joined, or with the lines between them."""
        first, *rest = sorted(self._nets[number])
        self._add(number, [first.at, first.stub])
        while rest:
            reached = {point for edge in self.edges[number] for point in edge} - {end.at for end in self._nets[number]}
            near = min(rest, key=lambda end: min(abs(x - end.stub[0]) + abs(y - end.stub[1]) for x, y in reached))
            self._add(number, self._path(number, near, reached))
            rest.remove(near)

    def _add(self, number: int, path: Sequence[Point]) -> None:
        for a, b in itertools.pairwise(path):
            edge = _edge(a, b)
            self._user[edge] = number
            self.edges[number].add(edge)
            for point in edge:
                self._lines[point][number].add(edge)

    def _path(self, number: int, end: PortEnd, targets: set[Point]) -> list[Point]:
        """The cheapest path from a port to one of the targets (Dijkstra, with a bound on the remaining length)."""
        left, top = (min(point[axis] for point in targets) for axis in (0, 1))
        right, bottom = (max(point[axis] for point in targets) for axis in (0, 1))

        def remaining(point: Point) -> int:
            x, y = point
            return max(left - x, 0, x - right) + max(top - y, 0, y - bottom)

        start: State = (end.stub, end.out)
        cost, came = {start: 0.0}, {}
        queue = [(float(remaining(end.stub)), 0.0, start)]
        while queue:
            _, so_far, state = heapq.heappop(queue)
            if so_far > cost[state]:
                continue
            if state[0] in targets:
                return [end.at, *_walked(state, came)]
            for step, further in self._steps(number, state, targets):
                total = so_far + step
                if total < cost.get(further, float("inf")):
                    cost[further], came[further] = total, state
                    heapq.heappush(queue, (total + remaining(further[0]), total, further))
        raise NoRoute(number)

    def _steps(self, number: int, state: State, targets: set[Point]) -> Iterable[tuple[float, State]]:
        """The neighbours of a state, with the costs of the steps to them."""
        point, way = state
        others = self._others(number, point)
        for turn in (way,) if others else (way, (way[1], way[0]), (-way[1], -way[0])):
            further = _moved(point, turn)
            crossed = self._others(number, further)
            is_crossing = not crossed or (len(crossed) == 2 and all(_is_across(edge, turn) for edge in crossed))
            if not self._is_free(number, point, further) or not is_crossing or (crossed and further in targets):
                continue
            bends, crosses, is_close = turn != way, bool(crossed), further in self._close
            yield 1.0 + BEND * bends + CROSSING * crosses + CLOSE * is_close, (further, turn)

    def _others(self, number: int, point: Point) -> list[Edge]:
        return (
            [edge for net, edges in self._lines[point].items() if net != number for edge in edges]
            if point in self._lines
            else []
        )

    def _is_free(self, number: int, point: Point, further: Point) -> bool:
        x, y = further
        is_inside = 0 <= x <= self._size[0] and 0 <= y <= self._size[1]
        is_own = (
            self._reserved.get(further, number) == number and self._user.get(_edge(point, further), number) == number
        )
        return is_inside and is_own and further not in self._blocked


def _walked(state: State, came: dict[State, State]) -> list[Point]:
    states = [state]
    while states[-1] in came:
        states.append(came[states[-1]])
    return [point for point, _ in reversed(states)]


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
