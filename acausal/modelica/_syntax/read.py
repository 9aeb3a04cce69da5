"""Reading the flat model of the front end."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from . import expressions as e
from .flat import Algorithm, FlatEquation, FlatFunction, FlatModelica, FlatVariable, Formal, SourcePlace

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


def _optional(node: Any) -> e.Expression | None:
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
    return e.Ref(_name(body["name"]), _subscripts(body["subscripts"]))


def _name(node: Any) -> str:
    return node["name"] if isinstance(node, Mapping) else node


def _subscripts(nodes: Sequence[Any]) -> tuple[e.Expression, ...]:
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
    "FunctionCall": lambda b: e.FunctionCall(_name(b["name"]), _all(b["args"]), bool(b.get("is_constructor"))),
    "If": lambda b: e.If(tuple((expression(c), expression(v)) for c, v in b["branches"]), expression(b["else_branch"])),
    "Array": lambda b: e.ArrayOf(_all(b["elements"]), _ARRAYS[b["kind"]]),
    "ArrayComprehension": lambda b: e.Comprehension(expression(b["expr"]), _indices(b["indices"])),
    "Range": lambda b: e.RangeOf(expression(b["start"]), _optional(b["step"]), expression(b["end"])),
    "Tuple": lambda b: e.TupleOf(tuple(_optional(item) for item in b["elements"])),
    "FieldAccess": lambda b: e.FieldOf(expression(b["base"]), b["field"]),
    "Index": lambda b: e.Subscript(expression(b["base"]), _subscripts(b["subscripts"])),
    "StringConversion": lambda b: e.Text(expression(b["value"])),
}


def statement(node: Any) -> e.Statement:
    """A statement of an algorithm or a function."""
    tag, body = _tagged(node)
    reader = _STATEMENTS.get(tag)
    if reader is None:
        raise UnknownSyntax(f"statement {tag}")
    return reader(body)


def _body(nodes: Sequence[Any]) -> e.Body:
    return tuple(statement(node) for node in nodes)


def _target(comp: Json) -> e.Target:
    parts = comp["parts"]
    pieces = [part["ident"] + _brackets(part["subs"]) for part in parts[:-1]]
    return e.Target(".".join([*pieces, parts[-1]["ident"]]), _subscripts(parts[-1]["subs"]))


def _brackets(subs: Sequence[Any]) -> str:
    if not subs:
        return ""
    found = _subscripts(subs)
    if not all(isinstance(sub, e.Const) for sub in found):
        raise UnknownSyntax("a target with a variable subscript in its middle")
    return "[" + ",".join(str(sub.value) for sub in found if isinstance(sub, e.Const)) + "]"


def _call_statement(body: Json) -> e.Statement:
    call = e.FunctionCall(_name(body["comp"]), _all(body["args"]))
    return e.Assign(tuple(None if node is None else _result(node) for node in body["outputs"]), call)


def _result(node: Any) -> e.Target | None:
    if isinstance(node, Mapping) and "parts" in node:
        return _target(node)
    found = _optional(node)
    if found is None:
        return None
    if not isinstance(found, e.Ref):
        raise UnknownSyntax("a result that is not a variable")
    return e.Target(found.name, found.subs)


def _assert(body: Json) -> e.Assert:
    level = _optional(body.get("level"))
    is_warning = level == e.Const(1) or (isinstance(level, e.Ref) and level.name.endswith("AssertionLevel.warning"))
    return e.Assert(expression(body["condition"]), expression(body["message"]), is_warning)


def _blocks(nodes: Sequence[Json]) -> tuple[tuple[e.Expression, e.Body], ...]:
    return tuple((expression(node["cond"]), _body(node["stmts"])) for node in nodes)


_STATEMENTS: dict[str, Callable[[Any], e.Statement]] = {
    "Assignment": lambda b: e.Assign((_target(b["comp"]),), expression(b["value"])),
    "FunctionCall": _call_statement,
    "If": lambda b: e.IfStatement(_blocks(b["cond_blocks"]), _body(b["else_block"] or ())),
    "For": lambda b: e.For(_indices(b["indices"]), _body(b["equations"])),
    "While": lambda b: e.While(expression(b["block"]["cond"]), _body(b["block"]["stmts"])),
    "When": lambda b: e.WhenClause(_blocks(b["blocks"])),
    "Assert": _assert,
    "Reinit": lambda b: e.Reinit(_state(b), expression(b["value"])),
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
        return (_assert(body),)
    if tag == "Terminate":
        return (e.Terminate(expression(body["message"])),)
    if tag == "FunctionCallOutputs":
        targets = tuple(None if t is None else e.Target(_name(t)) for t in body["outputs"])
        return (e.Assign(targets, expression(body["function"])),)
    if tag == "Conditional":
        blocks = tuple((expression(c), _when_body(nodes)) for c, nodes in body["branches"])
        return (e.IfStatement(blocks, _when_body(body["else_branch"])),)
    raise UnknownSyntax(f"when-equation {tag}: {body}")


def _when_body(nodes: Sequence[Any]) -> e.Body:
    return tuple(item for node in nodes for item in _when_equation(node))


def _when(node: Json) -> e.WhenClause:
    clauses = [node["first"], *node["else_when"]]
    return e.WhenClause(tuple((expression(c["condition"]), _when_body(c["equations"])) for c in clauses))


Find = Callable[[int, int], tuple[str, int] | None]  # file and line of an offset in a text of the front end


class _Places:
    """Places of spans. Lines of a text are counted once for each offset."""

    def __init__(self, find: Find | None) -> None:
        self._find = find
        self._known: dict[tuple[int, int], SourcePlace | None] = {}

    def __call__(self, span: Any) -> SourcePlace | None:
        if self._find is None or not isinstance(span, Mapping):
            return None
        key = (span["source"], span["start"])
        if key not in self._known:
            found = self._find(*key)
            self._known[key] = SourcePlace(*found) if found else None
        return self._known[key]


def _variability(node: Any) -> str:
    tag = node if isinstance(node, str) else next(iter(node))
    return {"Parameter": "parameter", "Constant": "constant", "Discrete": "discrete"}.get(tag, "continuous")


def _variable(node: Json, type_name: str, is_final: bool, place: _Places) -> FlatVariable:
    causality = node["causality"]
    return FlatVariable(
        name=node["name"],
        type=type_name,
        variability=_variability(node["variability"]),
        causality=("" if causality == "Empty" else causality if isinstance(causality, str) else next(iter(causality))),
        dims=tuple(node["dims"]),
        binding=_optional(node["binding"]),
        start=_optional(node["start"]),
        fixed=tuple(node["fixed"] or ()),
        min=_optional(node["min"]),
        max=_optional(node["max"]),
        nominal=_optional(node["nominal"]),
        unit=node["unit"],
        display_unit=node["display_unit"],
        description=node["description"],
        select=node["state_select"],
        is_flow=node["flow"],
        is_final=is_final,
        is_protected=node["is_protected"],
        evaluate=node["evaluate"],
        is_discrete=node["is_discrete_type"],
        is_expandable=node["from_expandable_connector"],
        place=place(node["source_span"]),
    )


_ORIGINS = {"Connection": "connection", "FlowSum": "flows", "UnconnectedFlow": "open flow"}


def _equation(node: Json, place: _Places) -> FlatEquation:
    origin = node["origin"]
    tag = origin if isinstance(origin, str) else next(iter(origin))
    component = origin[tag].get("component", "") if isinstance(origin, Mapping) else ""
    return FlatEquation(
        expression(node["residual"]), component, _ORIGINS.get(tag, "component"), place(node.get("span"))
    )


def _algorithm(node: Json, place: _Places) -> Algorithm:
    outputs = tuple(dict.fromkeys(_name(item) for item in node["outputs"]))
    origin = str(node["origin"]).removeprefix("algorithm from ")
    return Algorithm(_body(node["statements"]), outputs, origin, place(node.get("span")))


def _formal(node: Json) -> Formal:
    return Formal(node["name"], node["type_name"], _optional(node["default"]), _subscripts(node["shape_expr"]))


def _function(node: Json, place: _Places) -> FlatFunction:
    external = node["external"]
    return FlatFunction(
        node["name"],
        tuple(_formal(item) for item in node["inputs"]),
        tuple(_formal(item) for item in node["outputs"]),
        tuple(_formal(item) for item in node["locals"]),
        _body(node["body"]),
        bool(node["is_constructor"]),
        external["function_name"] if external else None,
        place(node.get("span")),
    )


def flat_model(node: Json, name: str, find: Find | None = None) -> FlatModelica:
    """The flat model of the front end; `UnknownSyntax` for what this reader does not know."""
    place = _Places(find)
    types, finals = node["variable_type_names"], node["variable_final_flags"]
    return FlatModelica(
        name=name,
        variables={
            key: _variable(item, types.get(key, "Real"), bool(finals.get(key)), place)
            for key, item in node["variables"].items()
        },
        equations=tuple(_equation(item, place) for item in node["equations"]),
        initial_equations=tuple(_equation(item, place) for item in node["initial_equations"]),
        asserts=tuple(_assert(item) for item in node["assert_equations"]),
        algorithms=tuple(_algorithm(item, place) for item in node["algorithms"]),
        initial_algorithms=tuple(_algorithm(item, place) for item in node["initial_algorithms"]),
        whens=tuple(_when(item) for item in node["when_chains"]),
        functions={key: _function(item, place) for key, item in node["functions"].items()},
        enumerations=node["enum_literal_ordinals"],
        records={key: (item["type_name"], tuple(item["dims"])) for key, item in node["record_instances"].items()},
    )
