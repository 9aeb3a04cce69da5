"""Symbols of component classes as SVG."""

import dataclasses
import html
import importlib
import importlib.util
import typing
from collections.abc import Mapping, Sequence
from typing import Any

from .._declare.fields import dynamic_fields, parts_of
from .._declare.node import Node, Port
from .schematic.symbols import DARK, GRID, ROOT, Symbol, Turned, drawn


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
