"""Reports as a single HTML file: introduction, headings, texts, tables, and embedded pictures."""

import base64
import html
import importlib.metadata
import textwrap
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from ._output import png

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STYLE = """body{font:15px sans-serif;max-width:68em;margin:2em auto;padding:0 1em}
h1{border-bottom:2px solid #0072b2;padding-bottom:.3em} footer{color:#777;border-top:1px solid #ccc;margin-top:3em}
pre{font-size:12px;white-space:pre-wrap;background:#f7f7f7;padding:.8em} img{max-width:100%}
table{border-collapse:collapse;font-size:13px;margin:1em 0} caption{text-align:left;font-weight:bold}
th,td{text-align:left;vertical-align:top;padding:.2em .7em .2em 0;border-bottom:1px solid #ddd}
.number{text-align:right;white-space:nowrap;font-variant-numeric:tabular-nums}"""

LONGEST = 400  # characters of the alternative text of a picture


class Table(NamedTuple):
    """A table of strings; long ones wrap within their cell."""

    heads: Sequence[str]
    rows: Sequence[Sequence[str]]
    title: str = ""


Content = str | Table | Sequence[str | Table]


def write_report(
    directory: Path,
    name: str,
    title: str,
    parts: Iterable[tuple[str, Content, Sequence["Figure"]]],
    about: str | None = "",
) -> None:
    """Write the introduction and the parts, each a heading, texts and tables, and pictures; print the path."""
    directory.mkdir(parents=True, exist_ok=True)
    head = f'<!doctype html>\n<html lang="en"><meta charset="utf-8"><title>{html.escape(title)}</title>'
    lines = [head, f"<style>{STYLE}</style>", f"<h1>{html.escape(title)}</h1>"]
    lines += [
        f"<p>{html.escape(paragraph)}</p>" for paragraph in textwrap.dedent(about or "").split("\n\n") if paragraph
    ]
    for heading, content, figures in parts:
        lines.append(f"<h2>{html.escape(heading)}</h2>")
        lines += [_block(one) for one in ((content,) if isinstance(content, str | Table) else content) if one]
        lines += [_image(figure, heading) for figure in figures]
    made = ", ".join(f"{package} {importlib.metadata.version(package)}" for package in ("acausal", "jax"))
    lines.append(f"<footer>Made by <code>python -m studies {html.escape(name)}</code> with {made}.</footer>")
    path = directory / f"{name}.html"
    path.write_text("\n".join(lines) + "\n")
    print(f"wrote {path}, in a browser {path.resolve().as_uri()}")


def _block(content: str | Table) -> str:
    return _table(content) if isinstance(content, Table) else f"<pre>{html.escape(content)}</pre>"


def _table(table: Table) -> str:
    """An HTML table. Numeric columns are right-aligned."""
    numeric = [all(map(_is_number, column)) for column in zip(*table.rows, strict=True)]

    def line(cells: Iterable[str], tag: str) -> str:
        pairs = zip(cells, numeric or [False] * len(table.heads), strict=True)
        return "".join(f"<{tag}{' class=number' * right}>{html.escape(cell)}</{tag}>" for cell, right in pairs)

    title = f"<caption>{html.escape(table.title)}</caption>" if table.title else ""
    rows = "\n".join(f"<tr>{line(row, 'td')}</tr>" for row in table.rows)
    return f"<table>{title}\n<thead><tr>{line(table.heads, 'th')}</tr></thead>\n<tbody>{rows}</tbody></table>"


def _is_number(text: str) -> bool:
    try:
        float(text.removesuffix("%"))
    except ValueError:
        return text in ("-", "")
    return True


def _image(figure: "Figure", heading: str) -> str:
    data = base64.b64encode(png(figure)).decode()
    return f'<img alt="{html.escape(_said(figure, heading))}" src="data:image/png;base64,{data}">'


def _said(figure: "Figure", heading: str) -> str:
    """The alternative text of a picture: its titles and axis labels."""
    panels = [figure.get_suptitle() or heading]
    for panel in figure.axes:
        title = panel.get_title("left") or panel.get_title()
        axes = " over ".join(label for label in (panel.get_ylabel(), panel.get_xlabel()) if label)
        panels.append(": ".join(text.strip().replace("\n", ", ") for text in (title, axes) if text))
    return textwrap.shorten("; ".join(filter(None, dict.fromkeys(panels))), LONGEST, placeholder=" ...")
