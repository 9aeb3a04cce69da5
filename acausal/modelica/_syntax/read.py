"""Reading of the flat model of the front end."""

from collections.abc import Callable, Mapping
from typing import Any

from . import expressions as e
from .flat import Algorithm, FlatEquation, FlatFunction, FlatModelica, FlatVariable, Formal, SourcePlace
from .read_expressions import Json, assertion, body_of, expression, name_of, optional, subscripts, when_clause

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


def _first_tag(node: Any) -> str:
    return node if isinstance(node, str) else next(iter(node))


def _variability(node: Any) -> str:
    tag = _first_tag(node)
    return {"Parameter": "parameter", "Constant": "constant", "Discrete": "discrete"}.get(tag, "continuous")


def _variable(node: Json, type_name: str, place: _Places) -> FlatVariable:
    causality = node["causality"]
    return FlatVariable(
        name=node["name"],
        type=type_name,
        variability=_variability(node["variability"]),
        causality="" if causality == "Empty" else _first_tag(causality).lower(),
        dims=tuple(node["dims"]),
        binding=optional(node["binding"]),
        start=optional(node["start"]),
        fixed=tuple(node["fixed"] or ()),
        min=optional(node["min"]),
        max=optional(node["max"]),
        nominal=optional(node["nominal"]),
        unit=node["unit"],
        select=node["state_select"],
        is_flow=node["flow"],
        is_stream=node["stream"],
        is_overconstrained=node["is_overconstrained"],
        evaluate=node["evaluate"],
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
    outputs = tuple(dict.fromkeys(name_of(item) for item in node["outputs"]))
    origin = str(node["origin"]).removeprefix("algorithm from ")
    return Algorithm(body_of(node["statements"]), outputs, origin, place(node.get("span")))


def _formal(node: Json) -> Formal:
    stated = subscripts(node["shape_expr"])
    # A type such as `type Vector = Real[3]` has sizes of its own, which are not among those stated here.
    sizes = (node.get("effective_type") or {}).get("dimensions") or ()
    inherited = tuple(e.Const(size) if size > 0 else e.Colon() for size in sizes[len(stated) :])
    return Formal(node["name"], node["type_name"], optional(node["default"]), (*stated, *inherited))


def _function(node: Json, place: _Places) -> FlatFunction:
    external = node["external"]
    return FlatFunction(
        node["name"],
        tuple(_formal(item) for item in node["inputs"]),
        tuple(_formal(item) for item in node["outputs"]),
        tuple(_formal(item) for item in node["locals"]),
        body_of(node["body"]),
        bool(node["is_constructor"]),
        external["function_name"] if external else None,
        place(node.get("span")),
    )


def _selecting(node: Json | None) -> tuple[e.Expression, ...]:
    return () if node is None else (*map(e.Ref, node["names"]), *map(expression, node["expressions"]))


def flat_model(node: Json, name: str, find: Find | None = None) -> FlatModelica:
    """The flat model of the front end; `UnknownSyntax` for what this reader does not know."""
    place = _Places(find)
    types = node["variable_type_names"]
    return FlatModelica(
        name=name,
        variables={key: _variable(item, types.get(key, "Real"), place) for key, item in node["variables"].items()},
        equations=tuple(_equation(item, place) for item in node["equations"]),
        initial_equations=tuple(_equation(item, place) for item in node["initial_equations"]),
        asserts=tuple(assertion(item) for item in node["assert_equations"]),
        initial_asserts=tuple(assertion(item) for item in node["initial_assert_equations"]),
        algorithms=tuple(_algorithm(item, place) for item in node["algorithms"]),
        initial_algorithms=tuple(_algorithm(item, place) for item in node["initial_algorithms"]),
        whens=tuple(when_clause(item) for item in node["when_chains"]),
        functions={key: _function(item, place) for key, item in node["functions"].items()},
        enumerations=node["enum_literal_ordinals"],
        connectors=tuple(node["top_level_connectors"]),
        selecting=_selecting(node.get("selecting")),
    )
