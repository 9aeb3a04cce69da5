"""Models that the text declares partial. The flat model does not show it: the compiled wrapper is always partial."""

from collections.abc import Sequence
from pathlib import Path

from .._errors import ModelicaError
from .request import Request
from .scan import declared_partial
from .view import libraries


def refuse_partial(request: Request) -> None:
    """Raises `ModelicaError` for a partial model."""
    path = request.model.split(".")
    if any(declared_partial(text, inner) for text, inner in _declarations(request, path)):
        raise ModelicaError(
            f"{request.model} is partial: models that extend it add its missing equations. Load one of these."
        )


def _declarations(request: Request, path: Sequence[str]) -> list[tuple[str, Sequence[str]]]:
    """Texts that may declare the model, each with the path of the model in it."""
    found = [(request.text, path)]
    for name, place in libraries(request.roots).items():
        if name.removesuffix(".mo").partition(" ")[0] == path[0]:
            file, depth = _file(place, path)
            found.append((file.read_text("utf-8-sig"), path[depth:]))
    return found


def _file(place: Path, path: Sequence[str]) -> tuple[Path, int]:
    """The file of a library that declares a class, and the number of packages around the file."""
    for depth, name in enumerate(path[1:]):
        if place.is_file():
            return place, depth
        inner, single = place / name, place / f"{name}.mo"
        if not inner.is_dir() and not single.exists():
            return place / "package.mo", depth
        place = inner if inner.is_dir() else single
    return (place if place.is_file() else place / "package.mo"), len(path) - 1
