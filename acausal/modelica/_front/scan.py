"""Reading Modelica text without parsing it."""

import re

_PASSIVE = re.compile(r'"(?:[^"\\]|\\.)*"|//[^\n]*|/\*.*?\*/|\'(?:[^\'\\\n]|\\.)+\'', re.S)
_BRACKET = re.compile(r"[(\[{]|[)\]}]|;")


def masked(text: str) -> str:
    """The text with equal places, in which strings are empty and comments are blank."""
    return _PASSIVE.sub(lambda found: _blank(found[0]), text)


def _blank(piece: str) -> str:
    if piece[0] == "'":  # a quoted name
        return "q" * len(piece)
    inside = re.sub(r"[^\n]", " ", piece)
    return f'"{inside[1:-1]}"' if piece[0] == '"' else inside


def statement_end(plain: str, at: int) -> int:
    """The place after the semicolon that ends the statement at `at`."""
    depth = 0
    for token in _BRACKET.finditer(plain, at):
        depth += (token[0] in "([{") - (token[0] in ")]}")
        if token[0] == ";" and depth <= 0:
            return token.end()
    return len(plain)
