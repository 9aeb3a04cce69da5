"""A symbol as SVG."""

import html
from collections.abc import Iterable

from .symbols import Turned

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
