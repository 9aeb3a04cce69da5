"""A report in one HTML file: what it is about, headings, tables as text, and pictures within the file."""

import base64
import html
import importlib.metadata
import io
import textwrap
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STYLE = """body{font:15px sans-serif;max-width:60em;margin:2em auto;padding:0 1em}
h1{border-bottom:2px solid #0072b2;padding-bottom:.3em} footer{color:#777;border-top:1px solid #ccc;margin-top:3em}
pre{font-size:12px;overflow-x:auto;background:#f7f7f7;padding:.8em} img{max-width:100%}"""


def write_report(
    directory: Path, name: str, title: str, parts: Iterable[tuple[str, str, list["Figure"]]], about: str | None = ""
) -> None:
    """Write what it is about, in paragraphs, and parts, each a heading, a text and its pictures; and say where."""
    directory.mkdir(parents=True, exist_ok=True)
    head = f'<!doctype html>\n<html lang="en"><meta charset="utf-8"><title>{html.escape(title)}</title>'
    lines = [head, f"<style>{STYLE}</style>", f"<h1>{html.escape(title)}</h1>"]
    lines += [
        f"<p>{html.escape(paragraph)}</p>" for paragraph in textwrap.dedent(about or "").split("\n\n") if paragraph
    ]
    for heading, text, figures in parts:
        lines += [f"<h2>{html.escape(heading)}</h2>", f"<pre>{html.escape(text)}</pre>", *map(_image, figures)]
    made = ", ".join(f"{package} {importlib.metadata.version(package)}" for package in ("acausal", "jax"))
    lines.append(f"<footer>Made by <code>python -m studies {html.escape(name)}</code> with {made}.</footer>")
    path = directory / f"{name}.html"
    path.write_text("\n".join(lines) + "\n")
    print(f"wrote {path}")


def _image(figure: "Figure") -> str:
    content = io.BytesIO()
    figure.savefig(content, format="png", dpi=110)
    return f'<img alt="" src="data:image/png;base64,{base64.b64encode(content.getvalue()).decode()}">'
