"""Pages whose code uses a class of the library."""

import functools as ft
import json
import re
from pathlib import Path

from .._execute import DOCS
from ._pages import path_of

_IMPORT = re.compile(r"from components\.(\w+) import (\([^)]*\)|[^\n(]+)")
_TITLE = re.compile(r"^# (.*)$", re.MULTILINE)


@ft.cache
def uses() -> dict[tuple[str, str], dict[str, str]]:
    """The pages whose code imports a class, by package and name of the class: their titles by path."""
    found: dict[tuple[str, str], dict[str, str]] = {}
    for page in sorted([*DOCS.rglob("*.md"), *DOCS.glob("*.ipynb")]):
        text = _text(page)
        path = path_of(page.relative_to(DOCS.parent).as_posix())
        for package, names in set(_IMPORT.findall(text)):
            for name in re.findall(r"\w+", names):
                found.setdefault((package, name), {})[path] = _title(text, page)
    return found


def _text(page: Path) -> str:
    if page.suffix == ".md":
        return page.read_text()
    return "\n".join("".join(cell["source"]) for cell in json.loads(page.read_text())["cells"])


def _title(text: str, page: Path) -> str:
    match = _TITLE.search(text)
    return match[1] if match else page.stem
