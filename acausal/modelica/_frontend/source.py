"""Texts, places in them, and errors that show a place."""

import bisect
import io
from pathlib import Path

from .._errors import ModelicaError
from .._syntax.flat import SourcePlace


class Source:
    """A Modelica text and the name of its file. The text of a file is read when it is needed."""

    def __init__(self, file: str, text: str | None = None) -> None:
        self.file = file
        self._text = text
        self._starts: list[int] | None = None

    @property
    def text(self) -> str:
        if self._text is None:
            self._text = Path(self.file).read_text("utf-8-sig")
        return self._text

    def line_and_column(self, offset: int) -> tuple[int, int]:
        """Line and column of an offset, both from 1."""
        if self._starts is None:
            self._starts = [0]
            for line in io.StringIO(self.text, newline=""):
                if line.endswith(("\n", "\r")):
                    self._starts.append(self._starts[-1] + len(line))
        line = bisect.bisect_right(self._starts, offset)
        return line, offset - self._starts[line - 1] + 1

    def place(self, offset: int) -> SourcePlace:
        return SourcePlace(self.file, self.line_and_column(offset)[0])

    def error(self, offset: int, message: str) -> "TextError":
        """An error with file, line and column, and the line of the text with a caret below the place."""
        line, column = self.line_and_column(offset)
        lines = list(io.StringIO(self.text))
        shown = lines[line - 1].rstrip("\n").replace("\t", " ") if line <= len(lines) else ""
        return TextError(f"{self.file}:{line}:{column}: {message}\n  {shown}\n  {' ' * (column - 1)}^")


class TextError(ModelicaError):
    """An error in a Modelica text. The message begins with file, line and column."""
