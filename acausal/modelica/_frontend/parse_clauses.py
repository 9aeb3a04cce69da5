"""Equations and statements (Modelica 3.6, appendix A.2.6) by recursive descent."""

from collections.abc import Callable

from . import tree as t
from .parse_expressions import ExpressionParser

_SECTION_ENDS = frozenset(("end", "equation", "algorithm", "initial", "public", "protected", "external", "annotation"))


class ClauseParser(ExpressionParser):
    """Parses equations and statements."""

    def section(self) -> t.Section:
        """An equation or algorithm section."""
        at = self.at
        is_initial = self.accept("initial")
        is_algorithm = self.kind == "algorithm"
        if not is_algorithm and self.kind != "equation":
            raise self.unexpected("`equation` or `algorithm`")
        self.i += 1
        clauses = []
        clause = self._statement if is_algorithm else self._equation
        while self.kinds[self.i] not in _SECTION_ENDS or (self.kind == "initial" and self.kinds[self.i + 1] == "("):
            clauses.append(clause())
            self._comment()
            self.expect(";", "after the " + ("statement" if is_algorithm else "equation"))
        return t.Section(is_algorithm, is_initial, tuple(clauses), at=at)

    def _comment(self) -> None:
        self.description()
        self.accept("annotation")

    def description(self) -> None:
        if self.accept("string"):
            while self.accept("+"):
                self.expect("string")

    def _equation(self) -> t.Clause:
        at = self.at
        if (found := self._structured(self._equation)) is not None:
            return found
        if self.kind == "connect":
            return self.connect()
        left = self.simple_expression()
        if self.accept("="):
            return t.Equality(left, self.expression(), at=at)
        if isinstance(left, t.Call):
            return t.CallEquation(left, at=at)
        raise self.unexpected("`=` after the left side of an equation")

    def _structured(self, clause: Callable[[], t.Clause]) -> t.Clause | None:
        """The clause with others inside that begins here; None for another one."""
        parsers = {"if": self._if_clause, "for": self._for_clause, "when": self._when}
        return parsers[self.kind](clause) if self.kind in parsers else None

    def connect(self) -> t.Connect:
        at = self.at
        self.expect("connect")
        self.expect("(")
        left = self.expression()
        self.expect(",")
        right = self.expression()
        self.expect(")")
        return t.Connect(left, right, at=at)

    def _statement(self) -> t.Clause:
        at = self.at
        if (found := self._structured(self._statement)) is not None:
            return found
        match self.kind:
            case "while":
                self.i += 1
                condition = self.expression()
                self.expect("loop")
                body = self._clauses(self._statement, ("end",))
                self._end("while")
                return t.WhileClause(condition, body, at=at)
            case "return":
                self.i += 1
                return t.Return(at=at)
            case "break":
                self.i += 1
                return t.Break(at=at)
        left = self.simple_expression()
        if self.accept(":="):
            if not isinstance(left, t.Reference | t.Tuple):
                raise self.error("the left side of an assignment must be a variable.", at)
            return t.Assignment(left, self.expression(), at=at)
        if isinstance(left, t.Call):
            return t.CallEquation(left, at=at)
        if self.kind == "=":
            raise self.error("a statement assigns with `:=`, not with `=`.")
        raise self.unexpected("`:=` after the left side of a statement")

    def _clauses(self, clause: Callable[[], t.Clause], ends: tuple[str, ...]) -> t.Clauses:
        found = []
        while self.kinds[self.i] not in ends:
            found.append(clause())
            self._comment()
            self.expect(";")
        return tuple(found)

    def _branches(
        self, clause: Callable[[], t.Clause], first: str, further: str, ends: tuple[str, ...]
    ) -> tuple[tuple[t.Expression, t.Clauses], ...]:
        found = []
        while self.accept(further if found else first):
            condition = self.expression()
            self.expect("then")
            found.append((condition, self._clauses(clause, (further, *ends))))
        return tuple(found)

    def _if_clause(self, clause: Callable[[], t.Clause]) -> t.Clause:
        at = self.at
        branches = self._branches(clause, "if", "elseif", ("else", "end"))
        otherwise = self._clauses(clause, ("end",)) if self.accept("else") else ()
        self._end("if")
        return t.IfClause(branches, otherwise, at=at)

    def _for_clause(self, clause: Callable[[], t.Clause]) -> t.Clause:
        at = self.at
        self.i += 1
        iterators = self.iterators()
        self.expect("loop")
        body = self._clauses(clause, ("end",))
        self._end("for")
        return t.ForClause(iterators, body, at=at)

    def _when(self, clause: Callable[[], t.Clause]) -> t.Clause:
        at = self.at
        branches = self._branches(clause, "when", "elsewhen", ("end",))
        self._end("when")
        return t.WhenClause(branches, at=at)

    def _end(self, what: str) -> None:
        self.expect("end")
        self.expect(what, "after `end`")
