"""Lexical structure (Modelica 3.6, chapter 2)."""

import re
from typing import NamedTuple

from .source import Source

KEYWORDS = frozenset(
    """
    algorithm and annotation block break class connect connector constant constrainedby der discrete each else elseif
    elsewhen encapsulated end enumeration equation expandable extends external false final flow for function if import
    impure in initial inner input loop model not operator or outer output package parameter partial protected public
    pure record redeclare replaceable return stream then true type when while within
    """.split()
)
_STRING = r'"[^"\\]*(?:\\.[^"\\]*)*"'
_QUOTED = r"'[^'\\\n]*(?:\\.[^'\\\n]*)*'"
_COMMENT = r"//[^\n]*|/\*.*?\*/"
_TOKEN = re.compile(
    rf"(?:\s+|{_COMMENT})*+(?:"
    r"(?P<word>[A-Za-z_]\w*)"
    r"|(?P<symbol>\.[+\-*/^]|:=|<=|>=|==|<>|[()\[\]{},;:=<>+\-*/^]|\.(?!\d))"
    r"|(?P<real>\d+\.\d*(?:[eE][+-]?\d+)?|\d+[eE][+-]?\d+|\.\d+(?:[eE][+-]?\d+)?)"
    r"|(?P<integer>\d+)"
    rf"|(?P<string>{_STRING})"
    rf"|(?P<quoted>{_QUOTED})"
    r"|(?P<eof>\Z)"
    r"|(?P<bad>.))",
    re.S | re.A,
)
_IN_ANNOTATION = re.compile(rf"{_STRING}|{_QUOTED}|{_COMMENT}|[()]", re.S)
_ESCAPE = re.compile(r"\\(.)", re.S)
_ESCAPES = {"n": "\n", "t": "\t", "r": "\r", "a": "\a", "b": "\b", "f": "\f", "v": "\v"}


class Tokens(NamedTuple):
    """The tokens of a text. The kind of a keyword or symbol is its text; other kinds are "name", "integer", "real",
    "string", "annotation" and "eof". An annotation is one token, whose value is its text in parentheses.
    """

    kinds: list[str]
    values: list[str]
    offsets: list[int]


def tokens(source: Source, start: int = 0, end: int | None = None) -> Tokens:
    """The tokens of a part of a text. Raises `TextError`."""
    text = source.text
    last = len(text) if end is None else end
    found = Tokens([], [], [])
    at = start
    while at is not None:
        at = _tokens(source, at, last, found)
    return found


def _tokens(source: Source, start: int, last: int, found: Tokens) -> int | None:
    """Adds the tokens up to the end of the next annotation, and returns this end."""
    text = source.text
    kinds, values, offsets = found
    for match in _TOKEN.finditer(text, start, last):
        group = match.lastgroup
        value = match[group] if group else ""
        offset = match.end() - len(value)
        if group == "word":
            kind = value if value in KEYWORDS else "name"
        elif group == "symbol":
            kind = value
        elif group == "quoted":
            kind = "name"
        elif group == "bad":
            raise source.error(offset, _bad(value))
        else:
            kind = group or ""
        if kind == "annotation" and (stop := _annotation_end(source, match.end(), last)) is not None:
            kinds.append(kind)
            values.append(text[match.end() : stop])
            offsets.append(match.end())
            return stop
        kinds.append(kind)
        values.append(value)
        offsets.append(offset)
        if group == "eof":
            return None
    return None


def _annotation_end(source: Source, start: int, last: int) -> int | None:
    """The end of the parentheses after `annotation`; None if there are none."""
    depth = 0
    for match in _IN_ANNOTATION.finditer(source.text, start, last):
        symbol = match[0]
        if symbol == "(":
            if depth == 0 and source.text[start : match.start()].strip():
                return None
            depth += 1
        elif symbol == ")":
            depth -= 1
            if depth <= 0:
                return match.end()
    if depth:
        raise source.error(start, "the annotation has no closing parenthesis.")
    return None


def _bad(character: str) -> str:
    if character in "\"'":
        return f"the text after {character} has no closing {character}."
    return f"the character {character!r} has no meaning in Modelica."


def string_value(text: str) -> str:
    """The value of a string literal with its quotes."""
    inner = text[1:-1]
    return _ESCAPE.sub(lambda m: _ESCAPES.get(m[1], m[1]), inner) if "\\" in inner else inner
