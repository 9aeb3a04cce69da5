"""Dead links, anchors and pictures in a folder of HTML pages."""

import functools as ft
import html.parser
import os
import urllib.parse
from collections.abc import Iterator
from pathlib import Path

_EXTERNAL = ("http:", "https:", "mailto:", "data:", "javascript:")


class _Reader(html.parser.HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.anchors: set[str] = {"", "__top"}
        self.targets: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        self.anchors |= {name for name in (given.get("id"), given.get("name")) if name}
        target = given.get("href" if tag in ("a", "link") else "src")
        if target is not None and not target.startswith(_EXTERNAL):
            self.targets.append(target)


def dead_links(folder: Path) -> Iterator[str]:
    """A sentence for each link to a page, file or anchor that does not exist."""
    for page in sorted(folder.rglob("*.html")):
        for target in dict.fromkeys(_read(page).targets):
            path, _, anchor = urllib.parse.unquote(target).partition("#")
            path = path.partition("?")[0]
            base = folder if path.startswith("/") else page.parent
            file = Path(os.path.normpath(base / path.lstrip("/"))) if path else page
            file = file / "index.html" if file.is_dir() else file
            if not file.is_file():
                yield f"{page.relative_to(folder)} refers to {target}, which does not exist."
            elif anchor and file.suffix == ".html" and anchor not in _read(file).anchors:
                yield f"{page.relative_to(folder)} refers to {target}, which has no such anchor."


@ft.cache
def _read(page: Path) -> _Reader:
    reader = _Reader()
    reader.feed(page.read_text())
    return reader
