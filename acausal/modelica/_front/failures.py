"""Errors of the front end in our words, with the place in the text."""

import re
from pathlib import Path

from ..._errors import listed
from .._errors import ModelicaError
from .request import NAME, WRAPPER, Request, unknown
from .scan import masked
from .session import Crashed, errors
from .view import libraries

_BOX = re.compile(r"× (?P<what>[^\n]*)\n\s*╭─\[[^\n]*?:(?P<line>\d+):(?P<column>\d+)\]")
_MISSING = re.compile(r"unresolved (?P<kind>type reference|extends base class|component reference): '(?P<name>[^']+)'")
_NO_STATE = re.compile(r"reinit\(\) can only be applied to state variables: (?P<name>\S+) is not a state")
_PLACED = re.compile(r"(?P<what>.*?) \[(?P<file>[^\[\]]*?):(?P<line>\d+):(?P<column>\d+)\]")


def syntax_error(request: Request) -> ModelicaError | None:
    """The error for a text that is not Modelica; None if it is."""
    found = errors(request.text, NAME)
    if not found:
        return None
    first = _BOX.search(found[0])
    if first is None:
        return ModelicaError(f"{request.file or NAME}: {found[0]}")
    return ModelicaError(f"{request.file or NAME}, line {first['line']}, column {first['column']}: {first['what']}.")


def crash(error: Crashed, request: Request) -> ModelicaError:
    """The error for a model that ends the process of the front end."""
    return ModelicaError(
        f"{_file_of(request)}: the process of the front end ended while it read {request.model} ({error}). Remedy: "
        "load parts of the model to find the one that it cannot read, and write that one differently."
    )


def _file_of(request: Request) -> Path | str:
    """The file of the model, or the folder in which it must be."""
    if request.file or request.text:
        return request.file or NAME
    first, *parts = request.model.split(".")
    for name, library in libraries(request.roots).items():
        if re.split(r"[ .]", name)[0] == first:
            for part in parts:
                if (library / f"{part}.mo").exists():
                    return library / f"{part}.mo"
                if not (library / part).is_dir():
                    break
                library /= part
            return library
    return listed([str(root) for root in request.roots])


def failure(message: str, request: Request) -> ModelicaError:
    """The error for a model that the front end refuses."""
    if missing := _MISSING.search(message):
        return _missing(missing["kind"], missing["name"], request)
    if found := _NO_STATE.search(message):
        return _no_state(found["name"], request)
    if placed := _PLACED.search(message):
        what = placed["what"].partition("failed in ")[2].partition(": ")[2] or placed["what"]
        file = placed["file"].replace(NAME, str(request.file or NAME))
        return ModelicaError(f"{file}, line {placed['line']}, column {placed['column']}: {what.strip()}.")
    plain = message.partition("\nRelated failures")[0].replace(WRAPPER, request.model)
    return ModelicaError(f"The front end refuses {request.model}: {plain.strip().rstrip('.')}.")


def _missing(kind: str, name: str, request: Request) -> ModelicaError:
    if name == request.model:
        return unknown(request)
    line = _line(name, request.text)
    place = f"{request.file or NAME}, line {line}: " if line else ""
    if kind == "component reference":
        return ModelicaError(f"{place}there is no variable {name}.")
    library = name.partition(".")[0]
    roots = f"these are {listed([str(root) for root in request.roots])}" if request.roots else "none are given"
    return ModelicaError(
        f"{place}there is no class {name}. Give the folder that holds the library {library} by roots=[...]; {roots}."
    )


def _no_state(name: str, request: Request) -> ModelicaError:
    """The error for a variable that `reinit` cannot set, with the state that it equals, if an equation says so."""
    said = f"{name} is not a state, so reinit cannot set it"
    own = re.escape(name.rpartition(".")[2])
    plain = masked(request.text)
    state = r"(?P<sign>-?)\s*(?P<state>[a-zA-Z_][\w.]*)"
    alias = re.search(rf"(?<![\w.]){own}\s*=\s*{state}\s*;", plain) or re.search(rf";\s*{state}\s*=\s*{own}\s*;", plain)
    if alias is None:
        return ModelicaError(f"{request.model}: {said}. Set a variable whose derivative occurs in the equations.")
    path = name.rpartition(".")[0]
    other = ".".join(filter(None, [path, alias["state"]]))
    line = plain.count("\n", 0, alias.start("state")) + 1
    return ModelicaError(
        f"{request.file or NAME}, line {line}: {said}. It equals {alias['sign']}{other}: set that, as in "
        f"reinit({alias['state']}, {alias['sign'] or ''}...)."
    )


def _line(name: str, text: str) -> int | None:
    """The first line of a text with this name."""
    found = re.search(rf"(?<![\w.]){re.escape(name)}(?!\w)", text)
    return text.count("\n", 0, found.start()) + 1 if found else None
