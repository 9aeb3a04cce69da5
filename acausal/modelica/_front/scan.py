"""Reading Modelica text without parsing it."""

import bisect
import re
from collections.abc import Callable, Mapping, Sequence

_PASSIVE = re.compile(r'"(?:[^"\\]|\\.)*"|//[^\n]*|/\*.*?\*/|\'(?:[^\'\\\n]|\\.)+\'', re.S)
_BRACKET = re.compile(r"[(\[{]|[)\]}]|;")
# The comment and the annotation at the end of a statement.
COMMENT = re.compile(r'(?<=\S)\s*"[^"]*"(?:\s*\+\s*"[^"]*")*\s*(?:annotation\s*\(.*)?\Z|\s*annotation\s*\(.*\Z', re.S)

KINDS = "model|block|function|record|package|connector|type|class|operator(?!\\s+(?:function|record))"
_CLASS = re.compile(
    rf"(?<![\w.])(?:end\s+(?P<end>\w+)\s*;|(?P<kind>{KINDS})\s+(?:extends\s+)?(?P<name>\w+)(?!\s*=)(?!\w))"
)

_SECTION = re.compile(r"(?<![\w.])(?:equation|algorithm|public|protected|model|block|class|record|package)\b")


def masked(text: str) -> str:
    """The text with equal places, in which strings are empty and comments are blank."""
    return _PASSIVE.sub(lambda found: _blank(found[0]), text)


def uncommented(text: str) -> str:
    """The text with equal places, in which comments are blank."""
    return _PASSIVE.sub(lambda found: found[0] if found[0][0] in "\"'" else _blank(found[0]), text)


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


def closed(plain: str, at: int) -> int:
    """The place after the bracket that closes the one at a place of a masked text."""
    depth = 0
    for token in _BRACKET.finditer(plain, at):
        depth += (token[0] in "([{") - (token[0] in ")]}")
        if depth == 0:
            return token.end()
    return len(plain)


def edited(text: str, edits: Mapping[tuple[int, int], str]) -> str:
    """A text with other texts between pairs of places."""
    pieces, at = [], 0
    for (begin, end), new in sorted(edits.items()):
        pieces += [text[at:begin], new]
        at = end
    return "".join([*pieces, text[at:]])


def section_of(plain: str, at: int) -> str:
    """The keyword that opens the section of a place of a masked text: `equation`, `algorithm`, or one of declarations;
    empty in front of all of them.
    """
    return next((found[0] for found in reversed([*_SECTION.finditer(plain, 0, at)])), "")


def class_kinds(plain: str) -> Callable[[int], str | None]:
    """The kind of the class that a place of a masked text lies in; None outside of all classes."""
    starts: list[int] = [0]
    kinds: list[str | None] = [None]
    open_ones: list[tuple[str, str]] = []
    for found in _CLASS.finditer(plain):
        if found["end"] is None:
            open_ones.append((found["name"], found["kind"]))
        elif open_ones and open_ones[-1][0] == found["end"]:
            open_ones.pop()
        starts.append(found.start())
        kinds.append(open_ones[-1][1] if open_ones else None)
    return lambda at: kinds[bisect.bisect_right(starts, at) - 1]


def declared_partial(text: str, path: Sequence[str]) -> bool:
    """Whether a text declares the class of this path as partial."""
    plain = masked(text)
    around: list[str] = []
    for found in _CLASS.finditer(plain):
        if found["end"] is None:
            around.append(found["name"])
            if around == list(path):
                return re.search(r"\bpartial\s+$", plain[max(0, found.start() - 200) : found.start()]) is not None
        elif around and around[-1] == found["end"]:
            around.pop()
    return False
