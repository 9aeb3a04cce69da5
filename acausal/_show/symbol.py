"""Symbols of component classes in diagrams."""

import dataclasses
import html
import importlib
import importlib.util
import typing
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from .._declare.fields import dynamic_fields, parts_of
from .._declare.node import Node, Port
from .._errors import ModelError

GRID = 10  # pixels
DARK = "#333333"
STYLE = 'fill="none" stroke-width="1.6" stroke-linejoin="round" stroke-linecap="round"'
FONT = 'font-family="Helvetica, Arial, sans-serif" text-anchor="middle" stroke="none"'


class Text(NamedTuple):
    """A word in a symbol, with its centre."""

    x: float
    y: float
    text: str
    size: float = 11.0


@dataclasses.dataclass(frozen=True)
class Symbol:
    """The picture of a component class in diagrams, in pixels on a grid of 10.

    `ports` are the places of the ports on the edge of the symbol. `lines`, `dashed` and `solid` are data of SVG paths:
    outlines, dashed outlines and filled areas. `texts` stay upright where the symbol is turned. A symbol with
    `is_reference`, such as that of a tank, is drawn at each port to which its component is connected.

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
    is_reference: bool = False

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
            self.is_reference or other.is_reference,
        )


def symbol_of(part: Any) -> Symbol:
    """The symbol of a component or of a class: its own, that of its nearest base, or a box with its name.

    It has the ports of the component only.
    """
    cls, ports = (part, ports_of_class(part)) if isinstance(part, type) else (type(part), ports_of(part))
    found = next((symbol for base in cls.__mro__ if (symbol := _beside(base)) is not None), None)
    if found is None or not ports.keys() <= found.ports.keys():
        return box(cls.__name__, ports)
    return dataclasses.replace(found, ports={port: found.ports[port] for port in ports})


def _beside(cls: type) -> Symbol | None:
    """The symbol of a class in the module `_symbols` of its package."""
    package = cls.__module__.rpartition(".")[0]
    if not package or importlib.util.find_spec(f"{package}._symbols") is None:
        return None
    return importlib.import_module(f"{package}._symbols").SYMBOLS.get(cls.__name__)


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


def domain_of(kind: type[Port]) -> str:
    """The package of a port's class; in a script, the class."""
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
        Text(3.0 * len(port) + 4.0 if x == 0 else x - 3.0 * len(port) - 4.0, y, port, 9.0)
        for port, (x, y) in places.items()
    ]
    return Symbol(width, height, places, f"M0 0H{width}V{height}H0Z", texts=(Text(width / 2.0, 12.0, title), *words))


def _longest(names: Sequence[str]) -> int:
    return max(map(len, names), default=0)


def _sides(ports: Mapping[str, type[Port]]) -> tuple[list[str], list[str]]:
    """The ports on the left and on the right of a box."""
    signals = {port: kind.needs_connection for port, kind in ports.items() if not _has_flow(kind)}
    others = {port: domain_of(kind) for port, kind in ports.items() if port not in signals}
    first = [port for port, domain in others.items() if domain == next(iter(others.values()))]
    if len(first) == len(others):
        first = first[: (len(first) + 1) // 2]
    left = [port for port in ports if port in first or signals.get(port)]
    return left, [port for port in ports if port not in left]


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
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width + 2 * edge}" height="{height + 2 * edge}" '
        f'viewBox="{-edge} {-edge} {width + 2 * edge} {height + 2 * edge}" role="img">'
        f"<title>{html.escape(cls.__name__)}</title>{drawn(symbol, DARK)}{dots}</svg>"
    )


def drawn(symbol: Symbol, colour: str) -> str:
    """The picture as an SVG group."""
    paths = [
        f'<path d="{symbol.lines}"/>' if symbol.lines else "",
        f'<path d="{symbol.dashed}" stroke-dasharray="4 3"/>' if symbol.dashed else "",
        f'<path d="{symbol.solid}" fill="{colour}"/>' if symbol.solid else "",
    ]
    words = [
        f'<text x="{x:g}" y="{y + size / 3:g}" font-size="{size:g}" fill="{colour}" {FONT}>{html.escape(word)}</text>'
        for x, y, word, size in symbol.texts
    ]
    return f'<g stroke="{colour}" {STYLE}>{"".join(paths + words)}</g>'
