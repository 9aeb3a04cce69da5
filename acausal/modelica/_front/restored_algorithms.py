"""Algorithms of the flat model, which `algorithms.py` wrote as equations, put back."""

from typing import Any

from .algorithms import MARK


def restored(content: dict[str, Any]) -> dict[str, Any]:
    """The flat model with the algorithms put back."""
    for kind in ("", "initial_"):
        rest = []
        for equation in content[f"{kind}equations"]:
            body = _marked(equation["residual"])
            if body is None:
                rest.append(equation)
                continue
            statements = _statements(body)
            origin = equation["origin"]
            component = origin["ComponentEquation"]["component"] if "ComponentEquation" in origin else ""
            content[f"{kind}algorithms"].append(
                {
                    "statements": statements,
                    "outputs": [],
                    "origin": f"algorithm from {component}",
                    "span": equation["span"],
                }
            )
        content[f"{kind}equations"] = rest
    content["when_chains"] = [one for one in content["when_chains"] if not _is_marked(one["first"]["condition"])]
    return content


def _is_marked(condition: Any) -> bool:
    """Whether a when-clause belongs to an algorithm."""
    sides = condition.get("Binary")
    return bool(sides) and sides["lhs"].get("Literal", {}).get("value") == {"String": MARK}


def _marked(residual: Any) -> Any:
    """The statements of an equation that was an algorithm; None for any other."""
    sides = residual.get("Binary") if isinstance(residual, dict) else None
    if not sides or not isinstance(sides["lhs"], dict):
        return None
    literal = sides["lhs"].get("Literal")
    return sides["rhs"] if literal and literal["value"] == {"String": MARK} else None


def _elements(node: Any) -> list[Any]:
    return node["Array"]["elements"]


def _statements(node: Any) -> list[Any]:
    """The statements that an expression stands for."""
    if "Literal" in node:
        return []
    if "If" in node:
        branches, otherwise = node["If"]["branches"], node["If"]["else_branch"]
        blocks = [{"cond": condition, "stmts": _statements(body)} for condition, body in branches]
        return [{"If": {"cond_blocks": blocks, "else_block": _statements(otherwise)}}]
    name, argument = _call(node)
    if name == "Ndims":
        value, *targets = _elements(argument)
        return [_assignment(value, targets)]
    if name == "Abs":
        return [_controlling(argument)]
    if name == "Sign":
        first, *rest = _elements(_call(argument)[1])
        return [
            {"Reinit": {"state": first["VarRef"]["name"]["name"], "value": rest[0]}}
            if rest
            else {"Terminate": {"message": first}}
        ]
    return [statement for item in _elements(argument) for statement in _loop_or_statement(item)]


def _loop_or_statement(node: Any) -> list[Any]:
    if "BuiltinCall" not in node or _call(node)[0] != "Sum":
        return _statements(node)
    turns = _turns(_call(node)[1])
    return [_once(turns)] if _breaks(turns) else turns


def _turns(node: Any) -> list[Any]:
    """The statements of a loop, or those of its turns one after the other."""
    if "ArrayComprehension" in node:
        loop = node["ArrayComprehension"]
        return [{"For": {"indices": loop["indices"], "equations": _statements(loop["expr"])}}]
    if "Array" in node:
        return [statement for item in _elements(node) for statement in _turns(item)]
    return _statements(node)


def _breaks(body: list[Any]) -> bool:
    """Whether statements leave the loop that they are in."""
    blocks = [one["If"] for one in body if "If" in one]
    inner = [block["stmts"] for found in blocks for block in found["cond_blocks"]]
    return "Break" in body or any(map(_breaks, [*inner, *(found["else_block"] for found in blocks)]))


def _once(body: list[Any]) -> Any:
    """A loop with the turns of a loop one after the other, as its only turn, which `break` can leave."""
    one = {"Literal": {"value": {"Integer": 1}}}
    turn = {"name": "turn", "range": {"Range": {"start": one, "step": None, "end": one}}}
    return {"For": {"indices": [turn], "equations": body}}


def _call(node: Any) -> tuple[str, Any]:
    """The name of a function, and its first argument."""
    return node["BuiltinCall"]["function"], node["BuiltinCall"]["args"][0]


def _controlling(node: Any) -> Any:
    """The statement that a call of `abs` stands for."""
    if "Literal" in node:
        return "Break" if node["Literal"]["value"] == {"Integer": 1} else "Return"
    if "If" in node:
        condition, body = node["If"]["branches"][0]
        return {"While": {"block": {"cond": condition, "stmts": _statements(body)}}}
    parts = _elements(_call(node)[1])
    if _call(node)[0] == "Ndims":
        return {"Assert": {"condition": parts[0], "message": parts[1], "level": (parts[2:] or [None])[0]}}
    conditions = [_elements(_call(part)[1])[0] for part in parts[::2]]
    blocks = zip(conditions, map(_statements, parts[1::2]), strict=True)
    return {"When": {"blocks": [{"cond": condition, "stmts": body} for condition, body in blocks]}}


def _assignment(value: Any, targets: list[Any]) -> Any:
    if len(targets) == 1:
        return {"Assignment": {"comp": targets[0], "value": value}}
    call = value["FunctionCall"]
    outputs = [None if "Literal" in target else target for target in targets]
    return {"FunctionCall": {"comp": call["name"], "args": call["args"], "outputs": outputs}}
