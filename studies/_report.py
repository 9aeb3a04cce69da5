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

LONGEST = 400  # letters that say what a picture shows


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
        lines.append(f"<h2>{html.escape(heading)}</h2>")
        lines += [f"<pre>{html.escape(text)}</pre>"] if text else []
        lines += [_image(figure, heading) for figure in figures]
    made = ", ".join(f"{package} {importlib.metadata.version(package)}" for package in ("acausal", "jax"))
    lines.append(f"<footer>Made by <code>python -m studies {html.escape(name)}</code> with {made}.</footer>")
    path = directory / f"{name}.html"
    path.write_text("\n".join(lines) + "\n")
    print(f"wrote {path}")


def _image(figure: "Figure", heading: str) -> str:
    content = io.BytesIO()
    figure.savefig(content, format="png", dpi=110)
    data = base64.b64encode(content.getvalue()).decode()
    return f'<img alt="{html.escape(_said(figure, heading))}" src="data:image/png;base64,{data}">'


def _said(figure: "Figure", heading: str) -> str:
    """What a picture shows, for those who cannot see it: the titles and what is over what."""
    panels = [figure.get_suptitle() or heading]
    for panel in figure.axes:
        title = panel.get_title("left") or panel.get_title()
        axes = " over ".join(label for label in (panel.get_ylabel(), panel.get_xlabel()) if label)
        panels.append(": ".join(text.strip().replace("\n", ", ") for text in (title, axes) if text))
    return textwrap.shorten("; ".join(filter(None, dict.fromkeys(panels))), LONGEST, placeholder=" ...")
