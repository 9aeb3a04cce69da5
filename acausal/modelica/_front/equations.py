"""Equations hidden from the last pass of rumoca, which refuses what its own solvers cannot run.

It does not look into a branch of an `if` whose condition is a constant that is false. So each equation section has
such a constant, and `a = b` is written as `0.0 = if constant then ndims({a, b}) else 0.0`, where `ndims` stands for
any function of arguments of any type. An `if true` around it keeps the pass from handling the equations of a loop as
one. The flat model holds the branch, which `restored` turns into the equation again. Lines keep their numbers.
"""

import re
import zlib
from typing import Any, Literal, TypeAlias

from . import algorithms, connections, restored_algorithms
from .scan import COMMENT, class_kinds, masked, statement_end

Hidden: TypeAlias = Literal["", "algorithms", "equations", "connections"]  # each hides what the one before it hides
NEVER = "acausalNever"
_START = re.compile(r"(?<![\w.])(?:initial\s+)?equation(?!\w)")
_BLOCK = re.compile(r"(for|if|elseif|when|elsewhen)\b")
_OPENED = {"for": "loop", "if": "then", "elseif": "then", "when": "then", "elsewhen": "then"}
_PLAIN = re.compile(r"else\b|end\s+(?:for|if|when)\s*;")
_OTHER = re.compile(r"(?:public|protected|algorithm|equation|initial|end|external)\b")
_COMPLEX = r"(?:Complex|(?:Modelica\.Units\.)?SI\.Complex\w+)"
_REAL = r"(?:Real|(?:Modelica\.Units\.)?SI\.\w+)"
_VALUE = r'(?P<value>[^;"]*?)(?P<rest>\s*(?:"[^"]*"[^;"]*)?;)'
_BINDING = re.compile(
    rf"^(?P<head>[ \t]*(?:output\s+)?(?:{_COMPLEX}|{_REAL})(?:\[[^\]]*\])?"
    r"\s+(?P<name>\w+)(?:\[[^\]]*\])?\s*(?:\([^()]*\))?)"
    rf"\s*=\s*{_VALUE}",
    re.M,
)
_PARAMETER = re.compile(
    rf"^(?P<space>\s*)(?P<head>(?:final\s+)?parameter\s+{_COMPLEX}\s+\w+\s*=\s*)(?!\s*Complex\s*\(){_VALUE}", re.M
)
_STATE = re.compile(r"\bder\(\s*[\w.]+(?:\[[^\[\]]*\])?\s*\)")
_INTERVAL = re.compile(r"(\bsample\s*\([^,()]*,)([^,()]*)\)")
_EQUALS = re.compile(r"(?<![<>=:])=(?!=)")


def hidden(text: str, place: str, what: Hidden = "equations") -> str:
    """A text with its algorithms hidden, and its connections in order. If `what` says so, its equations are hidden too,
    except those in when-equations, and its complex bindings; then its connections of signals.

    `place` names the text: the constants of different texts have different names.
    """
    if not what:
        return text
    hides_equations = what != "algorithms"
    if hides_equations and re.search(r"\bComplex", masked(text)):
        text = _without_bindings(text)
        text = _PARAMETER.sub(lambda found: _parameter(found, place), text)
    text = algorithms.hidden(text)
    text = connections.as_equations(text) if what == "connections" else connections.in_order(text)
    plain = masked(text)
    pieces, at = [], 0
    for start in _START.finditer(plain):
        if start.start() >= at:
            name = _never(place, start.start())
            pieces.append(f"{text[at : start.start()]}protected constant Boolean {name} = false; {start[0]}")
            section, at = _section(text, plain, start.end(), name, hides_equations)
            pieces += section
    return "".join([*pieces, text[at:]])


def _never(place: str, at: int) -> str:
    return f"{NEVER}{zlib.crc32(f'{place} {at}'.encode()):x}"


def _without_bindings(text: str) -> str:
    """A text with complex numbers: the bindings of variables of its models become equations."""
    kinds = class_kinds(masked(text))

    def unbound(found: re.Match[str]) -> str:
        value = found["value"]
        is_conditional = re.search(r"\bif\b", value) and not re.search(r"\bthen\b", value)
        if kinds(found.start()) not in ("model", "block") or is_conditional or not re.search("[a-zA-Z]", value):
            return found[0]
        return f"{found['head']}{found['rest']} equation {found['name']} = {value}; public"

    return _BINDING.sub(unbound, text)


def _parameter(found: re.Match[str], place: str) -> str:
    """The declaration of a complex parameter, with its value hidden."""
    name = _never(place, found.start())
    value = f"if {name} then {found['value']} else Complex(0)"
    return f"{found['space']}constant Boolean {name} = false; {found['head']}{value}{found['rest']}"


def _section(text: str, plain: str, at: int, never: str, hides_equations: bool) -> tuple[list[str], int]:
    """The pieces of an equation section that begins at `at`, and its end."""
    pieces, whens = [], 0
    while True:
        begin = at + re.compile(r"\s*").match(plain, at).end() - at  # pyright: ignore[reportOptionalMemberAccess]
        pieces.append(text[at:begin])
        at = begin
        if block := _BLOCK.match(plain, at):
            end = _keyword(plain, at, _OPENED[block[1]])
            whens += block[1] == "when"
            pieces.append(_condition(text[at:end], never))
        elif other := _PLAIN.match(plain, at):
            end = other.end()
            whens -= "when" in other[0]
            pieces.append(text[at:end])
        elif at == len(plain) or _OTHER.match(plain, at):
            return pieces, at
        else:
            end = statement_end(plain, at)
            hides = not whens and (hides_equations or text.startswith(algorithms.MARKED, at))
            pieces.append(_equation(text[at:end], plain[at:end], never) if hides else text[at:end])
        at = end


def _keyword(plain: str, at: int, word: str) -> int:
    """The end of the first such word outside of brackets."""
    depth = 0
    for token in re.compile(rf"[(\[{{]|[)\]}}]|\b{word}\b").finditer(plain, at):
        depth += (token[0] in "([{") - (token[0] in ")]}")
        if depth == 0 and token[0] == word:
            return token.end()
    return len(plain)


def _condition(text: str, never: str) -> str:
    """A condition with the intervals of its samples hidden, which the pass wants as ratios of integers."""
    return _INTERVAL.sub(rf"\1 if {never} then \2 else 1.0)", text)


def _equation(text: str, plain: str, never: str) -> str:
    """One statement of an equation section, hidden if it is an equation."""
    equals = _top_level(plain, _EQUALS)
    if equals is None or re.match(r"annotation\b", plain):
        return text
    comment = COMMENT.search(plain[:-1], equals + 1)
    last = len(plain) - 1 if comment is None else comment.start()
    left, right = text[:equals].rstrip(), text[equals + 1 : last].strip()
    state = _STATE.search(plain)
    carrier = re.sub(r"\s", "", state[0]) if state else "0.0"
    gap = "\n" * (text[:last].count("\n") - left.count("\n") - right.count("\n"))
    return (
        f"if true then {carrier} = if {never} then ndims({{{left}, {right}}}) else {carrier}{gap}{text[last:]} end if;"
    )


def _top_level(plain: str, pattern: re.Pattern[str]) -> int | None:
    depth = 0
    for token in re.compile(rf"[(\[{{]|[)\]}}]|{pattern.pattern}").finditer(plain):
        if token[0] in "([{":
            depth += 1
        elif token[0] in ")]}":
            depth -= 1
        elif depth == 0:
            return token.start()
    return None


def restored(content: dict[str, Any]) -> dict[str, Any]:
    """The flat model with the equations put back, and without the constants that hid them."""
    found = connections.restored(restored_algorithms.restored(_restored(content)))
    for part in ("variables", "variable_type_names", "variable_final_flags"):
        found[part] = {name: value for name, value in found[part].items() if not _is_never(name)}
    return found


def _restored(node: Any) -> Any:
    if isinstance(node, list):
        return [_restored(item) for item in node]
    if not isinstance(node, dict):
        return node
    if (sides := _sides(node.get("Binary"))) is not None:
        left, right = (_restored(side) for side in sides)
        return {"Binary": {"op": "Sub", "lhs": left, "rhs": right, "span": node["Binary"]["span"]}}
    if (value := _branch(node)) is not None:
        return _restored(value)
    return {key: _restored(value) for key, value in node.items()}


def _sides(binary: Any) -> list[Any] | None:
    """The two sides of a hidden equation; None for anything else."""
    value = binary and binary["op"] == "Sub" and _branch(binary["rhs"])
    return value["BuiltinCall"]["args"][0]["Array"]["elements"] if value else None


def _branch(node: Any) -> Any:
    """The hidden branch of an `if`; None for anything else."""
    branches = node["If"].get("branches") if isinstance(node, dict) and isinstance(node.get("If"), dict) else None
    if not branches or "VarRef" not in branches[0][0] or not _is_never(branches[0][0]["VarRef"]["name"]["name"]):
        return None
    return branches[0][1]


def _is_never(name: str) -> bool:
    return name.rpartition(".")[2].startswith(NEVER)
