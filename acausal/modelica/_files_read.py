"""The data files that are read while a model is flattened, on which its flat model depends."""

import contextlib
from collections.abc import Iterator
from contextvars import ContextVar
from pathlib import Path

_read: ContextVar[dict[Path, str] | None] = ContextVar("read", default=None)


def stamp(file: Path) -> str:
    """The path of a file, with its size and time."""
    try:
        status = file.stat()
    except OSError:
        return f"{file} missing"
    return f"{file} {status.st_size} {status.st_mtime_ns}"


def reads(file: Path) -> None:
    """A file is read now."""
    found = _read.get()
    if found is not None:
        found[file.absolute()] = stamp(file.absolute())


@contextlib.contextmanager
def noted() -> Iterator[dict[Path, str]]:
    """The files that are read within, with their stamps."""
    found: dict[Path, str] = {}
    token = _read.set(found)
    try:
        yield found
    finally:
        _read.reset(token)
