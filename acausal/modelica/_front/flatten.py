"""The flat model of a Modelica model."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from .._errors import ModelicaError
from . import equations, functions, stored
from .failures import failure, syntax_error
from .request import NAME, WRAPPER, Request, check_modifiers, requested
from .session import rumoca, session
from .sources import Sources, number, used
from .view import libraries, modelica_files, view


def flat_model(source: str | Path, model: str, roots: Sequence[str | Path] = ()) -> tuple[dict[str, Any], Sources]:
    """The flat model that the front end makes of a text, a file or the folder of a package, and the files of its spans.

    `model` is the full name of a class, possibly with modifiers, as in "Plant.Pump(k=2)". `roots` are folders with
    libraries. The result is kept in the cache of the library. Raises `ModelicaError`.
    """
    request = requested(source, model, roots)
    key = stored.key(request, rumoca().version())
    found = stored.read(key)
    if found is None:
        found = json.dumps(_flat(request))
        stored.write(key, found)
    hides_equations, content = json.loads(found)
    return content, _sources(request, hides_equations, content)


def _flat(request: Request) -> tuple[bool, dict[str, Any]]:
    """Whether the equations were hidden, and the flat model with what was hidden from the front end.

    Equations are hidden only if its last pass refuses the model with them: it does not check the types of hidden ones,
    and needs some of them.
    """
    if error := syntax_error(request):
        raise error
    try:
        hides_equations, content = False, _loaded(request, False)
    except rumoca().RumocaError as error:
        if not str(error).startswith("todae"):
            raise _failure(error, request, False) from None
        try:
            hides_equations, content = True, _loaded(request, True)
        except rumoca().RumocaError as error:
            raise _failure(error, request, True) from None
    check_modifiers(request, content["variables"])
    return hides_equations, equations.shown(functions.shown(content))


def _text(request: Request, hides_equations: bool) -> str:
    if not hides_equations:
        return request.text
    return equations.hidden(functions.hidden(request.text, functions.ALL, "own"), NAME)


def _loaded(request: Request, hides_equations: bool) -> dict[str, Any]:
    text = request.whole(_text(request, hides_equations))
    loaded = session(view(request.roots, hides_equations)).loads(text, model=WRAPPER, filename=NAME)
    return loaded.to_dict("flat")


def _failure(error: Exception, request: Request, hides_equations: bool) -> ModelicaError:
    """The error in our words, with the user's names of files instead of those in the view."""
    message, folder = str(error), view(request.roots, hides_equations)
    for name, library in libraries(request.roots).items():
        message = message.replace(str(folder / name), str(library))
    return failure(message, request)


def _sources(request: Request, hides_equations: bool, content: dict[str, Any]) -> Sources:
    """The texts of the spans: those in the view, under the user's names."""
    wanted, folder = used(content), view(request.roots, hides_equations)
    texts = {number(NAME): (str(request.file or NAME), _text(request, hides_equations))}
    for name, library in libraries(request.roots).items():
        for file in modelica_files(library):
            seen = folder / name / file.relative_to(library)
            if (source := number(str(seen))) in wanted:
                texts[source] = (str(file), seen.read_text("utf-8-sig"))
    return Sources(texts)
