"""A report in one HTML file: headings, tables as text, and pictures within the file."""

import base64
import html
import io
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STYLE = """body{font:15px sans-serif;max-width:60em;margin:2em auto;padding:0 1em}
pre{font-size:12px;overflow-x:auto} img{max-width:100%}"""


def write_report(directory: Path, name: str, title: str, parts: Iterable[tuple[str, str, list["Figure"]]]) -> None:
    """Write parts, each a heading, a text and its pictures, and say where."""
    directory.mkdir(parents=True, exist_ok=True)
    head = f'<!doctype html>\n<html lang="en"><meta charset="utf-8"><title>{html.escape(title)}</title>'
    lines = [head, f"<style>{STYLE}</style>", f"<h1>{html.escape(title)}</h1>"]
    for heading, text, figures in parts:
        lines += [f"<h2>{html.escape(heading)}</h2>", f"<pre>{html.escape(text)}</pre>", *map(_image, figures)]
    path = directory / f"{name}.html"
    path.write_text("\n".join(lines) + "\n")
    print(f"wrote {path}")


def _image(figure: "Figure") -> str:
    content = io.BytesIO()
    figure.savefig(content, format="png", dpi=110)
    return f'<img alt="" src="data:image/png;base64,{base64.b64encode(content.getvalue()).decode()}">'
