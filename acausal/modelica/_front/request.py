"""What the user gives: a text or a file, the name of a model, and folders with libraries."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from ..._errors import suggestion
from .._errors import ModelicaError
from .comprehensions import nested
from .redeclared import written_out

NAME = "<model>.mo"  # of the text in messages and spans; no file can have it
WRAPPER = "AcausalModel"
_WITHIN = re.compile(r"\A(?:\s|//[^\n]*|/\*.*?\*/)*within\s+[\w.]+\s*;", re.S)
_CLASS = re.compile(r"^\s*(?:\w+\s+)*?(?:model|block|class|package)\s+(\w+)", re.M)


@dataclass(frozen=True)
class Request:
    """The text, the file that holds it, the name of the model, its modifiers, and the roots of libraries.

    `values` are further modifiers, for parameters whose values the front end would get wrong.
    """

    text: str
    file: Path | None
    model: str
    modifiers: str
    roots: tuple[Path, ...]
    values: str = ""

    def whole(self, text: str) -> str:
        """A text with the model that is compiled. It is partial, so that the front end does not count equations."""
        if not self.values:
            return f"{text}\n{_partial_model(WRAPPER, self.model + self.modifiers)}"
        modified = _partial_model(f"{WRAPPER}Modified", self.model + self.modifiers)
        return f"{text}\n{modified}{_partial_model(WRAPPER, f'{WRAPPER}Modified{self.values}')}"


def requested(source: str | Path, model: str, roots: Sequence[str | Path]) -> Request:
    """Reads the source: a text, a file, or the folder of a package. Raises `ModelicaError` if a file is missing."""
    name, bracket, rest = model.partition("(")
    name, modifiers = name.strip(), nested(bracket + rest)
    folders = [_existing(Path(root), "root") for root in roots]
    file = _file(source)
    if file is None:
        return Request(str(source), None, name, modifiers, tuple(folders))
    if file.is_dir() or file.name == "package.mo":
        return Request("", None, name, modifiers, (*folders, file if file.is_dir() else file.parent))
    text = file.read_text("utf-8-sig")
    if _WITHIN.match(text):
        return Request("", None, name, modifiers, (*folders, _package(file)))
    return Request(text, file, name, modifiers, tuple(folders))


def _partial_model(name: str, base: str) -> str:
    return written_out(f"partial model {name}\n extends {base};\nend {name};\n")


def _class_names(text: str) -> list[str]:
    """The names of classes that a text declares, as far as a line begins with them."""
    return _CLASS.findall(text)


def unknown(request: Request) -> ModelicaError:
    """The error for a model that neither the text nor a library has."""
    where = request.file or ("the text" if request.text else "the roots")
    known = _class_names(request.text)
    remedy = suggestion(request.model, known) or " Give its full name, and the folder of its library by roots=[...]."
    return ModelicaError(f"There is no model {request.model} in {where}.{remedy}")


def check_modifiers(request: Request, names: Iterable[str]) -> None:
    """Raises `ModelicaError` for a modifier that names none of these variables: the front end ignores it."""
    known = {re.split(r"[.\[]", name)[0] for name in names}
    text = request.modifiers[1:-1]
    while (plain := re.sub(r"\([^()]*\)|\[[^\[\]]*\]|\{[^{}]*\}", "", text)) != text:
        text = plain
    for modifier in filter(None, text.split(",")):
        name = modifier.partition("=")[0].split()[-1]
        if "redeclare" not in modifier and name not in known:
            raise ModelicaError(f"{request.model} has no {name} to modify.{suggestion(name, known)}")


def _file(source: str | Path) -> Path | None:
    """The file or folder that a source names; None for a text."""
    if isinstance(source, Path) or source.rstrip().endswith(".mo"):
        return _existing(Path(source), "file")
    return None


def _existing(path: Path, what: str) -> Path:
    if not path.exists():
        raise ModelicaError(f"The {what} {path} does not exist.")
    return path.absolute()


def _package(file: Path) -> Path:
    """The folder of the outermost package that a file belongs to."""
    folder = file.parent
    while (folder.parent / "package.mo").exists():
        folder = folder.parent
    return folder
