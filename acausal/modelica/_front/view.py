"""A view of the user's libraries: one folder of symbolic links, in which only the files with patches are copies."""

import contextlib
import hashlib
import os
import tempfile
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path

from ..._jax_settings import programs
from .._errors import ModelicaError
from .patches import patched


def view(roots: Sequence[Path]) -> Path:
    """The folder of the view, made or brought up to date."""
    digest = hashlib.sha256("\n".join(map(str, roots)).encode()).hexdigest()[:16]
    folder = _home() / digest
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    shown = libraries(roots)
    for entry in folder.iterdir():
        if entry.name not in shown:
            _remove(entry)
    for name, library in shown.items():
        _mirror(library, folder / name, patched(library))
    return folder


def _home() -> Path:
    """The folder of all views: in the library's cache, or for this process alone if there is no cache."""
    return Path(_temporary().name) if programs.folder is None else programs.folder / "modelica"


@cache
def _temporary() -> "tempfile.TemporaryDirectory[str]":
    return tempfile.TemporaryDirectory(prefix="acausal-modelica-")


def libraries(roots: Sequence[Path]) -> dict[str, Path]:
    """The libraries in the roots, by the names of their folders or files. Raises `ModelicaError` for two of a name."""
    found: dict[str, Path] = {}
    for library in (library for root in roots for library in _in(root)):
        if found.setdefault(library.name, library) != library:
            raise ModelicaError(f"There are two libraries {library.name}: {found[library.name]} and {library}.")
    return found


def _in(root: Path) -> list[Path]:
    """The libraries in a root, which may be one itself."""
    if root.is_file() or (root / "package.mo").exists():
        return [root]
    return [entry for entry in sorted(root.iterdir()) if entry.suffix == ".mo" or (entry / "package.mo").exists()]


def modelica_files(path: Path) -> list[Path]:
    """The Modelica files of a library."""
    return [path] if path.is_file() else sorted(path.rglob("*.mo"))


def _mirror(original: Path, mirror: Path, copies: Mapping[Path, str]) -> None:
    """Make `mirror` show `original`, with other texts for some files, whose paths are relative to `original`."""
    if Path() in copies:
        _write(mirror, copies[Path()])
    elif not copies:
        _link(original, mirror)
    else:
        if mirror.is_symlink():
            mirror.unlink()
        mirror.mkdir(exist_ok=True)
        entries = {entry.name for entry in original.iterdir()}
        for gone in [entry for entry in mirror.iterdir() if entry.name not in entries]:
            _remove(gone)
        for name in entries:
            below = {file.relative_to(name): text for file, text in copies.items() if file.parts[0] == name}
            _mirror(original / name, mirror / name, below)


def _link(original: Path, mirror: Path) -> None:
    if mirror.is_symlink() and mirror.readlink() == original:
        return
    _remove(mirror)
    with contextlib.suppress(FileExistsError):  # another process has made it
        mirror.symlink_to(original, target_is_directory=original.is_dir())


def _write(file: Path, text: str) -> None:
    """Write a copy atomically, if it differs."""
    if file.is_file() and not file.is_symlink() and file.read_text("utf-8") == text:
        return
    _remove(file)
    handle, part = tempfile.mkstemp(dir=file.parent)
    with os.fdopen(handle, "w", encoding="utf-8", newline="") as stream:
        stream.write(text)
    Path(part).replace(file)


def _remove(path: Path) -> None:
    """Remove a link, a copy, or a folder of these; never what a link names."""
    if path.is_dir() and not path.is_symlink():
        for entry in path.iterdir():
            _remove(entry)
        path.rmdir()
    else:
        path.unlink(missing_ok=True)
