"""Matrices in text files, MAT files and files of comma-separated values."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ...._errors import ModelError
from ..._files_read import reads

_HEADER = re.compile(r"^\s*(?:double|float)\s+(\w+)\s*\(\s*(\d+)[\s,]+(\d+)\s*\)")


def matrix(file: str, name: str, delimiter: str = ",", header_lines: int = 0) -> Any:
    """The matrix of that name in a file."""
    path = Path(file)
    reads(path)
    if not path.is_file():
        raise ModelError(f"the file {file} of the table {name} does not exist.")
    if path.suffix == ".csv":
        return np.loadtxt(path, delimiter=delimiter, skiprows=header_lines, ndmin=2)
    found = _from_mat(path, name) if path.suffix == ".mat" else _from_text(path, name)
    if found is None:
        raise ModelError(f"the file {file} has no table {name}.")
    return found


def _from_mat(path: Path, name: str) -> Any:
    from scipy.io import loadmat

    try:
        found: Any = loadmat(path, simplify_cells=True)
    except NotImplementedError:
        raise ModelError(f"the file {path} is a MAT file of version 7.3; save it as version 7.") from None
    for part in name.split("."):
        if part not in found:
            return None
        found = found[part]
    return np.atleast_2d(np.asarray(found, float))


def _from_text(path: Path, name: str) -> Any:
    lines = iter(path.read_text().splitlines())
    for line in lines:
        header = _HEADER.match(line)
        if header and header[1] == name:
            rows, columns = int(header[2]), int(header[3])
            return np.array(_numbers(line[header.end() :], lines, rows * columns, path)).reshape(rows, columns)
    return None


def _numbers(rest: str, lines: Iterator[str], count: int, path: Path) -> list[float]:
    found: list[float] = []
    line: str | None = rest
    while line is not None and len(found) < count:
        found += [float(item) for item in re.split(r"[\s,;]+", line.partition("#")[0].strip()) if item]
        line = next(lines, None)
    if len(found) != count:
        raise ModelError(f"a table of the file {path} has {len(found)} numbers instead of {count}.")
    return found
