"""Flat models kept in the cache of the library, because the front end takes seconds for a large library."""

import hashlib
import zlib
from collections.abc import Iterator
from pathlib import Path

from ... import _program_files as files
from ..._jax_settings import programs
from .request import Request
from .view import OWN, libraries, modelica_files


def key(request: Request, version: str) -> str:
    """A digest of everything that determines the flat model: texts by their content, or by size and time if many."""
    digest = hashlib.sha256()
    for part in (version, str(request.file), request.whole(request.text), OWN, *_stamps(request.roots)):
        digest.update(b"%d " % len(part.encode()) + part.encode())
    return digest.hexdigest()[:32]


def read(key: str) -> str | None:
    """The flat model as JSON; None if it is not in the cache."""
    if programs.folder is None:
        return None
    content = files.read(_file(programs.folder, key))
    return None if content is None else zlib.decompress(content).decode()


def write(key: str, flat: str) -> None:
    """Keep a flat model if there is a cache. It counts among the programs, of which the oldest are forgotten."""
    if programs.folder is not None:
        files.write(_file(programs.folder, key), zlib.compress(flat.encode(), 1))


def _file(folder: Path, key: str) -> Path:
    return folder / f"modelica-{key}-program"


def _stamps(roots: tuple[Path, ...]) -> Iterator[str]:
    """Names, sizes and times of all Modelica files."""
    for library in libraries(roots).values():
        for file in modelica_files(library):
            status = file.stat()
            yield f"{file} {status.st_size} {status.st_mtime_ns}"
