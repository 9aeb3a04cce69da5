"""Reports: one HTML file with texts, tables and pictures, which loads nothing from elsewhere."""

import base64
import datetime
import html
import io
import os
import textwrap
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple, Self

import numpy as np

from ._declare.by_name import parameters
from ._declare.component import Component
from ._declare.tree import with_unit
from ._errors import ModelError
from ._extras import Figure, needed, pyplot
from ._fingerprint import fingerprint
from ._save_load import versions

STYLE = """:root{color-scheme:light dark;--ink:#1a1a1a;--soft:#666;--line:#ddd;--page:#fff;--box:#f6f6f6;--mark:#0072b2}
body{font:15px/1.45 system-ui,sans-serif;max-width:68em;margin:2em auto;padding:0 1em;color:var(--ink);
background:var(--page)}
h1{border-bottom:2px solid var(--mark);padding-bottom:.3em} h2{margin-top:2em} h2,h3{break-after:avoid}
footer{color:var(--soft);border-top:1px solid var(--line);margin-top:3em;padding-top:.5em;font-size:13px}
pre{font-size:12px;white-space:pre-wrap;background:var(--box);padding:.8em} img{max-width:100%;break-inside:avoid}
table{border-collapse:collapse;font-size:13px;margin:1em 0} caption{text-align:left;font-weight:bold}
th,td{text-align:left;vertical-align:top;padding:.2em 1.2em .2em 0;border-bottom:1px solid var(--line)}
tr{break-inside:avoid} .number{text-align:right;white-space:nowrap;font-variant-numeric:tabular-nums}
@media screen and (prefers-color-scheme:dark){:root{--ink:#ddd;--soft:#999;--line:#444;--page:#161616;--box:#222;
--mark:#56b4e9} img{filter:invert(.91) hue-rotate(180deg)}}
@media print{:root{color-scheme:light} body{max-width:none;margin:0;font-size:11pt}}"""

LONGEST = 400  # characters of the alternative text of a picture
SHORT = 16  # digits of a fingerprint


class Table(NamedTuple):
    """A table of strings in a report; long ones wrap within their cell, and columns of numbers are right-aligned."""

    heads: Sequence[str]
    rows: Sequence[Sequence[str]]
    title: str = ""


class Picture(NamedTuple):
    """The content of an SVG or PNG file in a report, with an alternative text."""

    content: bytes
    text: str = ""

    @classmethod
    def of(cls, figure: Figure, text: str = "") -> Self:
        """The picture of a figure of matplotlib; without a text, its `labels` are the alternative text."""
        with needed("matplotlib", "plots", "A picture").rc_context({"svg.hashsalt": "acausal"}):
            content = io.BytesIO()
            figure.savefig(content, format="svg", transparent=True, metadata={"Date": None})
        return cls(content.getvalue(), text or cls.labels(figure))

    @staticmethod
    def labels(figure: Figure, heading: str = "") -> str:
        """The titles and axis labels of a figure, after its own title or a heading."""
        panels = [figure.get_suptitle() or heading]
        for panel in figure.axes:
            title = panel.get_title("left") or panel.get_title()
            axes = " over ".join(label for label in (panel.get_ylabel(), panel.get_xlabel()) if label)
            panels.append(": ".join(text.strip().replace("\n", ", ") for text in (title, axes) if text))
        return textwrap.shorten("; ".join(filter(None, dict.fromkeys(panels))), LONGEST, placeholder=" ...")


def drawn(draw: Callable[[], Any]) -> Picture:
    """The picture that a function draws into a new figure; it returns the figure or axes in it."""
    made = draw()
    figure = made if hasattr(made, "savefig") else np.ravel(np.asarray(made, object))[0].figure
    picture = Picture.of(figure)
    pyplot().close(figure)
    return picture


def report(
    title: str,
    parts: Mapping[str, object],
    path: str | os.PathLike[str] | None = None,
    *,
    about: str = "",
    command: str = "",
) -> str:
    """A report as one HTML file, which loads nothing from elsewhere; returns its text, and writes it to a path.

        report("Two gears", {"Runs": compare(runs, "load.w"), "Fast": fast, "Limits": Table(heads, rows)}, "gears.html")

    - `parts`: contents by heading. A content is a text, a `Table`, a `Picture`, a diagram, a figure or axes of
      matplotlib, a result with an `html` method, such as a solution or a design, or a sequence of these.
    - `about`: the introduction; blank lines separate its paragraphs.
    - `command`: the command that made the report, for the footer.

    Raises `ModelError` for any other content.
    """
    head = f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><title>{html.escape(title)}</title>'
    lines = [f'{head}\n<meta name="viewport" content="width=device-width">\n<style>{STYLE}</style></head><body>']
    lines += [f"<h1>{html.escape(title)}</h1>"]
    paragraphs = [html.escape(paragraph) for paragraph in textwrap.dedent(about).split("\n\n") if paragraph]
    lines += [f"<p>{paragraph}</p>" for paragraph in paragraphs]
    lines += _parts(parts, 2)
    made = f"Made by <code>{html.escape(command)}</code>" if command else "Made"
    lines += [f"<footer>{made} on {datetime.date.today()} with {_shown_versions()}.</footer></body></html>\n"]
    text = "\n".join(lines)
    if path is not None:
        Path(path).write_text(text, encoding="utf-8")
    return text


def model_parts(model: Component) -> dict[str, object]:
    """The parameters of a model, and its name and fingerprint."""
    found = parameters(model)
    rows = [(path, with_unit(value, ""), found.units[path] or "-") for path, value in found.items()]
    return {"Parameters": Table(("parameter", "value", "unit"), rows), "Model": provenance(type(model).__name__, found)}


def provenance(model: str, values: Mapping[str, object], equations: str | None = None) -> Table:
    """The name of a model with the fingerprints of its parameters and, if they are known, of its equations."""
    numbers = fingerprint([(name, np.asarray(value)) for name, value in values.items()])
    rows = [("model", model), ("fingerprint of the parameters", numbers[:SHORT])]
    rows += [("fingerprint of the equations", equations[:SHORT])] if equations else []
    return Table(("", ""), rows)


def _shown_versions() -> str:
    shown = [f"{'Python' if name == 'python' else name} {version}" for name, version in versions().items()]
    return ", ".join(shown)


def _parts(parts: Mapping[str, object], level: int) -> Iterator[str]:
    for heading, content in parts.items():
        yield f"<h{level}>{html.escape(heading)}</h{level}>"
        yield from _content(content, heading, level)


def _content(content: Any, heading: str, level: int) -> Iterator[str]:
    if isinstance(content, Table):
        yield _table(content)
    elif isinstance(content, Picture):
        yield _image(content, heading)
    elif hasattr(content, "_repr_svg_"):
        yield _image(Picture(content._repr_svg_().encode(), ""), heading)
    elif isinstance(content, str):
        yield f"<pre>{html.escape(content)}</pre>" if content else ""
    elif hasattr(content, "_report"):
        yield from _parts(content._report(), level + 1)
    elif hasattr(content, "savefig") or hasattr(content, "figure"):
        yield _image(Picture.of(getattr(content, "figure", None) or content), heading)
    elif isinstance(content, np.ndarray) and content.size and hasattr(content.flat[0], "figure"):
        yield _image(Picture.of(content.flat[0].figure), heading)
    elif isinstance(content, list | tuple):
        for one in content:
            yield from _content(one, heading, level)
    else:
        raise ModelError(
            f"report: {heading!r} holds a {type(content).__name__}. Pass a text, a Table, a Picture, a diagram, a "
            "figure, a result with an html method, or a list of these; str(...) is the text of anything else."
        )


def _table(table: Table) -> str:
    """An HTML table. Numeric columns are right-aligned."""
    for row in table.rows:
        if len(row) != len(table.heads) or not all(isinstance(cell, str) for cell in row):
            raise ModelError(
                f"report: the table {table.title!r} has the row {list(row)}: give a text for each of its "
                f"{len(table.heads)} columns."
            )
    numeric = [all(map(_is_number, column)) for column in zip(*table.rows, strict=True)]

    def line(cells: Iterable[str], tag: str) -> str:
        pairs = zip(cells, numeric or [False] * len(table.heads), strict=True)
        opened = ((f'<{tag} class="number">' if right else f"<{tag}>", cell) for cell, right in pairs)
        return "".join(f"{start}{html.escape(cell)}</{tag}>" for start, cell in opened)

    title = f"<caption>{html.escape(table.title)}</caption>" if table.title else ""
    head = f"<thead><tr>{line(table.heads, 'th')}</tr></thead>\n" if any(table.heads) else ""
    rows = "\n".join(f"<tr>{line(row, 'td')}</tr>" for row in table.rows)
    return f"<table>{title}\n{head}<tbody>{rows}</tbody></table>"


def _is_number(text: str) -> bool:
    try:
        float(text.removesuffix("%"))
    except ValueError:
        return text in ("-", "")
    return True


def _image(picture: Picture, heading: str) -> str:
    kind = "png" if picture.content.startswith(b"\x89PNG") else "svg+xml"
    data, text = base64.b64encode(picture.content).decode(), html.escape(picture.text or heading)
    return f'<img alt="{text}" src="data:image/{kind};base64,{data}">'
