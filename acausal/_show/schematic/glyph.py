"""Geometry of a component in a schematic, in units of the grid."""

import dataclasses
import functools as ft
import itertools
from collections.abc import Iterator, Mapping
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
