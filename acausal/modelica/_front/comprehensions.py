"""Array constructors with several iterators, as the front end reads them right.

`{e for i in u, j in v}` is `{{e for i in u} for j in v}` (Modelica 3.6, section 10.4.1.1), and the text gets this form:
the front end makes a vector or the transpose of the other one. As a modifier of a matrix of components, it reads only
the form with several iterators, and takes the first of them for the rows.
"""

import re
from typing import NamedTuple

from .marks import without_brackets
from .part_marks import SIZES, TYPE_AND_NAME
from .scan import closed, edited, masked

_TOKEN = re.compile(r"[(\[{]|[)\]}]|(?<![\w.])for\b|,")
_MATRIX = re.compile(rf"{TYPE_AND_NAME}\s*{SIZES}\s*(?=\()")
_VALUE = re.compile(r"(?<![\w.])(\w+)\s*=\s*(?={)")
_ATTRIBUTES = ("start", "fixed", "min", "max", "nominal", "stateSelect", "unit", "displayUnit", "quantity")


class _Constructor(NamedTuple):
    """The places in `{e for i in u, j in v}` of its brackets, of `for` and of the commas."""

    begin: int
    end: int
    word: int
    commas: list[int]


def nested(text: str) -> str:
    """A text in which array constructors have one iterator each, except in modifiers of matrices of components."""
    if not re.search(r"\{[^;]*\bfor\b", text):
        return text
    edits: dict[tuple[int, int], str] = {}
    for one in _constructors(masked(text)).values():
        edits |= {(comma, comma + 1): "} for" for comma in one.commas}
        edits[one.begin, one.begin] = "{" * len(one.commas)
    return _with_several(edited(text, edits))


def _with_several(text: str) -> str:
    """A text with nested array constructors, which have several iterators in modifiers of matrices of components."""
    plain = masked(text)
    constructors = _constructors(plain)
    edits: dict[tuple[int, int], str] = {}
    for found in _MATRIX.finditer(plain):
        axes = 1 + without_brackets(found["sizes"]).count(",")
        begin, end = found.end() + 1, closed(plain, found.end())
        outermost = without_brackets(plain[begin:end])
        for value in _VALUE.finditer(plain, begin, end) if axes > 1 else ():
            is_attribute = outermost[value.start() - begin] != " " and value[1] in _ATTRIBUTES
            modifier = plain[begin + outermost.rfind(",", 0, value.start() - begin) + 1 : value.start()]
            if not is_attribute and not re.search(r"\beach\b", modifier):
                edits |= _merged(text, plain, constructors, value.end(), axes)
    return edited(text, edits)


def _merged(
    text: str, plain: str, constructors: dict[int, _Constructor], at: int, axes: int
) -> dict[tuple[int, int], str]:
    """The edit that gives the outermost of nested constructors the iterators of the inner ones; none if there are fewer
    of them than axes.
    """
    levels: list[_Constructor] = []
    while len(levels) < axes:
        if at not in constructors or (levels and plain[constructors[at].end : levels[-1].word].strip()):
            return {}
        levels.append(constructors[at])
        at += 1 + len(plain[at + 1 :]) - len(plain[at + 1 :].lstrip())
    inner = levels[-1]
    iterators = ", ".join(text[one.word + 3 : one.end - 1].strip() for one in levels)
    return {(levels[0].begin - 1, levels[0].end): f"{{{text[inner.begin : inner.word]} for {iterators}}}"}


def _constructors(plain: str) -> dict[int, _Constructor]:
    """The array constructors with iterators of a masked text, by the places of their opening brackets."""
    found: dict[int, _Constructor] = {}
    around: list[tuple[int, list[int], list[int]]] = []
    for token in _TOKEN.finditer(plain):
        if token[0] in "([{":
            around.append((token.start(), [], []))
        elif token[0] in ")]}":
            begin, words, commas = around.pop() if around else (0, [], [])
            if words and plain[begin] == "{":
                found[begin] = _Constructor(begin + 1, token.end(), words[0], commas)
        elif around and token[0] == "for":
            around[-1][1].append(token.start())
        elif around and around[-1][1]:
            around[-1][2].append(token.start())
    return found
