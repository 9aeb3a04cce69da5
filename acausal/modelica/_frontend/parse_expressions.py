"""Expressions (Modelica 3.6, appendix A.2.7) by recursive descent."""

from . import tree as t
from .lexical import Tokens, string_value
from .source import Source, TextError

_RELATIONS = frozenset(("<", "<=", ">", ">=", "==", "<>"))
_SUMS = frozenset(("+", "-", ".+", ".-"))
_PRODUCTS = frozenset(("*", "/", ".*", "./"))
_POWERS = frozenset(("^", ".^"))
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
        return t.Name(tuple(parts), is_global, at)

    def expression(self) -> t.Expression:
        if self.kinds[self.i] == "if":
            return self._if()
        return self.simple_expression()

    def simple_expression(self) -> t.Expression:
        """An expression, possibly a range, that is not an if-expression."""
        first = self._logical()
        if self.kinds[self.i] != ":" or self.kinds[self.i + 1] in ("]", ",", ")"):
            return first
        at = self.at
        self.i += 1
        second = self._logical()
        if not self.accept(":"):
            return t.Range(first, None, second, at)
        return t.Range(first, second, self._logical(), at)

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
        return t.IfExpression(tuple(branches), self.expression(), at)

    def _logical(self) -> t.Expression:
        left = self._logical_term()
        while self.kinds[self.i] == "or":
            at = self.at
            self.i += 1
            left = t.Binary("or", left, self._logical_term(), at)
        return left

    def _logical_term(self) -> t.Expression:
        left = self._logical_factor()
        while self.kinds[self.i] == "and":
            at = self.at
            self.i += 1
            left = t.Binary("and", left, self._logical_factor(), at)
        return left

    def _logical_factor(self) -> t.Expression:
        if self.kinds[self.i] == "not":
            at = self.at
            self.i += 1
            return t.Unary("not", self._relation(), at)
        return self._relation()

    def _relation(self) -> t.Expression:
        left = self._sum()
        op = self.kinds[self.i]
        if op not in _RELATIONS:
            return left
        at = self.at
        self.i += 1
        found = t.Binary(op, left, self._sum(), at)
        if self.kinds[self.i] in _RELATIONS:
            raise self.error("a relation of relations needs parentheses.")
        return found

    def _sum(self) -> t.Expression:
        op = self.kinds[self.i]
        if op in _SUMS:
            at = self.at
            self.i += 1
            left: t.Expression = t.Unary(op, self._product(), at)
        else:
            left = self._product()
        while (op := self.kinds[self.i]) in _SUMS:
            at = self.at
            self.i += 1
            left = t.Binary(op, left, self._product(), at)
        return left

    def _product(self) -> t.Expression:
        left = self._factor()
        while (op := self.kinds[self.i]) in _PRODUCTS:
            at = self.at
            self.i += 1
            left = t.Binary(op, left, self._factor(), at)
        return left

    def _factor(self) -> t.Expression:
        base = self._primary()
        op = self.kinds[self.i]
        if op not in _POWERS:
            return base
        at = self.at
        self.i += 1
        found = t.Binary(op, base, self._primary(), at)
        if self.kinds[self.i] in _POWERS:
            raise self.error("a power of a power needs parentheses.")
        return found

    def _primary(self) -> t.Expression:
        i = self.i
        kind, value, at = self.kinds[i], self.values[i], self.offsets[i]
        match kind:
            case "name" | ".":
                return self._reference_or_call()
            case "integer":
                self.i += 1
                return t.Literal(int(value), at)
            case "real":
                self.i += 1
                return t.Literal(float(value), at)
            case "string":
                self.i += 1
                return t.Literal(string_value(value), at)
            case "true" | "false":
                self.i += 1
                return t.Literal(kind == "true", at)
            case "(":
                return self._parenthesis()
            case "{":
                return self._array()
            case "[":
                return self._matrix()
            case "der" | "initial" | "pure":
                self.i += 1
                return self._call(t.Reference((t.Part(kind, (), at),), False, at))
            case "end":
                self.i += 1
                return t.End(at)
        raise self.unexpected("an expression")

    def reference(self) -> t.Reference:
        at = self.at
        is_global = self.accept(".")
        parts = []
        while True:
            here = self.at
            name = self.expect("name")
            parts.append(t.Part(name, self.subscripts() if self.kinds[self.i] == "[" else (), here))
            if not self.accept("."):
                return t.Reference(tuple(parts), is_global, at)

    def _reference_or_call(self) -> t.Expression:
        found = self.reference()
        return self._call(found) if self.kinds[self.i] == "(" else found

    def subscripts(self) -> tuple[t.Expression, ...]:
        """Subscripts, or the sizes of an array, in brackets."""
        self.expect("[")
        found = [self._subscript()]
        while self.accept(","):
            found.append(self._subscript())
        self.expect("]")
        return tuple(found)

    def _subscript(self) -> t.Expression:
        if self.kinds[self.i] == ":":
            at = self.at
            self.i += 1
            return t.Whole(at)
        return self.expression()

    def _call(self, function: t.Reference) -> t.Expression:
        at = function.at
        self.expect("(")
        if self.accept(")"):
            return t.Call(function, (), (), at)
        args: list[t.Expression] = []
        named: list[tuple[str, t.Expression]] = []
        while True:
            if self.kinds[self.i] == "name" and self.kinds[self.i + 1] == "=":
                name = self.expect("name")
                self.i += 1
                named.append((name, self._argument()))
            elif named:
                raise self.error("an argument without a name follows one with a name.")
            else:
                args.append(self._argument())
                if self.kinds[self.i] == "for" and len(args) == 1:
                    iterators = self._for()
                    self.expect(")")
                    return t.Reduction(function, args[0], iterators, at)
            if not self.accept(","):
                self.expect(")")
                return t.Call(function, tuple(args), tuple(named), at)

    def _argument(self) -> t.Expression:
        if self.kinds[self.i] != "function":
            return self.expression()
        at = self.at
        self.i += 1
        function = self.reference()
        self.expect("(")
        named = []
        while self.kinds[self.i] != ")":
            name = self.expect("name")
            self.expect("=")
            named.append((name, self._argument()))
            if not self.accept(","):
                break
        self.expect(")")
        return t.PartialCall(function, tuple(named), at)

    def _for(self) -> tuple[t.Iterator, ...]:
        self.expect("for")
        return self.iterators()

    def iterators(self) -> tuple[t.Iterator, ...]:
        found = []
        while True:
            at = self.at
            name = self.expect("name")
            found.append(t.Iterator(name, self.expression() if self.accept("in") else None, at))
            if not self.accept(","):
                return tuple(found)

    def _array(self) -> t.Expression:
        at = self.at
        self.i += 1
        if self.accept("}"):
            return t.Array((), at)
        elements = [self._argument()]
        if self.kinds[self.i] == "for":
            iterators = self._for()
            self.expect("}")
            return t.Reduction(t.Reference((t.Part("array", (), at),), False, at), elements[0], iterators, at)
        while self.accept(","):
            elements.append(self._argument())
        self.expect("}")
        return t.Array(tuple(elements), at)

    def _matrix(self) -> t.Expression:
        at = self.at
        self.i += 1
        rows = []
        while True:
            row = [self.expression()]
            while self.accept(","):
                row.append(self.expression())
            rows.append(tuple(row))
            if not self.accept(";"):
                self.expect("]")
                return t.Matrix(tuple(rows), at)

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
            return t.Tuple(tuple(elements) if is_tuple else (), at)
        if self.kinds[self.i] == "[":
            return t.Subscripted(first, self.subscripts(), at)
        return first
