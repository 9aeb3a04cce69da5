"""Packages in files (Modelica 3.6, chapter 13), parsed when a name in them is needed."""

import functools as ft
import hashlib
import pickle
import re
from collections.abc import Iterator, Sequence
from pathlib import Path

from ... import _program_files as files
from ..._errors import listed
from ..._jax_settings import programs
from .._errors import ModelicaError
from . import tree as t
from .parse import parse
from .source import Source

_OWN = hashlib.sha256(
    b"".join(Path(__file__).with_name(f"{name}.py").read_bytes() for name in ("tree", "lexical", "parse"))
    + b"".join(Path(__file__).with_name(f"parse_{name}.py").read_bytes() for name in ("clauses", "expressions"))
).digest()
NAME = "<model>.mo"  # of a text in messages
PREDEFINED = ("Real", "Integer", "Boolean", "String", "Clock", "ExternalObject", "StateSelect", "AssertionLevel")
_CACHED_LENGTH = 5_000  # shorter texts are parsed faster than their trees are read


def given(source: str | Path, roots: Sequence[str | Path]) -> tuple[list[Source], list[Path]]:
    """The texts and the folders of libraries that a user gives. Raises `ModelicaError` for a file that is missing."""
    folders = [_existing(Path(root), "root") for root in roots]
    if not (isinstance(source, Path) or source.rstrip().endswith(".mo")):
        return [Source(NAME, str(source))], folders
    file = _existing(Path(source), "file")
    if file.is_dir() or file.name == "package.mo":
        return [], [*folders, file if file.is_dir() else file.parent]
    tree, text = read(file)
    if not tree.within:
        return [text], folders
    folder = file.parent
    while (folder.parent / "package.mo").exists():
        folder = folder.parent
    return [], [*folders, folder]


def _existing(path: Path, what: str) -> Path:
    if not path.exists():
        raise ModelicaError(f"The {what} {path} does not exist.")
    return path.absolute()


class Definition:
    """A class definition in its text, and the folder with further classes of a package, if it has one."""

    def __init__(self, tree: t.Class, source: Source, folder: Path | None = None) -> None:
        self.tree = tree
        self.source = source
        self.folder = folder

    @ft.cached_property
    def stored(self) -> dict[str, Path]:
        """The files and folders of the classes in the folder of the package, by name."""
        return {} if self.folder is None else _entries(self.folder)

    def load(self, name: str) -> "Definition | None":
        """A class from the folder of the package."""
        path = self.stored.get(name)
        return None if path is None else _load(path, name)


class Libraries:
    """The top classes: those of a text, and the libraries in some folders. Raises `ModelicaError`."""

    def __init__(self, texts: Sequence[Source], roots: Sequence[Path]) -> None:
        self._found: dict[str, Definition | None] = {}
        for source in texts:
            for tree in parse(source).classes:
                if tree.name in PREDEFINED:
                    raise source.error(tree.at, f"{tree.name} is the name of a predefined class.")
                if tree.name in self._found:
                    raise source.error(tree.at, f"there are two classes {tree.name}.")
                self._found[tree.name] = Definition(tree, source)
        self.roots = tuple(roots)

    def names(self) -> list[str]:
        """The names of the top classes."""
        return [
            *(name for name, found in self._found.items() if found),
            *(_without_version(path) for root in self.roots for path in _libraries(root)),
        ]

    def find(self, name: str) -> Definition | None:
        """A top class. Raises `ModelicaError` if several libraries have its name."""
        if name not in self._found:
            stored = (path for root in self.roots for path in _libraries(root) if _without_version(path) == name)
            places = list(dict.fromkeys(path.resolve() for path in stored))
            if len(places) > 1:
                both = f"{places[0]} and {places[1]}"
                raise ModelicaError(f"There are two libraries {name}: {both}. Give one of them itself by roots=[...].")
            self._found[name] = _load(places[0], name) if places else None
        return self._found[name]

    def loaded(self) -> list[Definition]:
        """The top classes that have been looked up."""
        return [found for found in self._found.values() if found is not None]

    def resource(self, uri: str) -> str:
        """The file that a URI `modelica://Library.Package/path` names (section 13.5); the URI itself if none does."""
        name, slash, path = uri.removeprefix("modelica://").partition("/")
        first, *parts = name.split(".")
        found = self.find(first)
        while found is not None and found.folder is not None:
            if not parts or (inner := found.load(parts[0])) is None or inner.folder is None:
                return f"{found.folder}{slash}{path}"
            found, parts = inner, parts[1:]
        return uri

    def given(self) -> str:
        """The folders that are given, for a message."""
        return f"these are {listed([str(root) for root in self.roots])}" if self.roots else "none are given"


def library_files(folders: Sequence[Path]) -> Iterator[Path]:
    """The files of all libraries in some folders."""
    for folder in folders:
        for library in _libraries(folder):
            yield from [library] if library.is_file() else sorted(library.rglob("*.mo"))


def _libraries(root: Path) -> list[Path]:
    """The libraries in a folder, which may be one itself."""
    if root.is_file() or (root / "package.mo").exists():
        return [root]
    return [entry for entry in sorted(root.iterdir()) if _is_stored(entry)]


def _without_version(path: Path) -> str:
    """The name of a library in `Modelica 4.1.0` or `Complex 4.1.0.mo`."""
    return re.split(r" \d", path.name.removesuffix(".mo") if path.is_file() else path.name, maxsplit=1)[0]


def _is_stored(entry: Path) -> bool:
    """Whether a file or folder can hold a class; others are passed over (Modelica 3.6, section 13.4)."""
    return (entry.suffix == ".mo" and entry.is_file()) or (entry / "package.mo").exists()


def _entries(folder: Path) -> dict[str, Path]:
    found: dict[str, Path] = {}
    for entry in sorted(folder.iterdir()):
        if entry.name != "package.mo" and _is_stored(entry):
            name = entry.name.removesuffix(".mo") if entry.is_file() else entry.name
            if name in found:
                raise ModelicaError(f"The class {name} is stored twice: {found[name]} and {entry}.")
            found[name] = entry
    return found


def _load(path: Path, name: str) -> Definition:
    """The class in a file or in the folder of a package."""
    folder = path if path.is_dir() else None
    file = path / "package.mo" if folder else path
    tree, source = read(file)
    for found in tree.classes:
        if found.name == name:
            return Definition(found, source, folder)
    raise ModelicaError(f"{file}: the file must define {name}, after which it is named.")


def read(file: Path) -> tuple[t.File, Source]:
    """The tree of a file, and its text."""
    return _read(file, file.stat().st_mtime_ns)


@ft.lru_cache(maxsize=4096)
def _read(file: Path, time: int) -> tuple[t.File, Source]:
    del time
    try:
        text = file.read_text("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ModelicaError(f"{file}: the file is not in UTF-8: {error}.") from error
    source = Source(str(file), text)
    if programs.folder is None or len(text) < _CACHED_LENGTH:
        return parse(source), source
    digest = hashlib.sha256(_OWN + text.encode()).hexdigest()[:32]
    stored = programs.folder / f"modelica-tree-{digest}-program"
    content = files.read(stored)
    if content is not None:
        return pickle.loads(content), source
    tree = parse(source)
    files.write(stored, pickle.dumps(tree, pickle.HIGHEST_PROTOCOL))
    return tree, source
