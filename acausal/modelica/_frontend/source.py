"""Texts, places in them, and errors that show a place."""

import bisect
import contextlib
import io
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

from ..._errors import ModelError
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
        place = f"{self.file}:{line}:{column}"
        return TextError(place, f"{place}: {message}\n  {shown}\n  {' ' * (column - 1)}^")


class Spot(NamedTuple):
    """A place in a text, for the equations that come from it and for errors."""

    source: Source
    offset: int

    @property
    def place(self) -> SourcePlace:
        return self.source.place(self.offset)

    def error(self, message: str) -> "TextError":
        return self.source.error(self.offset, message)


class TextError(ModelicaError):
    """An error in a Modelica text. The message begins with its place: file, line and column."""

    def __init__(self, place: str, message: str) -> None:
        super().__init__(message)
        self.place = place


class Problems:
    """Collects the errors of a model, so that a user sees all of them: one for each place."""

    def __init__(self) -> None:
        self._found: dict[str, TextError] = {}

    @contextlib.contextmanager
    def of(self, error: Callable[[str], TextError]) -> Iterator[None]:
        """Notes the error of a part of the model. `error` gives a place to one without."""
        try:
            yield
        except TextError as found:
            self._found.setdefault(found.place, found)
        except ModelicaError:  # of a file or a library
            raise
        except RecursionError:
            placed = error("classes, constants or functions contain themselves here, or expressions nest too deeply.")
            self._found.setdefault(placed.place, placed)
        except ModelError as found:  # of a value on which the structure depends
            placed = error(str(found))
            self._found.setdefault(placed.place, placed)

    def check(self) -> None:
        """Raises `ModelicaError` with all errors, if there are any."""
        if self._found:
            first, *others = self._found.values()
            raise ModelicaError("\n".join(map(str, [first, *others]))) if others else first
