"""Values that the front end ignores: those of outer components, and those that read arrays.

rumoca selects the branch of an `if` with equations, the range of a loop, the size of an array and the presence of a
component by the values of parameters. In place of the inner component, it reads the values that the class of the outer
component declares. Where the inner component has other values, modifiers give these to the outer component, and give
the parameters that read them their own values. The flat model keeps its bindings. Conditions and ranges that read an
outer component directly do not obey the modifiers, and are refused (`outer_readers.py`).

If a modifier binds an integer parameter to an element of an array, as in `part(n = ns[2])`, the front end reads the
value that its class declares. Such a parameter gets its value by a modifier, too.
"""

import re
from collections.abc import Iterator
from typing import Any

from .._errors import ModelicaError
from .modifiers import ValueTexts, written
from .outer_marks import outer_components
from .outer_readers import OuterParameter, check_direct, is_in, misread, readers
from .scan import masked
from .selections import references
from .sources import Sources

_Tree = dict[str, Any]
_STATED = ("binding", "start", "binding_from_modification")


class OuterValues:
    """The modifiers that a model needs, found from its flat model.

    They may bring further components into the flat model, which need modifiers, too.
    """

    def __init__(self) -> None:
        self.text = ""
        self._tried: set[str] = set()
        self._functions: _Tree = {}
        self._stated: dict[str, _Tree] = {}  # what the model itself states of the parameters that get their values

    def differ(self, content: _Tree, sources: Sources) -> bool:
        """Restores the bindings in a flat model, and tells whether it needs other modifiers than it was made with.

        Raises `ModelicaError` if no modifier gives a value.
        """
        variables = content["variables"]
        self._functions |= content["functions"]
        content["functions"] = self._functions  # those that the bindings call
        for name in self._stated.keys() & variables.keys():
            variables[name] |= self._stated[name]
        differing = list(_differing(content, sources))
        check_direct(content, differing, sources)
        reading = readers(content, {one.inner for one in differing}, sources) | misread(content)
        for name in reading:
            self._stated.setdefault(name, {part: variables[name][part] for part in _STATED})
        before, self.text = self.text, self._written(content, differing)
        if self.text in self._tried and self.text != before:
            raise ModelicaError(
                "The values of outer components depend on which components are present. Remedy: declare these "
                "components without a condition that reads an outer component."
            )
        self._tried.add(self.text)
        return self.text != before

    def _written(self, content: _Tree, differing: list[OuterParameter]) -> str:
        stated = [name for name in self._stated if name in content["variables"]]
        if not differing and not stated:
            return ""
        values = ValueTexts(content)
        for name in stated:
            if values.text(name) is None:
                raise ModelicaError(
                    f"{name} reads an outer component or an array, but its value is not known when the model is "
                    "loaded. Remedy: bind what it reads to literals, or to parameters with known values."
                )
        texts = {one.outer: values.text(one.inner) for one in differing} | {name: values.text(name) for name in stated}
        return written({name: text for name, text in texts.items() if text is not None})


def _differing(content: _Tree, sources: Sources) -> Iterator[OuterParameter]:
    """The parameters of outer components whose values may not be those that their class declares."""
    variables = content["variables"]
    visible = [
        name
        for name, variable in variables.items()
        if {"Parameter", "Constant"} & set(variable["variability"]) and not variable["is_protected"]
    ]
    for outer, inner in outer_components(content):
        for name in visible:
            if is_in(name, inner):
                rest = name.removeprefix(inner)
                if rest.count(".") > 1 or not _is_declared(name, variables, sources):
                    yield OuterParameter(outer + rest, name, outer.rpartition(".")[2] + rest)


def _is_declared(name: str, variables: _Tree, sources: Sources) -> bool:
    """Whether a parameter has the value that the class of its component declares, and no other class redeclares it."""
    variable = variables[name]
    place, binding = variable["source_span"], variable["binding"]
    if binding is None:
        return True
    span = next(iter(binding.values())).get("span", place)
    if variable["binding_from_modification"] or span["source"] != place["source"] or span["start"] < place["end"]:
        return False
    text = sources.texts[place["source"]][1].encode()
    before = masked(text[: place["start"]].decode()).rpartition(";")[2]
    between = masked(text[place["end"] : span["start"]].decode())
    if ";" in between or re.search(r"\bredeclare\b", before):
        return False
    return all(_is_declared(other, variables, sources) for other in references(binding) if other in variables)
