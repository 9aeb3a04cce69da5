"""Reading of expressions and statements of the front end."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from . import expressions as e

Json = Mapping[str, Any]


class UnknownSyntax(Exception):
    """The front end wrote something that this reader does not know."""


def expression(node: Any) -> e.Expression:
    """An expression of the front end."""
    tag, body = _tagged(node)
    reader = _EXPRESSIONS.get(tag)
    if reader is None:
        raise UnknownSyntax(f"expression {tag}")
    return reader(body)


def optional(node: Any) -> e.Expression | None:
    return None if node is None or node in ("Empty",) else expression(node)


def _tagged(node: Any) -> tuple[str, Any]:
    if isinstance(node, str):
        return node, {}
    tags = [key for key in node if key != "span"]
    if len(tags) != 1:
        raise UnknownSyntax(f"a node with {tags}")
    return tags[0], node[tags[0]]


def _all(nodes: Sequence[Any]) -> tuple[e.Expression, ...]:
    return tuple(expression(node) for node in nodes)


def _literal(body: Json) -> e.Expression:
    value = body["value"]
    if isinstance(value, Mapping):
        tag, value = _tagged(value)
        if tag not in ("Integer", "Real", "Boolean", "String"):
            raise UnknownSyntax(f"literal {tag}")
        if tag == "Real":
            value = float(value)
    return e.Const(value)


def _ref(body: Json) -> e.Expression:
    return e.Ref(name_of(body["name"]), subscripts(body["subscripts"]))


def name_of(node: Any) -> str:
    return node["name"] if isinstance(node, Mapping) else node


def subscripts(nodes: Sequence[Any]) -> tuple[e.Expression, ...]:
    found: list[e.Expression] = []
    for node in nodes:
        tag, body = _tagged(node)
        if tag == "Index":
            found.append(e.Const(body["value"]))
        elif tag == "Colon":
            found.append(e.Colon())
        elif tag == "Expr":
            found.append(expression(body["expr"]))
        else:
            raise UnknownSyntax(f"subscript {tag}")
    return tuple(found)


def _indices(nodes: Sequence[Json]) -> tuple[tuple[str, e.Expression], ...]:
    return tuple((node.get("name") or node["ident"], expression(node["range"])) for node in nodes)


_ARRAYS = {"Array": "array", "Horizontal": "row", "Vertical": "column"}

_EXPRESSIONS: dict[str, Callable[[Any], e.Expression]] = {
    "Literal": _literal,
    "VarRef": _ref,
    "Unary": lambda b: e.Unary(b["op"], expression(b["rhs"])),
    "Binary": lambda b: e.Binary(b["op"], expression(b["lhs"]), expression(b["rhs"])),
    "BuiltinCall": lambda b: e.Builtin(b["function"], _all(b["args"])),
    "FunctionCall": lambda b: e.FunctionCall(name_of(b["name"]), _all(b["args"]), bool(b.get("is_constructor"))),
    "If": lambda b: e.If(tuple((expression(c), expression(v)) for c, v in b["branches"]), expression(b["else_branch"])),
    "Array": lambda b: e.ArrayOf(_all(b["elements"]), _ARRAYS[b["kind"]]),
    "ArrayComprehension": lambda b: e.Comprehension(expression(b["expr"]), _indices(b["indices"])),
    "Range": lambda b: e.RangeOf(expression(b["start"]), optional(b["step"]), expression(b["end"])),
    "Tuple": lambda b: e.TupleOf(tuple(optional(item) for item in b["elements"])),
    "FieldAccess": lambda b: e.FieldOf(expression(b["base"]), b["field"]),
    "Index": lambda b: e.Subscript(expression(b["base"]), subscripts(b["subscripts"])),
    "StringConversion": lambda b: e.Text(expression(b["value"])),
}


def statement(node: Any) -> e.Statement:
    """A statement of an algorithm or a function."""
    tag, body = _tagged(node)
    reader = _STATEMENTS.get(tag)
    if reader is None:
        raise UnknownSyntax(f"statement {tag}")
    return reader(body)


def body_of(nodes: Sequence[Any]) -> e.Body:
    return tuple(statement(node) for node in nodes)


def _target(comp: Json) -> e.Target:
    parts = comp["parts"]
    pieces = [part["ident"] + _brackets(part["subs"]) for part in parts[:-1]]
    return e.Target(".".join([*pieces, parts[-1]["ident"]]), subscripts(parts[-1]["subs"]))


def _brackets(subs: Sequence[Any]) -> str:
    if not subs:
        return ""
    found = subscripts(subs)
    if not all(isinstance(sub, e.Const) for sub in found):
        raise UnknownSyntax("a target with a variable subscript in its middle")
    return "[" + ",".join(str(sub.value) for sub in found if isinstance(sub, e.Const)) + "]"


def _call_statement(body: Json) -> e.Statement:
    call = e.FunctionCall(name_of(body["comp"]), _all(body["args"]))
    return e.Assign(tuple(None if node is None else _result(node) for node in body["outputs"]), call)


def _result(node: Any) -> e.Target | None:
    if isinstance(node, Mapping) and "parts" in node:
        return _target(node)
    found = optional(node)
    if found is None:
        return None
    if not isinstance(found, e.Ref):
        raise UnknownSyntax("a result that is not a variable")
    return e.Target(found.name, found.subs)


def assertion(body: Json) -> e.Assert:
    level = optional(body.get("level"))
    is_warning = level == e.Const(1) or (isinstance(level, e.Ref) and level.name.endswith("AssertionLevel.warning"))
    return e.Assert(expression(body["condition"]), expression(body["message"]), is_warning)


def _blocks(nodes: Sequence[Json]) -> tuple[tuple[e.Expression, e.Body], ...]:
    return tuple((expression(node["cond"]), body_of(node["stmts"])) for node in nodes)


_STATEMENTS: dict[str, Callable[[Any], e.Statement]] = {
    "Assignment": lambda b: e.Assign((_result(b["comp"]),), expression(b["value"])),
    "FunctionCall": _call_statement,
    "If": lambda b: e.IfStatement(_blocks(b["cond_blocks"]), body_of(b["else_block"] or ())),
    "For": lambda b: e.For(_indices(b["indices"]), body_of(b["equations"])),
    "While": lambda b: e.While(expression(b["block"]["cond"]), body_of(b["block"]["stmts"])),
    "When": lambda b: e.WhenClause(_blocks(b["blocks"])),
    "Assert": assertion,
    "Reinit": lambda b: e.Reinit(_state(b), expression(b["value"])),
    "Terminate": lambda b: e.Terminate(expression(b["message"])),
    "Return": lambda b: e.Return(),
    "Break": lambda b: e.BreakStatement(),
}


def _state(body: Json) -> str:
    if "state" in body:
        return body["state"]
    target = _target(body["variable"])
    return target.name


def _when_equation(node: Any) -> tuple[e.Statement, ...]:
    tag, body = _tagged(node)
    if tag == "Assign":
        return (e.Assign((e.Target(body["target"]),), expression(body["value"])),)
    if tag == "Reinit":
        return (e.Reinit(body["state"], expression(body["value"])),)
    if tag == "Assert":
        return (assertion(body),)
    if tag == "Terminate":
        return (e.Terminate(expression(body["message"])),)
    if tag == "FunctionCallOutputs":
        targets = tuple(None if t is None else e.Target(name_of(t)) for t in body["outputs"])
        return (e.Assign(targets, expression(body["function"])),)
    if tag == "Conditional":
        blocks = tuple((expression(c), _when_body(nodes)) for c, nodes in body["branches"])
        return (e.IfStatement(blocks, _when_body(body["else_branch"] or ())),)
    raise UnknownSyntax(f"when-equation {tag}: {body}")


def _when_body(nodes: Sequence[Any]) -> e.Body:
    return tuple(item for node in nodes for item in _when_equation(node))


def when_clause(node: Json) -> e.WhenClause:
    clauses = [node["first"], *node["else_when"]]
    return e.WhenClause(tuple((expression(c["condition"]), _when_body(c["equations"])) for c in clauses))
