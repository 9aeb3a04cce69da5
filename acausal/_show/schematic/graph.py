"""Graph of a schematic: glyphs with their geometry, and nets of ports, with references at the ports that they fix."""

import dataclasses
import functools as ft
import itertools
from collections.abc import Container, Iterator, Mapping, Sequence
from typing import NamedTuple

from .symbols import GRID, Point, Symbol, Turned

PER_LETTER, LINE_HEIGHT = 0.64, 2  # of labels
STUB = 1  # length of a line that belongs to its port alone


class Rect(NamedTuple):
    """A rectangle; y points down."""

    left: int
    top: int
    right: int
    bottom: int

    def meets(self, other: "Rect") -> bool:
        """Whether the rectangles share more than an edge."""
        is_beside = self.right <= other.left or other.right <= self.left
        return not (is_beside or self.bottom <= other.top or other.bottom <= self.top)

    def moved(self, x: int, y: int) -> "Rect":
        return Rect(self.left + x, self.top + y, self.right + x, self.bottom + y)

    def points(self) -> Iterator[Point]:
        """All points of the grid inside and on the edge."""
        return ((x, y) for x in range(self.left, self.right + 1) for y in range(self.top, self.bottom + 1))


class Hanger(NamedTuple):
    """A reference, such as a tank, at a port: its symbol and corner, and the line to it."""

    name: str
    turned: Turned
    corner: Point
    line: tuple[Point, ...]

    @property
    def rect(self) -> Rect:
        width, height = self.turned.size
        return Rect(0, 0, width, height).moved(*self.corner)


class Label(NamedTuple):
    """The place of a name: its rectangle, and the end at which the text begins."""

    rect: Rect
    anchor: str


@dataclasses.dataclass(frozen=True)
class Glyph:
    """A component with its label and the references at its ports, relative to the corner of its symbol."""

    name: str
    turned: Turned
    used: tuple[str, ...]  # ports with lines
    references: Mapping[str, tuple[str, Symbol]]  # name and symbol of the reference at a port

    @property
    def rect(self) -> Rect:
        return Rect(0, 0, *self.turned.size)

    @ft.cached_property
    def hangers(self) -> tuple[Hanger, ...]:
        return tuple(_hanger(self.turned, port, *reference) for port, reference in self.references.items())

    @ft.cached_property
    def label(self) -> Label:
        """Below, above or beside the symbol, clear of lines and references."""
        taken = [rect for hanger in self.hangers for rect in (hanger.rect, *_around(hanger.line))]
        taken += [_around_stub(self.turned, port) for port in self.used]
        beyond = max(rect.right for rect in (self.rect, *taken)) + STUB
        candidates = _labels(self.turned.size, round(PER_LETTER * len(self.name) + 0.99), beyond)
        return next(label for label in candidates if not any(label.rect.meets(rect) for rect in taken))

    @ft.cached_property
    def rects(self) -> tuple[Rect, ...]:
        """The rectangles of the symbol, of the references with their lines, and of the label."""
        hung = [rect for hanger in self.hangers for rect in (hanger.rect, *_around(hanger.line))]
        return (self.rect, *hung, self.label.rect)

    @ft.cached_property
    def outline(self) -> Rect:
        """The rectangle around everything."""
        left, top, right, bottom = zip(*self.rects, strict=True)
        return Rect(min(left), min(top), max(right), max(bottom))


def _labels(size: Point, long: int, beyond: int) -> Iterator[Label]:
    """Places for a name of a given length. The last is beyond everything on the right."""
    width, height = size
    left, middle = (width - long) // 2, (height - LINE_HEIGHT) // 2
    for x, y, anchor in (
        (left, height, "middle"),
        (left, -LINE_HEIGHT, "middle"),
        (width + 1, middle, "start"),
        (width // 2 + 1, -LINE_HEIGHT, "start"),
        (width // 2 + 1, height, "start"),
        (width // 2 - long - 1, -LINE_HEIGHT, "end"),
        (width // 2 - long - 1, height, "end"),
        (-long - 1, middle, "end"),
        (width + 1, -LINE_HEIGHT, "start"),
        (width + 1, height, "start"),
        (beyond, middle, "start"),
    ):
        yield Label(Rect(x, y, x + long, y + LINE_HEIGHT), anchor)


def _around_stub(turned: Turned, port: str) -> Rect:
    """The rectangle in which the line from a port has space to turn."""
    (x, y), (right, down) = turned.port(port), turned.side(port)
    left, top, right, bottom = _around(((x, y), (x + 2 * STUB * right, y + 2 * STUB * down)))[0]
    aside, along = (STUB, 0) if left == right else (0, STUB)
    return Rect(left - aside, top - along, right + aside, bottom + along)


def _around(line: tuple[Point, ...]) -> list[Rect]:
    """Rectangles around the pieces of a line, with a width of zero."""
    pairs = itertools.pairwise(line)
    return [Rect(min(a, c), min(b, d), max(a, c), max(b, d)) for (a, b), (c, d) in pairs]


def _hanger(owner: Turned, port: str, name: str, symbol: Symbol) -> Hanger:
    """The reference at a port. One with its port on top, such as a tank, stays upright; others turn to the port."""
    (x, y), (right, down) = owner.port(port), owner.side(port)
    own = next(iter(symbol.ports))
    if Turned(symbol).side(own) != (0, -1):
        turned = next(one for one in _turns(symbol) if one.side(own) == (-right, -down))
        end = (x + STUB * right, y + STUB * down)
        return _hung(name, turned, own, ((x, y), end))
    turned, half, height = Turned(symbol), symbol.width // GRID // 2, symbol.height // GRID
    if down == 1:
        return _hung(name, turned, own, ((x, y), (x, y + STUB)))
    if right:
        aside = x + (half + 2 * STUB) * right  # clear of lines from other ports on this side
        return _hung(name, turned, own, ((x, y), (aside, y), (aside, y + STUB)))
    aside, up = x + half + STUB, y - height - 3 * STUB
    return _hung(name, turned, own, ((x, y), (x, up), (aside, up), (aside, up + STUB)))


def _turns(symbol: Symbol) -> Iterator[Turned]:
    return (Turned(symbol, mirrored, turned) for mirrored in (False, True) for turned in (False, True))


def _hung(name: str, turned: Turned, port: str, line: tuple[Point, ...]) -> Hanger:
    (x, y), (px, py) = line[-1], turned.port(port)
    return Hanger(name, turned, (x - px, y - py), line)


SIGNAL = 0.05  # weight of a signal beside that of a line with a flow


class Terminal(NamedTuple):
    """A port of a glyph, by the number of the glyph."""

    glyph: int
    port: str


class Pair(NamedTuple):
    """Two ports of a net, with a weight."""

    a: Terminal
    b: Terminal
    weight: float
    is_alone: bool  # the net has no other ports


Net = tuple[Terminal, ...]


@dataclasses.dataclass(frozen=True)
class Graph:
    glyphs: tuple[Glyph, ...]
    nets: tuple[Net, ...]
    weights: tuple[float, ...]  # of the nets
    net_of: tuple[int, ...]  # number of the joint that each net draws

    def side(self, end: Terminal) -> Point:
        return self.glyphs[end.glyph].turned.side(end.port)

    def pairs(self) -> Iterator[Pair]:
        """Connected ports of different glyphs, with weights: all pairs of a net together weigh as its lines."""
        for net, weight in zip(self.nets, self.weights, strict=True):
            for a, b in itertools.combinations(net, 2):
                if a.glyph != b.glyph:
                    yield Pair(a, b, 2.0 * weight / len(net), len(net) == 2)

    def turned(self, number: int, turned: Turned) -> "Graph":
        """A copy in which a glyph has another direction."""
        glyphs = list(self.glyphs)
        glyphs[number] = dataclasses.replace(glyphs[number], turned=turned)
        return dataclasses.replace(self, glyphs=tuple(glyphs))


def graph_of(
    symbols: Mapping[str, Symbol], joints: Sequence[Sequence[tuple[str, str]]], signals: Container[int] = ()
) -> Graph:
    """The graph of symbols by name, from sets of connected ports, each as the name of its symbol and its own name.

    `signals` are the numbers of the sets whose lines may be long, so that loops are open there.
    """
    fixing = {i: name for i, joint in enumerate(joints) if (name := _reference(joint, symbols, joints)) is not None}
    names = [name for name in symbols if name not in fixing.values()]
    number = {name: i for i, name in enumerate(names)}
    used: dict[str, list[str]] = {name: [] for name in names}
    references: dict[str, dict[str, tuple[str, Symbol]]] = {name: {} for name in names}
    nets: dict[int, Net] = {}
    for i, joint in enumerate(joints):
        own = [(name, port) for name, port in joint if name in number]
        for name, port in own:
            if i in fixing:
                references[name][port] = (fixing[i], symbols[fixing[i]])
            elif len(own) > 1:
                used[name].append(port)
        if i not in fixing and len(own) > 1:
            nets[i] = tuple(Terminal(number[name], port) for name, port in own)
    glyphs = (
        Glyph(name, _upright(symbols[name], used[name], references[name]), tuple(used[name]), references[name])
        for name in names
    )
    weights = (SIGNAL if i in signals else 1.0 for i in nets)
    return Graph(tuple(glyphs), tuple(nets.values()), tuple(weights), tuple(nets))


def _reference(joint: Sequence[tuple[str, str]], symbols: Mapping[str, Symbol], joints: Sequence) -> str | None:
    """The reference that fixes a joint, if it is the only one there and in all of its other joints."""
    found = [name for name, _ in joint if symbols[name].is_reference]
    if len(found) != 1 or len(joint) < 2:
        return None
    elsewhere = [{name for name, _ in other if symbols[name].is_reference} for other in joints]
    return found[0] if all(names == {found[0]} for names in elsewhere if found[0] in names) else None


def _upright(symbol: Symbol, used: Sequence[str], references: Mapping[str, tuple[str, Symbol]]) -> Turned:
    """An element from left to right stands upright if only one of its ends has a reference that hangs below a port."""
    ends = sorted((side, port) for port in (*used, *references) for side in [Turned(symbol).side(port)[0]] if side)
    hanging = [side for side, port in ends if port in references and _hangs(references[port][1])]
    if [side for side, _ in ends] == [-1, 1] and len(hanging) == 1:
        return Turned(symbol, is_mirrored=hanging[0] == -1, is_turned=True)
    return Turned(symbol)


def _hangs(reference: Symbol) -> bool:
    return Turned(reference).side(next(iter(reference.ports))) == (0, -1)
