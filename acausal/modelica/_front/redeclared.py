"""Redeclarations of classes, as far as the front end drops them, and modifiers of constraining classes.

Of `B b(redeclare model M = N(k = 5))` it reads `redeclare model M = N`. So `N(k = 5)` becomes a class of its own beside
the component, and the redeclaration names it. It does not pass the redeclarations of `package P = Q(redeclare ...)` on
to the functions of the package, so this becomes a long class, in which it does. Because it applies a constraint to
redeclarations only, `replaceable T p constrainedby C(k = 5)` becomes `replaceable T p(k = 5) constrainedby C(k = 5)`.
"""

import re
import zlib

from .marks import without_brackets
from .scan import closed, edited, masked, statement_end, uncommented

_CLASS = re.compile(
    r"\bredeclare\s+(?:final\s+)?(?:replaceable\s+)?(?P<kind>model|package|record|block|connector|type)\s+\w+\s*=\s*"
    r"(?P<value>[\w.]+\s*\()"
)
_SHORT = re.compile(r"(?<!redeclare )(?<!replaceable )(?P<head>\bpackage\s+(?P<name>\w+)\s*)=\s*(?P<base>[\w.]+)\s*\(")
_CONSTRAINED = re.compile(
    r"\breplaceable\s+(?!(?:model|package|function|block|record|type|connector)\b)[\w.]+\s+\w+(?P<place>)\s+constrainedby\s+"
    r"[\w.]+\s*(?=\()"
)


def written_out(text: str) -> str:
    """A text with these redeclarations and modifiers written out."""
    if not re.search(r"\b(?:redeclare|constrainedby)\b", text):
        return text
    while (changed := _with_classes(text)) != text:
        text = changed
    return _with_constraints(_with_long_packages(text))


def _with_classes(text: str) -> str:
    """A text with a class for each outermost redeclaration with modifiers, after the declaration that it belongs to."""
    plain = masked(text)
    edits: dict[tuple[int, int], str] = {}
    last = 0
    for found in _CLASS.finditer(plain):
        begin, after = found.start("value"), closed(plain, found.end() - 1)
        before = plain[plain.rfind(";", 0, begin) + 1 : begin]
        if begin >= last and before.count("(") > before.count(")") and "annotation" not in before:
            value = text[begin:after]
            name = f"acausalClass{zlib.crc32(f'{begin} {value}'.encode()):x}"
            end = _end(plain, before, begin)
            edits[begin, after] = name + "\n" * value.count("\n")
            edits[end, end] = f"{edits.get((end, end), '')} {found['kind']} {name} = {' '.join(value.split())};"
            last = after
    return edited(text, edits)


def _end(plain: str, before: str, at: int) -> int:
    """The place after the statement that a place inside its brackets belongs to."""
    depth = before.count("(") - before.count(")")
    while depth:
        token = re.compile(r"[()]").search(plain, at)
        if token is None:
            return len(plain)
        depth, at = depth + (1 if token[0] == "(" else -1), token.end()
    return statement_end(plain, at)


def _with_long_packages(text: str) -> str:
    """A text whose short packages have no redeclarations."""
    plain = masked(text)
    edits: dict[tuple[int, int], str] = {}
    for found in _SHORT.finditer(plain):
        after = closed(plain, found.end() - 1)
        inside = (found.end(), after - 1)
        items = _items(text[slice(*inside)], plain[slice(*inside)])
        elements = [item for item in items if item.lstrip().startswith("redeclare")]
        if elements:
            others = ",".join(item for item in items if item not in elements)
            end = statement_end(plain, after)
            rest = "".join(f" {element.strip()};" for element in elements) + "\n" * text.count("\n", after, end)
            long = f"{found['head'].rstrip()} extends {found['base']}({others});{rest} end {found['name']};"
            edits[found.start(), end] = long
    return edited(text, edits)


def _with_constraints(text: str) -> str:
    """A text in which components without modifiers have those of their constraint."""
    plain = masked(text)
    edits = {}
    for found in _CONSTRAINED.finditer(plain):
        modifiers = uncommented(text[found.end() : closed(plain, found.end())])
        edits[found.span("place")] = " ".join(modifiers.split())
    return edited(text, edits)


def _items(text: str, plain: str) -> list[str]:
    """The modifiers between brackets."""
    commas = [place.start() for place in re.finditer(",", without_brackets(plain))]
    return [text[begin:end] for begin, end in zip([0, *(one + 1 for one in commas)], [*commas, len(text)], strict=True)]
