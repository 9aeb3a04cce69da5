"""Functions whose bodies the last pass of rumoca refuses, hidden from it.

This pass does not look into the branches of an `if` that are never run. The body goes into a function of its own, which
is only called there; the other branch calls an external function without a body. So nothing evaluates the function in
the front end. The flat model holds the true body, which `restored` puts back.
"""

import json
import re
from collections.abc import Sequence
from typing import Any

from .scan import masked, statement_end

BODY, OUTSIDE = "acausalBody", "acausalOutside"
_CALLED = re.compile(rf'"name": "([\w.]*\b{BODY}_\w+)"')
_FUNCTION = re.compile(r"(?<!operator )\bfunction\s+(\w+)\b(?!\s*=)(?!\s*extends\s+\w)")
_SECTION = re.compile(r"(?<![\w.])(algorithm|external)(?!\w)")
_END = re.compile(r"(?<![\w.])annotation\b")
_BRACKETS = 4 * (r"\([^()]*\)", r"\[[^\[\]]*\]", r"\{[^{}]*\}")
_FORMAL = re.compile(r"\b(input|output)\s+[\w.]+\s+(\w+[^;]*);")
ALL = ("*",)


def hidden(text: str, names: Sequence[str], place: str) -> str:
    """The text with the bodies of some functions hidden, or of all, under names that hold `place`, which no other text
    has.
    """
    known = _FUNCTION.findall(masked(text))
    for name in [name for name in known if known.count(name) == 1] if tuple(names) == ALL else names:
        text = _hidden(text, name, place)
    return text


def _hidden(text: str, name: str, place: str) -> str:
    """The text with the body of one function hidden; as it is if this function is external or has no results."""
    plain = masked(text)
    begin = re.search(rf"\bfunction\s+{name}\b", plain)
    if begin is None or (end := re.compile(rf"\bend\s+{name}\s*;").search(plain, begin.end())) is None:
        return text
    section = list(_SECTION.finditer(plain, begin.end(), end.start()))
    if not section or section[-1][0] == "external":
        return text
    notes = list(_END.finditer(plain, section[-1].end(), end.start()))
    last = notes[-1].start() if notes else end.start()
    head, body = text[begin.end() : section[-1].start()], text[section[-1].end() : last]
    formals = _formals(plain[begin.end() : section[-1].start()])
    inputs, outputs = (", ".join(other for kind, other in formals if kind == which) for which in ("input", "output"))
    if not outputs:
        return text
    inner, outside = f"{BODY}_{place}_{name}", f"{OUTSIDE}_{place}_{name}"
    results = _results(text[begin.end() : section[-1].start()], plain[begin.end() : section[-1].start()], inputs)
    arguments, given = (outputs, "") if results else (", ".join(other for _, other in formals), inputs)
    new = f"""function {name}{head}
protected
  function {inner}{head} algorithm {body} end {inner};
  pure function {outside}{results or head} external "C" {outside}({arguments}); end {outside};
algorithm
  if false then ({outputs}) := {inner}({inputs}); else ({outputs}) := {outside}({given}); end if;
  """
    return text[: begin.start()] + new + text[last:]


def _results(head: str, plain: str, inputs: str) -> str | None:
    """The declarations of the results alone; None if they depend on the arguments."""
    found = [head[start : statement_end(plain, start)] for start in _starts(plain)]
    names = "|".join(inputs.split(", "))
    return None if names and any(re.search(rf"\b({names})\b", masked(one)) for one in found) else " " + " ".join(found)


def _starts(plain: str) -> list[int]:
    own = re.sub(r"\bfunction\s+(\w+)\b.*?\bend\s+\1\s*;", lambda inner: " " * len(inner[0]), plain, flags=re.S)
    return [found.start() for found in re.finditer(r"(?<![\w.])(?:import|output)\s", own)]


def _formals(head: str) -> list[tuple[str, str]]:
    """The kinds and names of the arguments in the head of a function, without strings and comments."""
    head = re.sub(r"\bfunction\s+(\w+)\b.*?\bend\s+\1\s*;", "", head, flags=re.S)  # of functions inside of it
    for pattern in _BRACKETS:
        head = re.sub(pattern, "", head)
    return [(kind, name.split()[0]) for kind, names in _FORMAL.findall(head) for name in names.split(",")]


def restored(content: dict[str, Any]) -> dict[str, Any]:
    """The flat model with the bodies put back."""
    functions = content["functions"]
    added = {name for name in functions if name.rpartition(".")[2].startswith((BODY, OUTSIDE))}
    for name in functions.keys() - added:
        for called in _CALLED.findall(json.dumps(functions[name]["body"])):
            functions[name] |= {part: functions[called][part] for part in ("body", "locals")}
    return {**content, "functions": {name: functions[name] for name in functions if name not in added}}
