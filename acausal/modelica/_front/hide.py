"""Functions whose bodies the last pass of rumoca refuses, hidden from it.

This pass does not look into the branches of an `if` that are never run. The body goes into a function of its own, which
is only called there; the other branch calls an external function without a body. So nothing evaluates the function in
the front end. The flat model holds the true body, which `shown` puts back.
"""

import json
import re
from typing import Any

BODY, OUTSIDE = "acausalBody", "acausalOutside"
_CALLED = re.compile(rf'"name": "([\w.]*\b{BODY}_\w+)"')
_SECTION = re.compile(r"^\s*(algorithm|external)\b", re.M)
_END = re.compile(r"^[ \t]*annotation\b", re.M)
_PLAIN = (r'"(?:[^"\\\\]|\\\\.)*"', r"//[^\n]*", r"/\*.*?\*/", *(4 * (r"\([^()]*\)", r"\[[^\[\]]*\]", r"\{[^{}]*\}")))
_FORMAL = re.compile(r"\b(input|output)\s+[\w.]+\s+(\w+[^;]*);")


def hidden(text: str, name: str, place: str) -> str:
    """The text with the body of the function `name` hidden, under names that hold `place`, which no other text has.

    Raises `ValueError` if it has no such function.
    """
    found = re.search(rf"\bfunction\s+{name}\b(?P<rest>.*?)\bend\s+{name}\s*;", text, re.S)
    if found is None:
        raise ValueError(f"no function {name}")
    rest = found["rest"]
    start = list(_SECTION.finditer(rest))[-1]
    head, body = rest[: start.start()], rest[start.end() :]
    end = list(_END.finditer(body))
    last = end[-1].start() if end else len(body)
    annotation, body = body[last:], body[:last]
    formals = _formals(head)
    inputs, outputs = (", ".join(other for kind, other in formals if kind == which) for which in ("input", "output"))
    arguments = ", ".join(other for _, other in formals)
    body_name, outside = f"{BODY}_{place}_{name}", f"{OUTSIDE}_{place}_{name}"
    new = f"""function {name}{head}
protected
  function {body_name}{head}
algorithm
{body}
  end {body_name};
  pure function {outside}{head}
    external "C" {outside}({arguments});
  end {outside};
algorithm
  if false then ({outputs}) := {body_name}({inputs}); else ({outputs}) := {outside}({inputs}); end if;
{annotation}end {name};"""
    return text[: found.start()] + new + text[found.end() :]


def _formals(head: str) -> list[tuple[str, str]]:
    """The kinds and names of the arguments that the head of a function declares."""
    for pattern in _PLAIN:  # comments, and what stands in brackets
        head = re.sub(pattern, "", head, flags=re.S)
    return [(kind, name.split()[0]) for kind, names in _FORMAL.findall(head) for name in names.split(",")]


def shown(content: dict[str, Any]) -> dict[str, Any]:
    """The flat model with the bodies put back."""
    functions = content["functions"]
    added = {name for name in functions if name.rpartition(".")[2].startswith((BODY, OUTSIDE))}
    for name in functions.keys() - added:
        for called in _CALLED.findall(json.dumps(functions[name]["body"])):
            functions[name] |= {part: functions[called][part] for part in ("body", "locals")}
    return {**content, "functions": {name: functions[name] for name in functions if name not in added}}
