"""Connections of signals, as far as the last pass of rumoca can direct them.

rumoca writes the connections of a signal as a chain of equations, in the order in which the connections name its ends.
The pass directs each chain from what sets the signal. It directs the elements of an array as one, so it refuses a
chain that leads from one array to another if a second chain leads back. With connections sorted by the arrays that
they name, all chains pass through the arrays in one order.

If this does not suffice, a connection of signals becomes the equation `"acausalConnection" = {a, b}`. `equations.py`
hides it from the pass, and `restored` turns it into `a = b`. The text does not say whether `a` is a signal or a pin, so
its name decides. `restored` checks the choice with the flat model, and refuses a pin with the name of a signal.
"""

import re
from itertools import pairwise
from typing import Any

from .._errors import ModelicaError
from .scan import masked, statement_end

MARK = "acausalConnection"
# Names of discrete signals in the Modelica Standard Library.
SIGNALS = """
    a a0 a1 activePort addr b c c_in c_out clk clock control count d d0 d1 d2 d3 dataIn dataOut direction enable fire
    fire1 fire2 fire_n fire_p in0 in1 index internalEnable j k local_reset local_set notFire numberPort on out q q0 q1
    q2 qn r reset R RE s S sel set trig trigger u u1 u2 u3 valid WE x y y1 y2 yy
""".split()
_SIGNAL = re.compile(rf"(?:[\w.\[\]:]*\.)?(?:{'|'.join(SIGNALS)})(?:\s*\[[^\[\]]*\])?")
_INDICES = re.compile(r"\[[^\]]*\]")
_CONNECTION = re.compile(r"(?<![\w.])connect\s*\(\s*([^;(),]+?)\s*,\s*([^;(),]+?)\s*\)")


def in_order(text: str) -> str:
    """A text whose connections that follow each other are sorted. What follows their ends keeps its place."""
    plain = masked(text)
    pieces, at = [], 0
    for run in _runs(plain):
        ends = [(text[slice(*one.span(1))], text[slice(*one.span(2))]) for one in run]
        for place, (first, second) in zip(run, sorted(ends, key=_arrays), strict=True):
            gap = "\n" * (place[0].count("\n") - (first + second).count("\n"))
            pieces.append(f"{text[at : place.start()]}connect({first}, {second}{gap})")
            at = place.end()
    return "".join([*pieces, text[at:]])


def as_equations(text: str) -> str:
    """A text with its connections of signals as equations."""
    plain = masked(text)
    pieces, at = [], 0
    for found in _CONNECTION.finditer(plain):
        if all(_SIGNAL.fullmatch(end) for end in found.groups()):
            gap = "\n" * (found[0].count("\n") - (found[1] + found[2]).count("\n"))
            pieces.append(f'{text[at : found.start()]}"{MARK}" = {{{found[1]}, {found[2]}}}{gap}')
            at = found.end()
    return "".join([*pieces, text[at:]])


def restored(content: dict[str, Any]) -> dict[str, Any]:
    """The flat model with the connections of signals put back, except those of disabled components (Modelica 3.6,
    section 4.4.5). Raises `ModelicaError` if an end is no signal.
    """
    rest = []
    for equation in content["equations"]:
        ends = _ends(equation["residual"])
        if ends is None:
            rest.append(equation)
        elif _are_present(ends, content["variables"]):
            equation["residual"]["Binary"] |= {"lhs": ends[0], "rhs": ends[1]}
            rest.append(equation | {"origin": {"Connection": {"lhs": "", "rhs": ""}}})
    return content | {"equations": rest}


def _are_present(ends: list[Any], variables: dict[str, Any]) -> bool:
    """Whether all signals of the ends are in the model. Raises `ModelicaError` for an end that is no signal."""
    absent = [name for name in _names(ends) if name not in variables]
    plain = {_INDICES.sub("", other) for other in variables} if absent else set()
    for name in absent:
        if any(other.startswith(f"{_INDICES.sub('', name)}.") for other in plain):
            raise ModelicaError(
                f"The front end cannot direct the signals of this model, because {name} is named as one."
            )
    return not absent


def _names(node: Any) -> list[str]:
    """The names of the variables in an expression."""
    if isinstance(node, list):
        return [name for item in node for name in _names(item)]
    if not isinstance(node, dict):
        return []
    if "VarRef" in node:
        return [node["VarRef"]["name"]["name"]]
    return [name for item in node.values() for name in _names(item)]


def _ends(residual: Any) -> list[Any] | None:
    """The ends of an equation that was a connection; None for any other."""
    sides = residual.get("Binary")
    literal = sides and sides["lhs"].get("Literal")
    is_marked = literal and literal["value"] == {"String": MARK}
    return sides["rhs"]["Array"]["elements"] if is_marked else None


def _arrays(ends: tuple[str, str]) -> list[str]:
    """What connections are sorted by: the ends that are elements of arrays."""
    return sorted(end for end in ends if end.endswith("]"))


def _runs(plain: str) -> list[list[re.Match[str]]]:
    """The connections that follow each other."""
    found = list(_CONNECTION.finditer(plain))
    runs = [found[:1]]
    for one, following in pairwise(found):
        if plain[statement_end(plain, one.start()) : following.start()].isspace():
            runs[-1].append(following)
        else:
            runs.append([following])
    return runs
