"""The flat model of a Modelica model."""

import dataclasses
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, get_args

from .._errors import ModelicaError
from . import equations, functions, loops, marks, outer_values, patches, stored
from .failures import crash, failure, syntax_error
from .local_names import check_local_names
from .part_checks import check_parts
from .partial import refuse_partial
from .request import NAME, WRAPPER, Request, check_modifiers, requested
from .selections import selecting
from .session import Crashed, Refused, flat, rumoca
from .sources import Sources, number, used
from .text_checks import check_texts
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
        try:
            found = json.dumps(_flat(request))
        except Crashed as error:
            raise crash(error, request) from None
        stored.write(key, found)
    hides, content = json.loads(found)
    return content, _sources(request, hides, content)


def _flat(request: Request) -> tuple[equations.Hidden, dict[str, Any]]:
    """What was hidden, and the flat model with it.

    As little as possible is hidden from the front end: its last pass does not check the types of what is hidden, and
    needs some of it. Only if it refuses the model, or a loop does not match its template, algorithms are hidden, then
    equations, then connections of signals.
    """
    if error := syntax_error(request):
        raise error
    refuse_partial(request)
    hides, content = _accepted(request)
    check_modifiers(request, content["variables"])
    check_texts(_sources(request, hides, content), request.modifiers)
    values = outer_values.OuterValues()
    content = equations.restored(functions.restored(content))
    while values.differ(content, _sources(request, hides, content)):
        hides, content = _accepted(dataclasses.replace(request, values=values.text))
        content = equations.restored(functions.restored(content))
    sources = _sources(request, hides, content)
    check_parts(content, sources)
    check_local_names(content, sources)
    return hides, marks.unmarked(content | {"selecting": selecting(content)})


def _accepted(request: Request) -> tuple[equations.Hidden, dict[str, Any]]:
    """The flat model that the front end accepts first."""
    *first, last = get_args(equations.Hidden)
    for hides in first:
        try:
            return hides, _loaded(request, hides)
        except loops.TemplateError:
            continue
        except Refused as error:
            if not str(error).startswith("todae"):
                raise _failure(error, request, hides) from None
    try:
        return last, _loaded(request, last)
    except Refused as error:
        raise _failure(error, request, last) from None


def _text(request: Request, hides: equations.Hidden) -> str:
    text = patches.restated(request.text)
    return patches.marked(functions.hidden(text, functions.ALL, "own") if hides else text, NAME, hides)


def _loaded(request: Request, hides: equations.Hidden) -> dict[str, Any]:
    text = request.whole(_text(request, hides))
    return loops.expanded(flat(view(request.roots, hides), text, WRAPPER, NAME))


def _failure(error: Exception, request: Request, hides: equations.Hidden) -> ModelicaError:
    """The error in our words, with the user's names of files instead of those in the view."""
    message, folder = str(error), view(request.roots, hides)
    for name, library in libraries(request.roots).items():
        message = message.replace(str(folder / name), str(library))
    return failure(message, request)


def _sources(request: Request, hides: equations.Hidden, content: dict[str, Any]) -> Sources:
    """The texts of the spans: those in the view, under the user's names."""
    wanted, folder = used(content), view(request.roots, hides)
    texts = {number(NAME): (str(request.file or NAME), _text(request, hides))}
    for name, library in libraries(request.roots).items():
        for file in modelica_files(library):
            seen = folder / name / file.relative_to(library)
            if (source := number(str(seen))) in wanted:
                texts[source] = (str(file), seen.read_text("utf-8-sig"))
    return Sources(texts)
