"""Messages and files: functions of Modelica.Utilities."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from ...._errors import ModelError
from ..._files_read import reads
from ..tables.files import matrix


def _lines(file: str) -> list[str]:
    reads(Path(file))
    if not Path(file).is_file():
        raise ModelError(f"the file {file} does not exist.")
    return Path(file).read_text().splitlines()


def _read_line(file: str, number: int) -> tuple[str, bool]:
    lines = _lines(file)
    return (lines[number - 1], False) if number <= len(lines) else ("", True)


FUNCTIONS: dict[str, Callable[..., Any]] = {
    "ModelicaInternal_print": lambda text="", file="": (),
    "ModelicaInternal_fullPathName": lambda name: f"{Path(name).resolve()}{name[len(name.rstrip('/')) :]}",
    "ModelicaInternal_countLines": lambda file: len(_lines(file)),
    "ModelicaInternal_readLine": _read_line,
    "ModelicaStreams_closeFile": lambda file: (),
    "ModelicaIO_readMatrixSizes": lambda file, name: list(matrix(file, name).shape),
    "ModelicaIO_readRealMatrix": lambda file, name, rows, columns, verbose=True: matrix(file, name),
}
