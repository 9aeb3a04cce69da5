"""Execution of Markdown pages.

Blocks that open with ```` ```python ```` are executed, all blocks of a page in one namespace. The ```` ```text ````
block right after a block is its output. Words after `python` are options:

- `raises`: the block must end in an exception, whose type and message are its output;
- `picture=NAME`: the current matplotlib figure is saved as `docs/pictures/NAME.png` when the pages are regenerated. If
  the block ends with an object that notebooks show as SVG, this is saved as `docs/pictures/NAME.svg`.
"""

import ast
import contextlib
import dataclasses
import functools as ft
import io
import re
import sys
import textwrap
import types
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import matplotlib as mpl

mpl.use("Agg")
import matplotlib.pyplot as plt

ROOT = Path(__file__).parent.parent
DOCS = ROOT / "docs"
PICTURES = DOCS / "pictures"
WIDTH = 110  # line width of messages
PAGES = (ROOT / "README.md", *sorted(DOCS.glob("*.md")), *sorted(DOCS.glob("*/*.md")))
_BLOCK = re.compile(
    r"^```python(?P<words>[^\n]*)\n(?P<code>.*?)^```\n(?P<output>\n```text\n.*?^```\n)?", re.DOTALL | re.MULTILINE
)


def named(path: Path) -> str:
    """The name of a page or notebook on the command line: its path relative to the documentation folder."""
    return (path.relative_to(DOCS) if path.is_relative_to(DOCS) else path.relative_to(ROOT)).as_posix()


class PageError(Exception):
    """Raised if the code of a page fails or does not raise as declared."""


@dataclasses.dataclass(frozen=True)
class Block:
    """A Python block; `line` is the number of its first line of code."""

    words: tuple[str, ...]
    code: str
    line: int

    @property
    def raises(self) -> bool:
        return "raises" in self.words

    @property
    def picture(self) -> str | None:
        named = [word.removeprefix("picture=") for word in self.words if word.startswith("picture=")]
        return named[0] if named else None


def refreshed(page: Path, pictures: Path | None = None) -> str:
    """Executes a page and returns its text with new outputs; writes its pictures to a folder, if given."""
    text, pieces, end = page.read_text(), [], 0
    with _module(f"docs_page_{page.stem}") as module:
        for match in _BLOCK.finditer(text):
            line = text.count("\n", 0, match.start("code")) + 1
            block = Block(tuple(match["words"].split()), match["code"], line)
            output, value = _run(block, module, page)
            if block.picture and pictures is not None:
                _draw(block.picture, pictures, value)
            plt.close("all")
            pieces += [text[end : match.start()], f"```python{match['words']}\n{block.code}```\n"]
            pieces += [f"\n```text\n{output}\n```\n"] if output else []
            end = match.end()
    return "".join([*pieces, text[end:]])


@contextlib.contextmanager
def namespace(page: Path, *, blocks: int) -> Iterator[types.ModuleType]:
    """Executes the first blocks of a page and yields their module."""
    text = page.read_text()
    with _module(f"docs_page_{page.stem}") as module:
        for match in list(_BLOCK.finditer(text))[:blocks]:
            _run(Block((), match["code"], text.count("\n", 0, match.start("code")) + 1), module, page)
        yield module


@contextlib.contextmanager
def _module(name: str) -> Iterator[types.ModuleType]:
    """A module for the classes of a page, in which their annotations are resolved."""
    module = types.ModuleType(name)
    sys.modules[name] = module
    try:
        yield module
    finally:
        del sys.modules[name]


def _run(block: Block, module: types.ModuleType, page: Path) -> tuple[str, object]:
    """The output of a block, and the value of the expression with which it ends, if any."""
    # Blank lines in front, so that a traceback has the line numbers of the page.
    code = ast.parse("\n" * (block.line - 1) + block.code, str(page))
    end = code.body[-1]
    last = ast.Expression(end.value) if isinstance(end, ast.Expr) else None
    code.body = code.body[:-1] if last else code.body
    printed, value = io.StringIO(), None
    with contextlib.redirect_stdout(printed):
        try:
            exec(compile(code, str(page), "exec"), vars(module))
            value = eval(compile(last, str(page), "eval"), vars(module)) if last else None
        except Exception as error:
            if not block.raises:
                raise PageError(f"{page.name}, block at line {block.line}: {type(error).__name__}: {error}") from error
            print(_wrapped(f"{type(error).__name__}: {error}"))
        else:
            if block.raises:
                raise PageError(f"{page.name}, block at line {block.line}: no exception was raised.")
    return "\n".join(line.rstrip() for line in printed.getvalue().strip("\n").split("\n")), value


def _wrapped(message: str) -> str:
    fill = ft.partial(textwrap.fill, width=WIDTH, subsequent_indent="    ", break_long_words=False)
    return "\n".join(fill(line) for line in message.split("\n"))


def _draw(name: str, folder: Path, value: Any) -> None:
    folder.mkdir(exist_ok=True)
    if hasattr(value, "_repr_svg_"):
        (folder / f"{name}.svg").write_text(value._repr_svg_(), encoding="utf-8")
    else:
        plt.gcf().savefig(folder / f"{name}.png", dpi=100)
