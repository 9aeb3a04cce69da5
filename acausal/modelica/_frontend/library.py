"""Packages in files (Modelica 3.6, chapter 13), parsed when a name in them is needed."""

import functools as ft
import hashlib
import pickle
import re
from collections.abc import Iterator, Sequence
from pathlib import Path

from ... import _program_files as files
from ..._jax_settings import programs
from .._errors import ModelicaError
from . import tree as t
from .parse import parse
from .source import Source

_OWN = hashlib.sha256(
    b"".join(Path(__file__).with_name(f"{name}.py").read_bytes() for name in ("tree", "lexical", "parse"))
    + b"".join(Path(__file__).with_name(f"parse_{name}.py").read_bytes() for name in ("clauses", "expressions"))
).digest()
_CACHED_LENGTH = 5_000  # shorter texts are parsed faster than their trees are read


class Definition:
    """A class definition in its text, and the folder with further classes of a package, if it has one."""

    def __init__(self, tree: t.Class, source: Source, folder: Path | None = None) -> None:
        self.tree = tree
        self.source = source
        self.folder = folder

    def stored(self) -> dict[str, Path]:
        """The files and folders of the classes in the folder of the package, by name."""
        return {} if self.folder is None else _entries(self.folder)

    def load(self, name: str) -> "Definition | None":
        """A class from the folder of the package."""
        path = self.stored().get(name)
        return None if path is None else _load(path, name)


class Libraries:
    """The top classes: those of a text, and the libraries in some folders. Raises `ModelicaError`."""

    def __init__(self, texts: Sequence[Source], roots: Sequence[Path]) -> None:
        self._found: dict[str, Definition | None] = {}
        for source in texts:
            for tree in parse(source).classes:
                if tree.name in self._found:
                    raise source.error(tree.at, f"there are two classes {tree.name}.")
                self._found[tree.name] = Definition(tree, source)
        self.roots = tuple(roots)

    def names(self) -> list[str]:
        """The names of the top classes."""
        return [
            *(name for name, found in self._found.items() if found),
            *(name for root in self.roots for name in _libraries(root)),
        ]

    def find(self, name: str) -> Definition | None:
        """A top class. Raises `ModelicaError` if several libraries have its name."""
        if name not in self._found:
            places = [path for root in self.roots if (path := _libraries(root).get(name)) is not None]
            places = list(dict.fromkeys(place.resolve() for place in places))
            if len(places) > 1:
                raise ModelicaError(f"There are two libraries {name}: {places[0]} and {places[1]}.")
            self._found[name] = _load(places[0], name) if places else None
        return self._found[name]

    def missing(self, name: str, users: Iterator[Definition]) -> str:
        """What is known of a missing library: the version that a library wants which uses it."""
        for user in users:
            version = _uses(user.tree.annotation).get(name)
            if version is not None:
                library = f"{name} {version}".strip()
                return f" {user.tree.name} uses {library}. Give the folder with this library by roots=[...]."
        return ""


def _uses(annotation: t.Modification | None) -> dict[str, str]:
    """The versions in the annotation `uses(Library(version="1.0"))`."""
    found: dict[str, str] = {}
    for used in _arguments(annotation, "uses"):
        for library in used.modification.arguments:
            if isinstance(library, t.ElementModification):
                versions = [one.modification.value for one in _arguments(library.modification, "version")]
                stated = versions[0] if versions else None
                found[library.name[0]] = str(stated.value) if isinstance(stated, t.Literal) else ""
    return found


def _arguments(modification: t.Modification | None, name: str) -> list[t.ElementModification]:
    return [
        one
        for one in (modification.arguments if modification else ())
        if isinstance(one, t.ElementModification) and one.name == (name,)
    ]


def _libraries(root: Path) -> dict[str, Path]:
    """The libraries in a folder, which may be one itself, by name."""
    if root.is_file() or (root / "package.mo").exists():
        return {_without_version(root): root}
    return {_without_version(entry): entry for entry in sorted(root.iterdir()) if _is_stored(entry)}


def _without_version(path: Path) -> str:
    """The name of a library in `Modelica 4.1.0` or `Complex 4.1.0.mo`."""
    return re.split(r" \d", path.name.removesuffix(".mo") if path.is_file() else path.name, maxsplit=1)[0]


def _is_stored(entry: Path) -> bool:
    """Whether a file or folder can hold a class; others are passed over (Modelica 3.6, section 13.4)."""
    return (entry.suffix == ".mo" and entry.is_file()) or (entry / "package.mo").exists()


@ft.cache
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
