"""Symbols of component classes, and a symbol as SVG."""

import dataclasses
import html
from collections.abc import Iterable, Mapping

from ..._errors import ModelError

GRID = 10  # pixels

Point = tuple[int, int]
Text = tuple[float, float, str, float]  # centre, words, size of letters


@dataclasses.dataclass(frozen=True)
class Symbol:
    """The picture of a component class in diagrams, in pixels on a grid of 10.

    `ports` are the places of the ports on the edge of the symbol. `lines`, `dashed` and `solid` are data of SVG paths:
    outlines, dashed outlines and filled areas. `leads` are outlines that join a port to the symbol, drawn if the port
    has a line. `texts` stay upright where the symbol is turned. A symbol with `is_reference`, such as a tank, is
    drawn at each port to which its component is connected. One without `can_turn`, such as a curve, is never mirrored.

    A package of components gives their symbols by class name in the dictionary `SYMBOLS` of its module `_symbols`. A
    class without an entry has the symbol of its base.
    """

    width: int
    height: int
    ports: Mapping[str, tuple[int, int]]
    lines: str = ""
    dashed: str = ""
    solid: str = ""
    texts: tuple[Text, ...] = ()
    leads: Mapping[str, str] = dataclasses.field(default_factory=dict)
    is_reference: bool = False
    can_turn: bool = True

    def __post_init__(self) -> None:
        for port, (x, y) in self.ports.items():
            is_inside = 0 <= x <= self.width and 0 <= y <= self.height
            if not is_inside or (x in (0, self.width)) == (y in (0, self.height)) or x % GRID or y % GRID:
                raise ModelError(
                    f"Port {port!r} of a symbol is at ({x}, {y}): place it at a multiple of {GRID} on one edge of the "
                    f"symbol of {self.width} by {self.height}, and not at a corner."
                )

    def __add__(self, other: "Symbol") -> "Symbol":
        """Both pictures over each other, with the ports of both."""
        return Symbol(
            max(self.width, other.width),
            max(self.height, other.height),
            {**self.ports, **other.ports},
            self.lines + other.lines,
            self.dashed + other.dashed,
            self.solid + other.solid,
            self.texts + other.texts,
            {**self.leads, **other.leads},
            self.is_reference or other.is_reference,
            self.can_turn and other.can_turn,
        )


@dataclasses.dataclass(frozen=True)
class Turned:
    """A symbol: mirrored from left to right if `is_mirrored`, then across its diagonal if `is_turned`; left is up."""

    symbol: Symbol
    is_mirrored: bool = False
    is_turned: bool = False

    @property
    def size(self) -> Point:
        width, height = self.symbol.width // GRID, self.symbol.height // GRID
        return (height, width) if self.is_turned else (width, height)

    def moved(self, x: float, y: float) -> tuple[float, float]:
        """The place of a point of the symbol, in pixels."""
        x = self.symbol.width - x if self.is_mirrored else x
        return (y, x) if self.is_turned else (x, y)

    def port(self, name: str) -> Point:
        x, y = self.moved(*self.symbol.ports[name])
        return round(x) // GRID, round(y) // GRID

    def side(self, name: str) -> Point:
        """The direction in which a line leaves a port."""
        (x, y), (width, height) = self.port(name), self.size
        return (x == width) - (x == 0), (y == height) - (y == 0)


DARK = "#333333"
ROOT = (
    'xmlns="http://www.w3.org/2000/svg" fill="none" stroke-width="1.6" stroke-linejoin="round" stroke-linecap="round" '
    'font-family="Helvetica, Arial, sans-serif"'
)  # attributes of a picture


def drawn(turned: Turned, colour: str, used: Iterable[str]) -> str:
    """A symbol as a group of paths and words, with leads to the ports that are used."""
    symbol = turned.symbol
    lines = symbol.lines + "".join(symbol.leads.get(port, "") for port in used)
    paths = [
        f'<path d="{lines}"/>' if lines else "",
        f'<path d="{symbol.dashed}" stroke-dasharray="4 3"/>' if symbol.dashed else "",
        f'<path d="{symbol.solid}" fill="{colour}"/>' if symbol.solid else "",
    ]
    words = [word(*turned.moved(x, y), text, colour, size) for x, y, text, size in symbol.texts]
    return f'<g stroke="{colour}"><g{_transform(turned)}>{"".join(paths)}</g>{"".join(words)}</g>'


def word(x: float, y: float, text: str, colour: str, size: float, anchor: str = "middle") -> str:
    """A text with the middle of its letters at a height."""
    place = f'x="{x:g}" y="{y + size / 3:.4g}" font-size="{size:g}" text-anchor="{anchor}"'
    return f'<text {place} fill="{colour}" stroke="none">{html.escape(text)}</text>'


def _transform(turned: Turned) -> str:
    """The attribute that turns the paths; empty for an upright symbol."""
    origin = turned.moved(0.0, 0.0)
    across, down = (tuple(p - o for p, o in zip(turned.moved(*way), origin, strict=True)) for way in ((1, 0), (0, 1)))
    numbers = " ".join(f"{number:g}" for number in (*across, *down, *origin))
    return "" if numbers == "1 0 0 1 0 0" else f' transform="matrix({numbers})"'
