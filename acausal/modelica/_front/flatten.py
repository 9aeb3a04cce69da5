"""The flat model of a Modelica model."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from . import stored
from .failures import failure, syntax_error
from .given import NAME, WRAPPER, Given, check_modifiers, given
from .hide import shown
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
    content = json.loads(found)
    return content, _sources(what, content)


def _flat(what: Given) -> dict[str, Any]:
    """The flat model as the front end gives it, with the bodies that were hidden from it."""
    front = rumoca()
    if error := syntax_error(what):
        raise error
    folder = view(what.roots)
    try:
        loaded = session(folder).loads(what.whole, model=WRAPPER, filename=NAME)
    except front.RumocaError as error:
        raise failure(_with_own_names(str(error), what, folder), what) from None
    content = loaded.to_dict("flat")
    check_modifiers(what, content["variables"])
    return shown(content)


def _with_own_names(message: str, what: Given, folder: Path) -> str:
    """A message with the user's names of files instead of those in the view."""
    for name, library in libraries(what.roots).items():
        message = message.replace(str(folder / name), str(library))
    return message


def _sources(what: Given, content: dict[str, Any]) -> Sources:
    """The texts of the spans: those in the view, under the user's names."""
    wanted, folder = used(content), view(what.roots)
    texts = {number(NAME): (str(what.file or NAME), what.whole)}
    for name, library in libraries(what.roots).items():
        for file in modelica_files(library):
            seen = folder / name / file.relative_to(library)
            if (source := number(str(seen))) in wanted:
                texts[source] = (str(file), seen.read_text("utf-8-sig"))
    return Sources(texts)
