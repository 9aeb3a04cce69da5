"""Expressions (Modelica 3.6, appendix A.2.7) by recursive descent."""

from collections.abc import Callable
from typing import TypeVar

from . import tree as t
from .lexical import Tokens, string_value
from .source import Source, TextError

# Operators by how strongly they bind. Those of one level are evaluated from left to right.
_LEVELS = {
    "or": 1, "and": 2, "<": 4, "<=": 4, ">": 4, ">=": 4, "==": 4, "<>": 4, "+": 5, "-": 5, ".+": 5, ".-": 5,
    "*": 6, "/": 6, ".*": 6, "./": 6, "^": 7, ".^": 7,
}  # fmt: skip
_PREFIXES = {"not": 3, "+": 5, "-": 5, ".+": 5, ".-": 5}
_ALONE = {4: "a relation of relations", 7: "a power of a power"}
_Item = TypeVar("_Item")
_NAMED = {"name": "a name", "eof": "the end of the text", "string": "a string"}


class Cursor:
    """A place in the tokens of a text."""

    def __init__(self, source: Source, tokens: Tokens) -> None:
        self.source = source
        self.kinds, self.values, self.offsets = tokens
        self.i = 0

    @property
    def kind(self) -> str:
        return self.kinds[self.i]

    @property
    def at(self) -> int:
        return self.offsets[self.i]

    def error(self, message: str, at: int | None = None) -> TextError:
        return self.source.error(self.at if at is None else at, message)

    def unexpected(self, expected: str) -> TextError:
        kind = self.kind
        found = _NAMED.get(kind) if kind == "eof" else f"`{self.values[self.i]}`"
        return self.error(f"expected {expected}, but found {found}.")

    def accept(self, kind: str) -> bool:
        """Whether the next token is of this kind; it is passed over then."""
        if self.kinds[self.i] == kind:
            self.i += 1
            return True
        return False

    def expect(self, kind: str, after: str = "") -> str:
        """The value of the next token, which must be of this kind."""
        i = self.i
        if self.kinds[i] != kind:
            raise self.unexpected(_NAMED.get(kind, f"`{kind}`") + (f" {after}" if after else ""))
        self.i = i + 1
        return self.values[i]

    def listed(self, item: Callable[[], _Item], end: str = "", after: str = "") -> tuple[_Item, ...]:
        """Items with commas between them. With the bracket at their `end`, which is passed over, there may be none."""
        found: list[_Item] = []
        while self.kind != end:
            found.append(item())
            if not self.accept(","):
                break
        if end:
            self.expect(end, after)
        return tuple(found)


class ExpressionParser(Cursor):
    """Parses expressions."""

    def name(self) -> t.Name:
        """The name of a class."""
        at = self.at
        is_global = self.accept(".")
        parts = [self.expect("name")]
        while self.kinds[self.i] == ".":
            self.i += 1
            parts.append(self.expect("name"))
        return t.Name(tuple(parts), is_global, at=at)

    def expression(self) -> t.Expression:
        if self.kinds[self.i] == "if":
            return self._if()
        return self.simple_expression()

    def simple_expression(self) -> t.Expression:
        """An expression, possibly a range, that is not an if-expression."""
        first = self._operation()
        if self.kinds[self.i] != ":" or self.kinds[self.i + 1] in ("]", ",", ")"):
            return first
        at = self.at
        self.i += 1
        second = self._operation()
        if not self.accept(":"):
            return t.Range(first, None, second, at=at)
        return t.Range(first, second, self._operation(), at=at)

    def _if(self) -> t.Expression:
        at = self.at
        branches = []
        self.i += 1
        while True:
            condition = self.expression()
            self.expect("then")
            branches.append((condition, self.expression()))
            if not self.accept("elseif"):
                break
        self.expect("else", "of the if-expression")
        return t.IfExpression(tuple(branches), self.expression(), at=at)

    def _operation(self, level: int = 1) -> t.Expression:
        """An expression whose operators bind at least as strongly as a level, by precedence climbing."""
        op, at = self.kinds[self.i], self.at
        left: t.Expression
        if level <= (own := _PREFIXES.get(op, 0)):
            self.i += 1
            left = t.Unary(op, self._operation(own + 1), at=at)
        else:
            left = self._primary()
        while level <= (own := _LEVELS.get(op := self.kinds[self.i], 0)):
            at = self.at
            self.i += 1
            left = t.Binary(op, left, self._operation(own + 1), at=at)
            if _LEVELS.get(self.kinds[self.i]) == own and own in _ALONE:
                raise self.error(f"{_ALONE[own]} needs parentheses.")
        return left

    def _primary(self) -> t.Expression:
        i = self.i
        kind, value, at = self.kinds[i], self.values[i], self.offsets[i]
        match kind:
            case "name" | ".":
                return self._reference_or_call()
            case "integer":
                self.i += 1
                return t.Literal(int(value), at=at)
            case "real":
                self.i += 1
                return t.Literal(float(value), at=at)
            case "string":
                self.i += 1
                return t.Literal(string_value(value), at=at)
            case "true" | "false":
                self.i += 1
                return t.Literal(kind == "true", at=at)
            case "(":
                return self._parenthesis()
            case "{":
                return self._array()
            case "[":
                return self._matrix()
            case "der" | "initial" | "pure":
                self.i += 1
                return self._call(t.Reference((t.Part(kind, (), at=at),), False, at=at))
            case "end":
                self.i += 1
                return t.End(at=at)
        raise self.unexpected("an expression")

    def reference(self) -> t.Reference:
        at = self.at
        is_global = self.accept(".")
        parts = []
        while True:
            here = self.at
            name = self.expect("name")
            parts.append(t.Part(name, self.subscripts() if self.kinds[self.i] == "[" else (), at=here))
            if not self.accept("."):
                return t.Reference(tuple(parts), is_global, at=at)

    def _reference_or_call(self) -> t.Expression:
        found = self.reference()
        return self._call(found) if self.kinds[self.i] == "(" else found

    def subscripts(self) -> tuple[t.Expression, ...]:
        """Subscripts, or the sizes of an array, in brackets."""
        self.expect("[")
        found = self.listed(self._subscript)
        self.expect("]")
        return found

    def _subscript(self) -> t.Expression:
        if self.kinds[self.i] == ":":
            at = self.at
            self.i += 1
            return t.Whole(at=at)
        return self.expression()

    def _call(self, function: t.Reference) -> t.Expression:
        at = function.at
        self.expect("(")
        if self.accept(")"):
            return t.Call(function, (), (), at=at)
        args: list[t.Expression] = []
        named: list[tuple[str, t.Expression]] = []
        while True:
            if self.kinds[self.i] == "name" and self.kinds[self.i + 1] == "=":
                named.append(self._named())
            elif named:
                raise self.error("an argument without a name follows one with a name.")
            else:
                args.append(self._argument())
                if len(args) == 1 and self.accept("for"):
                    iterators = self.iterators()
                    self.expect(")")
                    return t.Reduction(function, args[0], iterators, at=at)
            if not self.accept(","):
                self.expect(")")
                return t.Call(function, tuple(args), tuple(named), at=at)

    def _argument(self) -> t.Expression:
        if self.kinds[self.i] != "function":
            return self.expression()
        at = self.at
        self.i += 1
        function = self.reference()
        self.expect("(")
        return t.PartialCall(function, self.listed(self._named, ")"), at=at)

    def _named(self) -> tuple[str, t.Expression]:
        name = self.expect("name")
        self.expect("=")
        return name, self._argument()

    def iterators(self) -> tuple[t.Iterator, ...]:
        return self.listed(self._iterator)

    def _iterator(self) -> t.Iterator:
        at = self.at
        return t.Iterator(self.expect("name"), self.expression() if self.accept("in") else None, at=at)

    def _array(self) -> t.Expression:
        at = self.at
        self.i += 1
        if self.accept("}"):
            return t.Array((), at=at)
        elements = self.listed(self._argument)
        iterators = self.iterators() if len(elements) == 1 and self.accept("for") else ()
        self.expect("}")
        if iterators:
            return t.Reduction(t.Reference((t.Part("array", (), at=at),), False, at=at), elements[0], iterators, at=at)
        return t.Array(elements, at=at)

    def _matrix(self) -> t.Expression:
        at = self.at
        self.i += 1
        rows = []
        while True:
            rows.append(self.listed(self.expression))
            if not self.accept(";"):
                self.expect("]")
                return t.Matrix(tuple(rows), at=at)

    def _parenthesis(self) -> t.Expression:
        at = self.at
        self.i += 1
        elements: list[t.Expression | None] = []
        is_tuple = False
        while True:
            elements.append(None if self.kinds[self.i] in (",", ")") else self.expression())
            if not self.accept(","):
                self.expect(")")
                break
            is_tuple = True
        first = elements[0]
        if is_tuple or first is None:
            return t.Tuple(tuple(elements) if is_tuple else (), at=at)
        if self.kinds[self.i] == "[":
            return t.Subscripted(first, self.subscripts(), at=at)
        return first
