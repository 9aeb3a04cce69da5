"""A view of the user's libraries: a folder with copies of the Modelica files, written as the front end needs them, and
with symbolic links to other files.
"""

import contextlib
import hashlib
import os
import tempfile
from collections.abc import Sequence
from functools import cache
from pathlib import Path

from ..._jax_settings import programs
from .._errors import ModelicaError
from .equations import Hidden
from .patches import changed

OWN = hashlib.sha256(b"".join(file.read_bytes() for file in sorted(Path(__file__).parent.glob("*.py")))).hexdigest()


def view(roots: Sequence[Path], hides: Hidden) -> Path:
    """The folder of the view, made or brought up to date. `hides` says what is hidden in it."""
    digest = hashlib.sha256("\n".join([OWN, hides, *map(str, roots)]).encode()).hexdigest()[:16]
    folder = _home() / digest
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    shown = libraries(roots)
    _remove_others(folder, set(shown))
    for name, library in shown.items():
        _mirror(library, folder / name, Path(name.partition(" ")[0]), hides)
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


def _mirror(original: Path, mirror: Path, name: Path, hides: Hidden) -> None:
    """Make `mirror` show `original`. `name` is its path from the folder of its library, which it begins with."""
    if original.is_dir() and any(original.glob("*.mo")):
        mirror.mkdir(mode=0o700, exist_ok=True)
        entries = list(original.iterdir())
        _remove_others(mirror, {entry.name for entry in entries})
        for entry in entries:
            _mirror(entry, mirror / entry.name, name / entry.name, hides)
    elif original.suffix == ".mo":
        _copy(original, mirror, name, hides)
    elif not mirror.is_symlink():
        with contextlib.suppress(FileExistsError):  # another process has made it
            mirror.symlink_to(original, target_is_directory=original.is_dir())


def _copy(original: Path, copy: Path, name: Path, hides: Hidden) -> None:
    """Write a changed copy atomically, with the time of the original, if there is none of this time."""
    time = original.stat().st_mtime_ns
    if copy.exists() and copy.stat().st_mtime_ns == time:
        return
    handle, part = tempfile.mkstemp(dir=_home())  # other processes tidy the view
    with os.fdopen(handle, "w", encoding="utf-8", newline="") as stream:
        stream.write(changed(original.read_text("utf-8-sig"), name, hides))
    os.utime(part, ns=(time, time))
    Path(part).replace(copy)


def _remove_others(folder: Path, names: set[str]) -> None:
    """Remove what has gone from the original; of links, never what they name."""
    for entry in folder.iterdir():
        if entry.name not in names:
            _remove(entry)


def _remove(path: Path) -> None:
    if path.is_dir() and not path.is_symlink():
        _remove_others(path, set())
        path.rmdir()
    else:
        path.unlink(missing_ok=True)
