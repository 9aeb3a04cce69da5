"""Connections in an order that the last pass of rumoca can direct.

rumoca writes the connections of a signal as a chain of equations, in the order in which the connections name its ends.
The pass directs each chain from what sets the signal. It directs the elements of an array as one, so it refuses a
chain that leads from one array to another if a second chain leads back. With connections sorted by the arrays that
they name, all chains pass through the arrays in one order.
"""

import re
from itertools import pairwise

from .scan import masked, statement_end

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
