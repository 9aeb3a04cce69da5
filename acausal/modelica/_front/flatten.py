"""The flat model of a Modelica model."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from .._errors import ModelicaError
from . import equations, functions, stored
from .failures import failure, syntax_error
from .given import NAME, WRAPPER, Given, check_modifiers, given
from .session import rumoca, session
from .sources import Sources, number, used
from .view import libraries, modelica_files, view


def flat_model(source: str | Path, model: str, roots: Sequence[str | Path] = ()) -> tuple[dict[str, Any], Sources]:
    """The flat model that the front end makes of a text, a file or the folder of a package, and the files of its spans.

    `model` is the full name of a class, possibly with modifiers, as in "Plant.Pump(k=2)". `roots` are folders with
    libraries. The result is kept in the cache of the library. Raises `ModelicaError`.
    """
    what = given(source, model, roots)
    key = stored.key(what, rumoca().version())
    found = stored.read(key)
    if found is None:
        found = json.dumps(_flat(what))
        stored.write(key, found)
    hides, content = json.loads(found)
    return content, _sources(what, hides, content)


def _flat(what: Given) -> tuple[bool, dict[str, Any]]:
    """Whether the equations were hidden, and the flat model with what was hidden from the front end.

    Equations are hidden only if its last pass refuses the model with them: it does not check the types of hidden ones,
    and needs some of them.
    """
    if error := syntax_error(what):
        raise error
    try:
        hides, content = False, _loaded(what, False)
    except rumoca().RumocaError as error:
        if not str(error).startswith("todae"):
            raise _failure(error, what, False) from None
        try:
            hides, content = True, _loaded(what, True)
        except rumoca().RumocaError as error:
            raise _failure(error, what, True) from None
    check_modifiers(what, content["variables"])
    return hides, equations.shown(functions.shown(content))


def _text(what: Given, hides: bool) -> str:
    return equations.hidden(functions.hidden(what.text, functions.ALL, "own"), NAME) if hides else what.text


def _loaded(what: Given, hides: bool) -> dict[str, Any]:
    loaded = session(view(what.roots, hides)).loads(what.whole(_text(what, hides)), model=WRAPPER, filename=NAME)
    return loaded.to_dict("flat")


def _failure(error: Exception, what: Given, hides: bool) -> ModelicaError:
    """The error in our words, with the user's names of files instead of those in the view."""
    message, folder = str(error), view(what.roots, hides)
    for name, library in libraries(what.roots).items():
        message = message.replace(str(folder / name), str(library))
    return failure(message, what)


def _sources(what: Given, hides: bool, content: dict[str, Any]) -> Sources:
    """The texts of the spans: those in the view, under the user's names."""
    wanted, folder = used(content), view(what.roots, hides)
    texts = {number(NAME): (str(what.file or NAME), _text(what, hides))}
    for name, library in libraries(what.roots).items():
        for file in modelica_files(library):
            seen = folder / name / file.relative_to(library)
            if (source := number(str(seen))) in wanted:
                texts[source] = (str(file), seen.read_text("utf-8-sig"))
    return Sources(texts)
