"""The lexer and the parser: trees of small texts, and errors with their places."""

import dataclasses
import pickle
from typing import Any

import pytest

from acausal.modelica._frontend import tree as t
from acausal.modelica._frontend.parse import parse, parse_modification
from acausal.modelica._frontend.source import Source, TextError


def written(x: Any) -> str:
    """An expression as a Modelica text with all its parentheses."""
    match x:
        case t.Literal(bool() as value):
            return str(value).lower()
        case t.Literal(str() as value):
            return '"' + value.replace("\\", "\\\\").replace('"', '\\"') + '"'
        case t.Literal(value):
            return repr(value)
        case t.Reference(parts, is_global):
            return "." * is_global + ".".join(part.name + subscripts(part.subs) for part in parts)
        case t.Call(function, args, named):
            return (
                f"{written(function)}({', '.join([*map(written, args), *(f'{k} = {written(v)}' for k, v in named)])})"
            )
        case t.PartialCall(function, named):
            return f"function {written(function)}({', '.join(f'{k} = {written(v)}' for k, v in named)})"
        case t.Reduction(function, body, iterators):
            inner = f"{written(body)} for {', '.join(map(iterator, iterators))}"
            return f"{{{inner}}}" if written(function) == "array" else f"{written(function)}({inner})"
        case t.Unary(op, arg):
            return f"({op} {written(arg)})"
        case t.Binary(op, left, right):
            return f"({written(left)} {op} {written(right)})"
        case t.IfExpression(branches, otherwise):
            text = " else".join(f"if {written(c)} then {written(v)}" for c, v in branches)
            return f"({text} else {written(otherwise)})"
        case t.Array(elements):
            return "{" + ", ".join(map(written, elements)) + "}"
        case t.Matrix(rows):
            return "[" + "; ".join(", ".join(map(written, row)) for row in rows) + "]"
        case t.Range(start, step, stop):
            return f"({':'.join(written(part) for part in (start, step, stop) if part is not None)})"
        case t.Tuple(elements):
            return "(" + ", ".join("" if one is None else written(one) for one in elements) + ")"
        case t.Subscripted(base, subs):
            return f"({written(base)}){subscripts(subs)}"
        case t.End():
            return "end"
        case t.Whole():
            return ":"
    raise AssertionError(x)


def subscripts(subs: tuple[Any, ...]) -> str:
    return f"[{', '.join(map(written, subs))}]" if subs else ""


def iterator(x: t.Iterator) -> str:
    return x.name if x.range is None else f"{x.name} in {written(x.range)}"


def expression(text: str) -> t.Expression:
    (argument,) = parse_modification(Source("<test>", f"(x = {text})")).arguments
    assert isinstance(argument, t.ElementModification)
    assert argument.modification.value is not None
    return argument.modification.value


def only_class(text: str) -> t.Class:
    (found,) = parse(Source("<test>", text)).classes
    return found


def elements(text: str) -> list[Any]:
    body = only_class(f"model M {text} end M;").body
    assert isinstance(body, t.Long)
    return list(body.elements)


def error(text: str) -> str:
    with pytest.raises(TextError) as found:
        parse(Source("M.mo", text))
    return str(found.value)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("1 + 2*3 - 4", "((1 + (2 * 3)) - 4)"),
        ("-a^2", "(- (a ^ 2))"),
        ("-a*b", "(- (a * b))"),
        ("a - -b", None),
        ("2^-1", None),
        ("not a and b or c", "(((not a) and b) or c)"),
        ("a < b + 1 and c <> d", "((a < (b + 1)) and (c <> d))"),
        ("a .* b ./ c", "((a .* b) ./ c)"),
        ("if a then 1 elseif b then 2 else 3", "(if a then 1 elseif b then 2 else 3)"),
        ("1:2:n+1", "(1:2:(n + 1))"),
        ("{i*j for i in 1:3, j}", "{(i * j) for i in (1:3), j}"),
        ("sum(x[i] for i in v)", "sum(x[i] for i in v)"),
        ("f(1, b = {1, 2}, c = function g(k = 1))", "f(1, b = {1, 2}, c = function g(k = 1))"),
        ("[1, 2; a, b]", "[1, 2; a, b]"),
        (".A.b[1, :].c[end - 1]", ".A.b[1, :].c[(end - 1)]"),
        ("der(x)", "der(x)"),
        ("initial()", "initial()"),
        ("(a + b)[2]", "((a + b))[2]"),
        ("(a, , b)", "(a, , b)"),
        ("1e3 + .5 + 2. + 1.5E-2", "(((1000.0 + 0.5) + 2.0) + 0.015)"),
        (r'"a \"quote\" and \n"', None),
        ("'quoted name'.x", "'quoted name'.x"),
    ],
)
def test_expressions(text: str, expected: str | None) -> None:
    if expected is None and text in ("a - -b", "2^-1"):
        with pytest.raises(TextError, match="expected an expression"):
            expression(text)
        return
    found = written(expression(text))
    assert found == (expected or found)
    assert written(expression(found)) == found  # a printed tree is parsed to the same tree


def test_comments_and_strings_hide_what_looks_like_code() -> None:
    text = 'model M "a // b" // end M;\n Real x /* = 1 */ = 2 "/* x"; end M;'
    (x,) = elements(text.removeprefix("model M").removesuffix("end M;"))
    assert isinstance(x, t.Component)
    assert x.modification is not None
    assert written(x.modification.value) == "2"


def test_component_prefixes_and_sizes() -> None:
    x, y, z = elements(
        "flow parameter input Real[3] x[2](start = 1) = 5 if b, y; outer replaceable C z constrainedby D(k = 1);"
    )
    assert (x.name, x.connection, x.variability, x.causality) == ("x", "flow", "parameter", "input")
    assert list(map(written, x.dims)) == ["2", "3"]
    assert written(x.condition) == "b"
    assert (y.name, written(y.dims[0])) == ("y", "3")
    assert z.is_outer
    assert z.is_replaceable
    assert str(z.constraint.type) == "D"


def test_imports() -> None:
    assert [
        (str(one.name), one.alias, one.names)
        for one in elements("import A.B; import C = A.B; import A.*; import A.{B, C};")
    ] == [(".A.B", "B", ("B",)), ("A.B", "C", ("C",)), (".A", None, None), (".A", None, ("B", "C"))]


def test_modifications() -> None:
    found = parse_modification(
        Source(
            "<test>", "(each final a.b = 1, redeclare model X = Y(k = 2), break c, break connect(d, e), f(g = break))"
        )
    )
    first, second, third, fourth, last = found.arguments
    assert isinstance(first, t.ElementModification)
    assert (first.name, first.is_each, first.is_final) == (("a", "b"), True, True)
    assert isinstance(second, t.ElementReplacement)
    assert second.element.name == "X"
    assert isinstance(third, t.BreakModification)
    assert third.name == "c"
    assert isinstance(fourth, t.BreakModification)
    assert fourth.connect is not None
    assert isinstance(last, t.ElementModification)
    assert isinstance(last.modification.arguments[0], t.ElementModification)
    assert isinstance(last.modification.arguments[0].modification.value, t.NoValue)


def test_classes() -> None:
    found = only_class(
        'encapsulated partial package P type E = enumeration(a, b "text"); type V = Real[3](each unit = "m");'
        " protected redeclare model extends M(x = 1) end M; operator record R end R; expandable connector C end C;"
        ' pure function f external "C" y = g(x, 1) annotation(Library = "a"); end f; end P;'
    )
    assert found.is_encapsulated
    assert found.is_partial
    assert isinstance(found.body, t.Long)
    enumeration, vector, model, record, connector, function = found.body.elements
    assert isinstance(enumeration, t.Class)
    assert isinstance(enumeration.body, t.Enumeration)
    assert enumeration.body.literals == ("a", "b")
    assert isinstance(vector, t.Class)
    assert isinstance(vector.body, t.Short)
    assert isinstance(model, t.Class)
    assert isinstance(model.body, t.Long)
    assert model.body.is_class_extends
    assert model.is_protected
    assert isinstance(record, t.Class)
    assert record.kind == "operator record"
    assert isinstance(connector, t.Class)
    assert connector.kind == "expandable connector"
    assert isinstance(function, t.Class)
    assert isinstance(function.body, t.Long)
    assert function.body.external is not None
    assert (function.body.external.name, len(function.body.external.args)) == ("g", 2)


@pytest.mark.parametrize("declared", ['model B "text" end B', 'model B = C "text"', 'B c "text"'])
def test_a_constraint_follows_the_comment_of_its_declaration(declared: str) -> None:
    found = only_class(
        f'model M replaceable {declared} constrainedby D(x = 1) "text" annotation(Evaluate = true); end M;'
    )
    assert isinstance(found.body, t.Long)
    (one,) = found.body.elements
    assert isinstance(one, t.Class | t.Component)
    assert one.constraint is not None
    assert str(one.constraint.type) == "D"
    assert isinstance(one, t.Component) or one.annotation is not None


def test_equations_and_statements() -> None:
    found = only_class(
        "model M equation connect(a.b, c[1]); for i in 1:2 loop x[i] = 1; end for; if a then b = 1; elseif c then"
        " b = 2; else b = 3; end if; when c then d = pre(d); reinit(e, 1); elsewhen f then d = 2; end when; g(1);"
        " initial algorithm (a, , b) := f(x); while a loop break; end while; return; end M;"
    )
    assert isinstance(found.body, t.Long)
    equations, algorithm = found.body.sections
    kinds = [t.Connect, t.ForClause, t.IfClause, t.WhenClause, t.CallEquation]
    assert [type(one) for one in equations.clauses] == kinds
    assert (algorithm.is_algorithm, algorithm.is_initial) == (True, True)
    assert [type(one) for one in algorithm.clauses] == [t.Assignment, t.WhileClause, t.Return]


def test_annotations_are_kept_only_if_they_have_a_meaning() -> None:
    x, y = elements(
        'parameter Real x annotation(Dialog(group = "Evaluate (a"), Evaluate = true, Icon(g = {f(1), {2}}));'
        ' Real y annotation(Placement(extent = {{1, 2}}), Documentation(info = "<html>)</html>"));'
    )
    assert [one.name for one in x.annotation.arguments] == [("Evaluate",)]
    assert y.annotation is None


@pytest.mark.parametrize(
    ("text", "place", "message"),
    [
        ("model M\n  Real x = ;\nend M;", "2:12", "expected an expression, but found `;`"),
        ("model M\n  Real x\nend M;", "3:1", "expected `;` after the declaration, but found `end`"),
        ("model M\nequation\n  x := 1;\nend M;", "3:5", "expected `=`"),
        ("model M\nalgorithm\n  x = 1;\nend M;", "3:5", "assigns with `:=`"),
        ("model M\nend N;", "2:5", "expected M after `end`"),
        ('model M\n  Real x = "abc;\nend M;', "2:12", "has no closing"),
        ("model M\n  Real x = 1 ? 2;\nend M;", "2:14", "no meaning in Modelica"),
        ("model M\n  Real x annotation(a = (1);\nend M;", "2:20", "no closing parenthesis"),
        ("model M\n  Real x = a < b < c;\nend M;", "2:18", "needs parentheses"),
        ("model M\n  Real x = f(a = 1, 2);\nend M;", "2:21", "without a name"),
        ("model M\n  input output Real x;\nend M;", "2:9", "follows another one of its kind"),
        ("Real x;", "1:1", "expected a class definition"),
        ("model M", "1:8", "found the end of the text"),
        ("type E = enumeration(a, a);", "1:25", "occurs twice"),
    ],
)
def test_errors_name_place_and_expectation(text: str, place: str, message: str) -> None:
    found = error(text)
    assert found.startswith(f"M.mo:{place}: ")
    assert message in found


def test_errors_show_the_line_with_a_caret() -> None:
    *_, line, caret = error("model M\n  Real x = ;\nend M;").splitlines()
    assert line.index(";") == caret.index("^")


def test_trees_keep_their_places_in_the_cache() -> None:
    found = only_class("model M\n  Real x = 1;\nend M;")
    again = pickle.loads(pickle.dumps(found))
    assert _fields(again) == _fields(found)


def _fields(x: Any) -> Any:
    if isinstance(x, tuple):
        return tuple(map(_fields, x))
    if dataclasses.is_dataclass(x):
        return type(x).__name__, *(_fields(getattr(x, field.name)) for field in dataclasses.fields(x))
    return x
