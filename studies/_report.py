"""Reports of studies: the pictures of their folder with texts and tables, in one HTML file."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from acausal import Picture, Table, report

from ._output import png

if TYPE_CHECKING:
    from matplotlib.figure import Figure

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
    contents = {
        heading: [content, *(Picture(png(figure), Picture.labels(figure, heading)) for figure in figures)]
        for heading, content, figures in parts
    }
    path = directory / f"{name}.html"
    report(title, contents, path, about=about or "", command=f"python -m studies {name}")
    print(f"wrote {path}, in a browser {path.resolve().as_uri()}")
