"""Algorithms of models written as equations, which `equations.py` hides from the last pass of rumoca.

An algorithm becomes the equation `"acausalAlgorithm" = statements`. Any statement is an expression there:

| Statement            | Expression                                   |
|----------------------|----------------------------------------------|
| several              | `sum({a, b})`                                |
| `x := value`         | `ndims({value, x})`                          |
| `(x, , y) := f(u)`   | `ndims({f(u), x, 0, y})`                     |
| `f(u)`               | `ndims({f(u)})`                              |
| `if`                 | `if condition then a else b`                 |
| `for`                | `sum({a for i in range})`                    |
| `when`               | `abs(sum({ndims({condition}), a}))`          |
| `while`              | `abs(if condition then a else 0)`            |
| `assert(a, b)`       | `abs(ndims({a, b}))`                         |
| `reinit(x, a)`       | `sign(ndims({x, a}))`                        |
| `terminate(a)`       | `sign(ndims({a}))`                           |
| `return`, `break`    | `abs(0)`, `abs(1)`                           |

rumoca unrolls a loop of known length, as in `sum({sum({a}), sum({b})})`.

The pass directs connections of discrete variables away from those that are set, so `when NEVER then x = pre(x)` names
the variables that the algorithm sets.

The flat model holds the equation, which `restored_algorithms.py` turns into the algorithm again.
"""

import re

from .scan import COMMENT, class_kinds, masked, statement_end

MARK = "acausalAlgorithm"
MARKED = f'"{MARK}" ='
NEVER = f'"{MARK}" == ""'
_START = re.compile(r"(?<![\w.])(initial\s+)?algorithm(?!\w)")
_WORD = re.compile(r"\w+")
_SPACE = re.compile(r"\s*")
_ASSIGNED = re.compile(r":=")
_TARGET = re.compile(r"(?<![\w.\[])[a-zA-Z_]\w*(?=\s*(?:\[|,|\)|\Z))(?![^\[]*\])")
_CALLS = {"assert": "abs", "reinit": "sign", "terminate": "sign"}
_ENDS = ("public", "protected", "algorithm", "equation", "initial", "end", "external", "else", "elseif", "elsewhen")


class _Unknown(Exception):
    """A statement that has no expression."""


def hidden(text: str) -> str:
    """A text whose algorithms are equations, except those of functions."""
    plain = masked(text)
    kinds = class_kinds(plain)
    pieces, at = [], 0
    for start in _START.finditer(plain):
        if start.start() < at or kinds(start.start()) in ("function", None):
            continue
        try:
            reader = _Reader(text, plain)
            body, end = reader.statements(start.end())
        except _Unknown:
            continue
        if body:
            gap = "\n" * (text.count("\n", start.end(), end) - body.count("\n"))
            sets = " ".join(f"{name} = pre({name});" for name in reader.targets)
            sources = f" when {NEVER} then {sets} end when;" if sets and not start[1] else ""
            pieces.append(f"{text[at : start.start()]}{start[1] or ''}equation {MARKED} {body};{sources}{gap}")
            at = end
    return "".join([*pieces, text[at:]])


class _Reader:
    """Reads statements of a text; `plain` is the masked text."""

    def __init__(self, text: str, plain: str) -> None:
        self.text, self.plain = text, plain
        self.targets: dict[str, None] = {}  # plain names that statements set, in order

    def statements(self, at: int) -> tuple[str, int]:
        """Statements as one expression, which is empty if there are none, and the place of the word that ends them."""
        found = []
        while True:
            begin = _skip(self.plain, at)
            gap = self.text[at:begin]
            word = _WORD.match(self.plain, begin)
            if begin == len(self.plain) or (word and word[0] in _ENDS):
                return (f"sum({{{', '.join(found)}{gap}}})" if found else ""), begin
            one, at = self._statement(begin, word[0] if word else "")
            if one:
                found.append(gap + one)

    def _statement(self, at: int, word: str) -> tuple[str, int]:
        match word:
            case "if":
                return self._if(at)
            case "when":
                return self._when(at)
            case "for":
                return self._for(at)
            case "while":
                return self._while(at)
            case "return" | "break":
                return f"abs({int(word == 'break')})", statement_end(self.plain, at)
        end = statement_end(self.plain, at)
        plain = self.plain[at : end - 1]
        comment = COMMENT.search(plain)
        last = len(plain) if comment is None else comment.start()
        text, plain = self.text[at : at + last], plain[:last]
        if word == "annotation":
            return "", end
        if word in _CALLS:
            return f"{_CALLS[word]}(ndims({{{text.strip()[len(word) :].strip()[1:-1]}}}))", end
        parts = _ASSIGNED.split(plain, maxsplit=1)
        if len(parts) == 1:
            return f"ndims({{{text}}})", end
        self.targets |= dict.fromkeys(_TARGET.findall(plain[: len(parts[0])]))
        target, value = text[: len(parts[0])].strip(), text[len(parts[0]) + 2 :].strip()
        if target.startswith("("):
            target = ", ".join(item.strip() or "0" for item in target[1:-1].split(","))
        return f"ndims({{{value}, {target}}})", end

    def _until(self, at: int, word: str) -> tuple[str, int]:
        """The text up to a word outside of brackets, and the place after it."""
        depth = 0
        for token in re.compile(rf"[(\[{{]|[)\]}}]|\bif\b|\b{word}\b").finditer(self.plain, at):
            if token[0] == "if":  # the expression has a `then` of its own
                raise _Unknown("if")
            depth += (token[0] in "([{") - (token[0] in ")]}")
            if depth == 0 and token[0] == word:
                return self.text[at : token.start()].strip(), token.end()
        raise _Unknown(word)

    def _branches(self, at: int, first: str, other: str) -> tuple[list[tuple[str, str]], str, int]:
        """The conditions of an `if` or `when` with their statements, those of `else`, and the place after the end."""
        found, otherwise = [], "0"
        at += len(first)
        while True:
            condition, at = self._until(at, "then")
            body, at = self.statements(at)
            found.append((condition, body or "0"))
            if not self.plain.startswith(other, at):
                break
            at += len(other)
        if self.plain.startswith("else", at):
            otherwise, at = self.statements(at + len("else"))
        return found, otherwise or "0", statement_end(self.plain, at)

    def _if(self, at: int) -> tuple[str, int]:
        found, otherwise, end = self._branches(at, "if", "elseif")
        branches = " elseif ".join(f"{condition} then {body}" for condition, body in found)
        return f"(if {branches} else {otherwise})", end

    def _when(self, at: int) -> tuple[str, int]:
        found, _, end = self._branches(at, "when", "elsewhen")
        blocks = ", ".join(f"ndims({{{condition}}}), {body}" for condition, body in found)
        return f"abs(sum({{{blocks}}}))", end

    def _for(self, at: int) -> tuple[str, int]:
        ranges, at = self._until(at + len("for"), "loop")
        body, at = self.statements(at)
        return f"sum({{{body or '0'} for {ranges}}})", statement_end(self.plain, at)

    def _while(self, at: int) -> tuple[str, int]:
        condition, at = self._until(at + len("while"), "loop")
        body, at = self.statements(at)
        return f"abs(if {condition} then {body or '0'} else 0)", statement_end(self.plain, at)


def _skip(plain: str, at: int) -> int:
    found = _SPACE.match(plain, at)
    return found.end() if found else at
