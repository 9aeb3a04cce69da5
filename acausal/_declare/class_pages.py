"""Documentation of a component class as text for `help`, and as HTML for notebooks."""

import html

from .class_card import Card, Row


def as_text(card: Card) -> str:
    """The text of the class, and its tables with aligned columns."""
    return "\n\n".join([card.text, *(f"{heading}:\n{_aligned(rows)}" for heading, rows in card.tables.items())]).strip()


def _aligned(rows: list[Row]) -> str:
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = ["  ".join(f"{text:{width}}" for text, width in zip(row, widths, strict=True) if width) for row in rows]
    return "\n".join(f"    {line.rstrip()}" for line in lines)


def as_html(card: Card) -> str:
    """The same as a card."""
    tables = "".join(f"<p><b>{heading}</b></p>{_table(rows)}" for heading, rows in card.tables.items())
    text = html.escape(card.text)
    return f'<div><b>{card.name}</b><p style="white-space:pre-wrap">{text}</p>{tables}</div>'


def _table(rows: list[Row]) -> str:
    used = [any(column) for column in zip(*rows, strict=True)]
    lines = [[text for text, is_used in zip(row, used, strict=True) if is_used] for row in rows]
    return "<table>" + "".join(f"<tr>{''.join(map(_cell, line))}</tr>" for line in lines) + "</table>"


def _cell(text: str) -> str:
    return f'<td style="text-align:left">{html.escape(text)}</td>'
