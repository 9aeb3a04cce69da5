"""The flat model of a Modelica model."""

import json
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from . import equations, functions, stored
from .failures import failure, syntax_error
from .given import NAME, WRAPPER, Given, check_modifiers, given
from .session import rumoca, session
from .sources import Sources, number, used
from .view import libraries, modelica_files, view

_CLOCKS = re.compile(r"\bclock(?:ed)?\s|`Clock`")


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
    text, hides_equations, content = json.loads(found)
    return content, _sources(what, text, view(what.roots, hides_equations=hides_equations), content)


def _flat(what: Given) -> tuple[str, bool, dict[str, Any]]:
    """The text that the front end got, whether equations of libraries are hidden, and the flat model that it gave, with
    what was hidden from it.

    The equations of the text are only hidden if its last pass refuses them, because it does not check the types of
    hidden ones. If the model has clocks, nothing is hidden, because that pass infers them from all equations.
    """
    if error := syntax_error(what):
        raise error
    folder = view(what.roots)
    text, has_clocks = what.text, False
    try:
        content = _loaded(folder, what.whole(text))
    except rumoca().RumocaError as error:
        if not str(error).startswith("todae"):
            raise failure(_with_own_names(str(error), what, folder), what) from None
        if has_clocks := bool(_CLOCKS.search(str(error))):
            folder = view(what.roots, hides_equations=False)
        else:
            text = equations.hidden(text, NAME)
        try:
            content = _loaded(folder, what.whole(text))
        except rumoca().RumocaError as error:
            raise failure(_with_own_names(str(error), what, folder), what) from None
    check_modifiers(what, content["variables"])
    return text, not has_clocks, equations.shown(functions.shown(content))


def _loaded(folder: Path, text: str) -> dict[str, Any]:
    return session(folder).loads(text, model=WRAPPER, filename=NAME).to_dict("flat")


def _with_own_names(message: str, what: Given, folder: Path) -> str:
    """A message with the user's names of files instead of those in the view."""
    for name, library in libraries(what.roots).items():
        message = message.replace(str(folder / name), str(library))
    return message


def _sources(what: Given, text: str, folder: Path, content: dict[str, Any]) -> Sources:
    """The texts of the spans: those in the view, under the user's names."""
    wanted = used(content)
    texts = {number(NAME): (str(what.file or NAME), text)}
    for name, library in libraries(what.roots).items():
        for file in modelica_files(library):
            seen = folder / name / file.relative_to(library)
            if (source := number(str(seen))) in wanted:
                texts[source] = (str(file), seen.read_text("utf-8-sig"))
    return Sources(texts)
