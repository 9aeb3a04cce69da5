"""Marks that show in the flat model the conditions and sizes by which components are present.

The front end evaluates the condition and the size of a component, and forgets them. Parameters beside a declaration
repeat both, so that the flat model says which parameters they read. A constant that is present by the same condition
shows what the front end made of it.
"""

import re
import zlib
from collections.abc import Iterator

from .equations import NEVER
from .marks import MARKED_CLASSES, mark, without_brackets
from .scan import class_kinds, masked, statement_end, uncommented

_IF = re.compile(r"(?<![\w.])(?<!end )if\b")
_CONDITION_END = re.compile(r'(?:=|<>)\s*"[^"]*"|(?P<end>"|,|;|\b(?:then|annotation|constrainedby)\b)')
_WORDS = (
    "then|else|elseif|if|when|elsewhen|loop|in|and|or|not|while|return|equation|algorithm|each|final|redeclare|"
    "annotation|constrainedby"
)
_NUMBERS = r"(?:Real|Integer|Boolean|String|(?:Modelica\.)?(?:Units\.)?SI\.\w+)\b"
_TYPE, _NAME = rf"(?<![\w.])(?!(?:{_WORDS}|{_NUMBERS})\b)[\w.]+", rf"(?!(?:{_WORDS})\b)(?P<name>[A-Za-z_]\w*)"
TYPE_AND_NAME = rf"{_TYPE}\s+(?:\w+\s*,\s*)*{_NAME}"
SIZES = r"\[(?P<sizes>[^\[\];]*(?:\[[^\[\];]*\][^\[\];]*)*)\]"
_NEXT = r"\s*(?=[;(,\"]|=(?!=)|if\b|annotation\b|constrainedby\b)"
_ARRAYS = [re.compile(rf"{TYPE_AND_NAME}\s*{SIZES}{_NEXT}"), re.compile(rf"{_TYPE}\s*{SIZES}\s*{_NAME}{_NEXT}")]


def marked(text: str) -> str:
    """A text with parameters after each declaration of a conditional component, or of an array of components, of a
    model.
    """
    plain, text_alone = masked(text), uncommented(text)
    kinds = class_kinds(plain)
    added: dict[int, list[str]] = {}
    for at, new in (*_conditions(text_alone, plain), *_sizes(text_alone, plain)):
        if kinds(at) in MARKED_CLASSES:
            added.setdefault(statement_end(plain, at), []).append(new)
    pieces, at = [], 0
    for end in sorted(added):
        pieces += [text[at:end], *added[end]]
        at = end
    return "".join([*pieces, text[at:]])


def _conditions(text: str, plain: str) -> Iterator[tuple[int, str]]:
    """The places of conditional components, each with its marks."""
    for found in _IF.finditer(plain):
        end = statement_end(plain, found.start())
        outside = without_brackets(plain[found.end() : end])
        last = next((one for one in _CONDITION_END.finditer(outside) if one["end"]), None)
        if last is not None and last[0] != "then" and not re.search(r"[)\]}]", outside[: last.start()]):
            condition = _in_one_line(text[found.end() : found.end() + last.start()])
            never, name = _never(found.start(), condition)
            yield (
                found.start(),
                f"{never} parameter Boolean {mark('if', name)} = if {NEVER}{name} then {condition} else false;"
                f" constant Boolean {mark('on', name)} = true if {condition};",
            )


def _sizes(text: str, plain: str) -> Iterator[tuple[int, str]]:
    """The places of arrays of components, each with its mark. Sizes that are numbers need none."""
    for found in (one for pattern in _ARRAYS for one in pattern.finditer(plain)):
        sizes = _in_one_line(text[slice(*found.span("sizes"))])
        if not re.fullmatch(r"[\d\s,:]*|.*\bBoolean\b.*", sizes):
            count = 1 + without_brackets(sizes).count(",")
            never, name = _never(found.start(), sizes)
            zeros = ", ".join("0" * count)
            yield (
                found.start(),
                f"{never} parameter Integer {mark('size', found['name'])}[{count}] = "
                f"if {NEVER}{name} then {{{sizes}}} else {{{zeros}}};",
            )


def _never(at: int, text: str) -> tuple[str, str]:
    """A constant that hides an expression from the last pass (`equations.py`), and the end of its name."""
    name = f"{zlib.crc32(f'{at} {text}'.encode()):x}"
    return f" constant Boolean {NEVER}{name} = false;", name


def _in_one_line(text: str) -> str:
    return " ".join(text.split())
