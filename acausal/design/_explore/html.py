"""Tables of a page."""

import html
from collections.abc import Iterable, Sequence


def table(head: Sequence[str], rows: Iterable[Sequence[str]], marked: Sequence[str] = ()) -> str:
    """A table; rows whose first cell is `marked` are red."""
    lines = [_row("th", head, "")]
    lines += [_row("td", row, "color:#b00020" if row[0] in marked else "") for row in rows]
    return f"<table>{''.join(lines)}</table>"


def _row(kind: str, cells: Sequence[str], style: str) -> str:
    content = (
        f'<{kind} style="text-align:left;padding:0.1rem 0.8rem 0.1rem 0">{html.escape(cell)}</{kind}>' for cell in cells
    )
    return f'<tr style="{style}">{"".join(content)}</tr>'
