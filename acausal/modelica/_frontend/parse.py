"""Class definitions (Modelica 3.6, appendix A.2.1 to A.2.5) by recursive descent."""

import re

from . import tree as t
from .lexical import Tokens, string_value, tokens
from .parse_clauses import ClauseParser
from .source import Source

_KINDS = frozenset("class model block connector record type package function operator".split())
_PREFIXES = frozenset("partial encapsulated expandable pure impure final".split())
_CLASS_STARTS = _KINDS | _PREFIXES - {"final"}
_COMPONENT_STARTS = frozenset("flow stream discrete parameter constant input output name .".split())
_ELEMENT_PREFIXES = ("redeclare", "final", "inner", "outer", "replaceable")  # in their order
_NO_PREFIXES = dict.fromkeys((*(f"is_{word}" for word in _ELEMENT_PREFIXES), "is_protected"), False)
# Annotations with a meaning for the equations. All others are skipped.
KEPT = (
    "Evaluate", "conversion", "derivative", "experiment", "inverse", "missingInnerMessage", "mustBeConnected",
    "smoothOrder", "uses", "version",
)  # fmt: skip
_HAS_KEPT = re.compile(rf"\b(?:{'|'.join(KEPT)})\s*[=(]")


def parse(source: Source) -> t.File:
    """The classes of a text. Raises `TextError`."""
    return _ClassParser(source, tokens(source)).file()


def parse_modification(source: Source) -> t.Modification:
    """The modification in parentheses that is a whole text. Raises `TextError`."""
    parser = _ClassParser(source, tokens(source))
    found = parser.modification()
    parser.expect("eof")
    return found


class _ClassParser(ClauseParser):
    def file(self) -> t.File:
        within = None
        if self.accept("within"):
            within = "" if self.kind == ";" else str(self.name())
            self.expect(";")
        classes = []
        while self.kind != "eof":
            is_final = self.accept("final")
            if self.kind not in _CLASS_STARTS:
                raise self.unexpected("a class definition")
            classes.append(self._class(_NO_PREFIXES | {"is_final": is_final}))
            self.expect(";", "after the class definition")
        return t.File(within, tuple(classes))

    def _class(self, prefixes: dict[str, bool], *, is_short: bool = False) -> t.Class:
        is_encapsulated = self.accept("encapsulated")
        is_partial = self.accept("partial")
        kind, is_impure = self._class_kind()
        at = self.at
        is_class_extends = self.accept("extends")
        name = self.expect("name", "of the class")
        annotation: t.Modification | None = None
        body: t.Long | t.Short | t.Enumeration | t.Derivative
        if self.kind == "=" and not is_class_extends:
            self.i += 1
            body = self._short()
            annotation = self._comment_annotation()
        elif is_short:
            raise self.unexpected("`=` and the name of a class")
        else:
            body, annotation = self._long(name, is_class_extends)
        constraint = self._constraint() if prefixes["is_replaceable"] else None
        if constraint is not None:
            annotation = self._comment_annotation() or annotation
        return t.Class(
            name=name,
            kind=kind,
            body=body,
            is_partial=is_partial,
            is_encapsulated=is_encapsulated,
            is_impure=is_impure,
            constraint=constraint,
            annotation=annotation,
            at=at,
            **prefixes,
        )

    def _class_kind(self) -> tuple[str, bool]:
        is_impure = self.kind == "impure"
        if self.kind in ("pure", "impure", "expandable"):
            word = self.kind
            self.i += 1
            if word == "expandable":
                self.expect("connector", "after `expandable`")
                return "expandable connector", False
        kind = self.kind
        if kind not in _KINDS:
            raise self.unexpected("`model`, `package` or another kind of class")
        self.i += 1
        if kind == "operator" and self.kind in ("record", "function"):
            kind = f"operator {self.kind}"
            self.i += 1
        return kind, is_impure

    def _short(self) -> t.Short | t.Enumeration | t.Derivative:
        if self.kind == "enumeration":
            return self._enumeration()
        if self.accept("der"):
            self.expect("(")
            function = self.name()
            variables = self.listed(self._simple_name) if self.accept(",") else ()
            self.expect(")")
            return t.Derivative(function, variables)
        causality = ""
        while self.kind in ("input", "output"):
            causality = self.kind
            self.i += 1
        if self.kind in ("flow", "stream", "parameter", "constant", "discrete"):
            raise self.error(f"a short class definition cannot have the prefix `{self.kind}`.")
        type_name = self.name()
        dims = self.subscripts() if self.kind == "[" else ()
        modification = self.modification() if self.kind == "(" else None
        return t.Short(causality, type_name, dims, modification)

    def _enumeration(self) -> t.Enumeration:
        self.expect("enumeration")
        self.expect("(")
        if self.accept(":"):
            self.expect(")")
            return t.Enumeration(None)
        literals: list[str] = []

        def literal() -> None:
            at = self.at
            name = self.expect("name", "of an enumeration literal")
            if name in literals:
                raise self.error(f"the enumeration literal {name} occurs twice.", at)
            literals.append(name)
            self._comment()

        self.listed(literal, ")")
        return t.Enumeration(tuple(literals))

    def _long(self, name: str, is_class_extends: bool) -> tuple[t.Long, t.Modification | None]:
        extends = self.modification() if is_class_extends and self.kind == "(" else None
        self.description()
        elements: list[t.Element] = []
        sections: list[t.Section] = []
        external: t.External | None = None
        annotation: t.Modification | None = None
        is_protected = False
        while True:
            match self.kind:
                case "end":
                    break
                case "public" | "protected":
                    is_protected = self.kind == "protected"
                    self.i += 1
                case "equation" | "algorithm" | "initial":
                    sections.append(self.section())
                case "external":
                    external = self._external()
                case "annotation":
                    found = self._annotation()
                    annotation = annotation or found
                    self.expect(";", "after the annotation")
                case _:
                    self._element(elements, is_protected)
        self.i += 1
        at = self.at
        end = self.expect("name", f"{name} after `end`")
        if end != name:
            raise self.error(f"expected {name} after `end`, as the class begins, but found {end}.", at)
        return t.Long(tuple(elements), tuple(sections), external, extends, is_class_extends), annotation

    def _external(self) -> t.External:
        at = self.at
        self.i += 1
        language = string_value(self.expect("string")) if self.kind == "string" else "C"
        result, name = None, ""
        args: tuple[t.Expression, ...] = ()
        if self.kind in ("name", "."):
            reference = self.reference()
            if self.accept("="):
                result = reference
                reference = self.reference()
            name = str(reference)
            self.expect("(")
            args = self.listed(self.expression, ")")
        self.accept("annotation")
        self.expect(";", "after the external function")
        return t.External(language, name, result, args, at=at)

    def _element(self, elements: list[t.Element], is_protected: bool) -> None:
        """Adds the elements that one element clause declares."""
        if self.kind == "import":
            elements.append(self._import())
        elif self.kind == "extends":
            elements.append(self._extends(is_protected))
        else:
            elements += self._declaration(is_protected)
        self.expect(";", "after the declaration")

    def _import(self) -> t.Import:
        at = self.at
        self.i += 1
        alias: str | None = None
        if self.kind == "name" and self.kinds[self.i + 1] == "=":
            alias = self.expect("name")
            self.i += 1
            found = t.Import(self.name(), alias, (alias,), at=at)
        else:
            found = self._imported(at)
        self._comment()
        return found

    def _imported(self, at: int) -> t.Import:
        start = self.at
        parts = [self.expect("name")]
        while self.kind in (".", ".*"):
            if self.accept(".*") or (self.accept(".") and self.accept("*")):
                return t.Import(t.Name(tuple(parts), True, at=start), None, None, at=at)
            if self.accept("{"):
                names = self.listed(self._simple_name)
                self.expect("}")
                return t.Import(t.Name(tuple(parts), True, at=start), None, names, at=at)
            parts.append(self.expect("name"))
        return t.Import(t.Name(tuple(parts), True, at=start), parts[-1], (parts[-1],), at=at)

    def _simple_name(self) -> str:
        return self.expect("name")

    def _extends(self, is_protected: bool) -> t.Extends:
        at = self.at
        self.i += 1
        name = self.name()
        modification = self.modification() if self.kind == "(" else None
        annotation = self._annotation() if self.kind == "annotation" else None
        return t.Extends(name, modification, annotation, is_protected, at=at)

    def _declaration(self, is_protected: bool) -> list[t.Element]:
        """A class, or the components of a component clause, with the prefixes of elements."""
        prefixes = {f"is_{word}": self.accept(word) for word in _ELEMENT_PREFIXES} | {"is_protected": is_protected}
        if self.kind in _CLASS_STARTS:
            return [self._class(prefixes)]
        if self.kind not in _COMPONENT_STARTS:
            raise self.unexpected("a declaration, `equation`, `algorithm` or `end`")
        return list(self._components(prefixes, is_single=False))

    def _components(self, prefixes: dict[str, bool], *, is_single: bool) -> list[t.Component]:
        variability = causality = connection = ""
        while self.kind in ("flow", "stream", "discrete", "parameter", "constant", "input", "output"):
            prefix = self.kind
            if prefix in ("flow", "stream"):
                is_second, connection = bool(connection), prefix
            elif prefix in ("input", "output"):
                is_second, causality = bool(causality), prefix
            else:
                is_second, variability = bool(variability), prefix
            if is_second:
                raise self.error(f"the prefix `{prefix}` follows another one of its kind.")
            self.i += 1
        type_name = self.name()
        type_dims = self.subscripts() if self.kind == "[" else ()
        found = []
        while True:
            at = self.at
            name = self.expect("name", "of the component")
            dims = self.subscripts() if self.kind == "[" else ()
            modification = self.modification() if self.kind in ("(", "=", ":=") else None
            condition = None
            if self.kind == "if" and not is_single:
                self.i += 1
                condition = self.expression()
            self.description()
            annotation = self._annotation() if self.kind == "annotation" else None
            found.append(
                t.Component(
                    name=name,
                    type=type_name,
                    variability=variability,
                    causality=causality,
                    connection=connection,
                    dims=dims + type_dims,
                    modification=modification,
                    condition=condition,
                    constraint=None,
                    annotation=annotation,
                    at=at,
                    **prefixes,
                )
            )
            if is_single or not self.accept(","):
                break
        if prefixes["is_replaceable"] and self.kind == "constrainedby":
            constraint = self._constraint()
            self._comment()
            for component in found:
                component.constraint = constraint
        return found

    def _constraint(self) -> t.Constraint | None:
        at = self.at
        if not self.accept("constrainedby"):
            return None
        name = self.name()
        return t.Constraint(name, self.modification() if self.kind == "(" else None, at=at)

    def modification(self) -> t.Modification:
        """A modification in parentheses, with `=` and a value, or both."""
        at = self.at
        arguments = self.listed(self._modifier, ")", "or `,` in the modification") if self.accept("(") else ()
        value = None
        if self.kind in ("=", ":="):
            self.i += 1
            if self.kind == "break":
                value = t.NoValue(at=self.at)
                self.i += 1
            else:
                value = self.expression()
        return t.Modification(arguments, value, at=at)

    def _modifier(self) -> t.Argument:
        at = self.at
        if self.accept("break"):
            if self.kind == "connect":
                return t.BreakModification("", self.connect(), at=at)
            return t.BreakModification(self.expect("name"), None, at=at)
        is_redeclare = self.accept("redeclare")
        is_each = self.accept("each")
        is_final = self.accept("final")
        if is_redeclare or self.kind == "replaceable":
            return self._replacement(is_each, is_final, is_redeclare, at)
        name = self.name()
        self_at = self.at
        modification = self.modification() if self.kind in ("(", "=", ":=") else t.Modification((), None, at=self_at)
        self.description()
        return t.ElementModification(name.parts, is_each, is_final, modification, at=at)

    def _replacement(self, is_each: bool, is_final: bool, is_redeclare: bool, at: int) -> t.ElementReplacement:
        own = {"is_redeclare": is_redeclare, "is_final": is_final, "is_replaceable": self.accept("replaceable")}
        prefixes = _NO_PREFIXES | own
        if self.kind in _CLASS_STARTS:
            element: t.Class | t.Component = self._class(prefixes, is_short=True)
        else:
            (element,) = self._components(prefixes, is_single=True)
        return t.ElementReplacement(is_each, is_final, element, at=at)

    def _comment_annotation(self) -> t.Modification | None:
        self.description()
        return self._annotation() if self.kind == "annotation" else None

    def _annotation(self) -> t.Modification | None:
        """The arguments of an annotation that are kept; None if there are none."""
        self.expect("annotation")
        i = self.i - 1
        text, at = self.values[i], self.offsets[i]
        if not text.startswith("(") and not text.lstrip().startswith("("):
            raise self.unexpected("`(` after `annotation`")
        if not _HAS_KEPT.search(text):
            return None
        inner = _ClassParser(self.source, _ended(tokens(self.source, at, at + len(text))))
        return inner._kept()

    def _kept(self) -> t.Modification | None:
        at = self.at
        found: list[t.Argument] = []
        self.expect("(")
        while self.kind not in (")", "eof"):
            name = self.values[self.i]
            if self.kind == "name" and name in KEPT:
                found.append(self._modifier())
            else:
                self._skip_argument()
            if not self.accept(","):
                break
        return t.Modification(tuple(found), None, at=at) if found else None

    def _skip_argument(self) -> None:
        depth = 0
        while self.kind != "eof":
            if depth == 0 and self.kind in (",", ")"):
                return
            depth += {"(": 1, "{": 1, "[": 1, ")": -1, "}": -1, "]": -1}.get(self.kind, 0)
            self.i += 1


def _ended(found: Tokens) -> Tokens:
    """Tokens of a part of a text with an end."""
    found.kinds.append("eof")
    found.values.append("")
    found.offsets.append(found.offsets[-1] if found.offsets else 0)
    return found
