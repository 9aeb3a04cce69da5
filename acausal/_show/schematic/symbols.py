"""Symbols of component classes: their data, their ports, and their pictures as SVG."""

import dataclasses
import html
import importlib
import importlib.util
import typing
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from ..._declare.fields import dynamic_fields, parts_of
from ..._declare.node import Node, Port
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


def symbol_of(part: Any) -> Symbol:
    """The symbol of a component or of a class: its own, that of its nearest base, or a box with its name.

    It has the ports of the component only.
    """
    cls, ports = (part, ports_of_class(part)) if isinstance(part, type) else (type(part), ports_of(part))
    found = next((symbol for base in cls.__mro__ if (symbol := _beside(base)) is not None), None)
    if found is None or not ports.keys() <= found.ports.keys():
        return box(cls.__name__, ports)
    return dataclasses.replace(found, ports={port: found.ports[port] for port in ports})


def has_symbols(cls: type) -> bool:
    """Whether the package of a class gives symbols."""
    package = cls.__module__.rpartition(".")[0]
    return bool(package) and importlib.util.find_spec(f"{package}._symbols") is not None


def colour_of_class(cls: type) -> str | None:
    """The colour that the package of a class gives to its domain."""
    return getattr(_symbols_beside(cls), "COLOUR", None)


def _beside(cls: type) -> Symbol | None:
    """The symbol that the package of a class gives it."""
    found = _symbols_beside(cls)
    return None if found is None else found.SYMBOLS.get(cls.__name__)


def _symbols_beside(cls: type) -> Any:
    """The module of symbols in the package of a class."""
    return importlib.import_module(f"{cls.__module__.rpartition('.')[0]}._symbols") if has_symbols(cls) else None


def ports_of(part: Node) -> dict[str, type[Port]]:
    """The ports of a component by name, such as `u[0]` for the first of several."""
    fields = [name for name, declaration in dynamic_fields(type(part)) if declaration is None]
    found = [pair for name in fields for pair in parts_of(getattr(part, name), name)]
    return {name: type(port) for name, port in found if isinstance(port, Port)}


def ports_of_class(cls: Any) -> dict[str, type[Port]]:
    """The ports that a class declares, including optional ones."""
    hints = typing.get_type_hints(cls)
    kinds = {name: (hints[name], *typing.get_args(hints[name])) for name, _ in dynamic_fields(cls)}
    found = {
        name: [kind for kind in of if isinstance(kind, type) and issubclass(kind, Port)] for name, of in kinds.items()
    }
    return {name: of[0] for name, of in found.items() if of}


def domain_of(kind: type) -> str:
    """The package of a class; in a script, the class."""
    public = [name for name in kind.__module__.split(".") if not name.startswith("_")]
    return public[-1] if public else kind.__name__


def box(title: str, ports: Mapping[str, type[Port]]) -> Symbol:
    """A box with a title: inputs and the first domain on the left, outputs and other domains on the right."""
    left, right = _sides(ports)
    rows = max(len(left), len(right), 1)
    width = (
        2 * GRID * round(0.5 + max(7.0 * len(title) + 10.0, 6.0 * _longest(left) + 6.0 * _longest(right) + 20.0) / 20.0)
    )
    height = 2 * GRID * (rows + 1)
    places = {port: (x, 30 + 20 * i) for x, names in ((0, left), (width, right)) for i, port in enumerate(names)}
    words = [
        (3.0 * len(port) + 4.0 if x == 0 else x - 3.0 * len(port) - 4.0, y, port, 9.0)
        for port, (x, y) in places.items()
    ]
    return Symbol(width, height, places, f"M0 0H{width}V{height}H0Z", texts=((width / 2.0, 12.0, title, 11.0), *words))


def _longest(names: Sequence[str]) -> int:
    return max(map(len, names), default=0)


def _sides(ports: Mapping[str, type[Port]]) -> tuple[list[str], list[str]]:
    """The ports on the left and on the right of a box."""
    signals = {port: is_input(kind) for port, kind in ports.items() if not _has_flow(kind)}
    others = {port: domain_of(kind) for port, kind in ports.items() if port not in signals}
    first = [port for port, domain in others.items() if domain == next(iter(others.values()))]
    if len(first) == len(others):
        first = first[: (len(first) + 1) // 2]
    left = [port for port in ports if port in first or signals.get(port)]
    return left, [port for port in ports if port not in left]


def is_input(kind: type[Port]) -> bool:
    """Whether a port reads a signal."""
    return kind.needs_connection and not _has_flow(kind)


def _has_flow(kind: type[Port]) -> bool:
    return any(declaration is not None and declaration.role == "flow" for _, declaration in dynamic_fields(kind))


def symbol_svg(cls: type) -> str:
    """The symbol of a class as SVG, with the names of its ports as tooltips."""
    symbol = symbol_of(cls)
    dots = "".join(
        f'<circle cx="{x}" cy="{y}" r="2.5" fill="{DARK}"><title>{html.escape(port)}</title></circle>'
        for port, (x, y) in symbol.ports.items()
    )
    edge, width, height = 6, symbol.width, symbol.height
    return (
        f'<svg {ROOT} width="{width + 2 * edge}" height="{height + 2 * edge}" '
        f'viewBox="{-edge} {-edge} {width + 2 * edge} {height + 2 * edge}" role="img">'
        f"<title>{html.escape(cls.__name__)}</title>{drawn(Turned(symbol), DARK, symbol.ports)}{dots}</svg>"
    )
