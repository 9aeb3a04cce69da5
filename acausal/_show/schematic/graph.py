"""Graph of a schematic: glyphs, and nets of ports, with references at the ports that they fix."""

import dataclasses
import itertools
from collections.abc import Container, Iterator, Mapping, Sequence
from typing import NamedTuple

from .glyph import Glyph
from .symbols import Point, Symbol, Turned

SIGNAL = 0.05  # weight of a signal beside that of a line with a flow


class Terminal(NamedTuple):
    """A port of a glyph, by the number of the glyph."""

    glyph: int
    port: str


class Pair(NamedTuple):
    """Two ports of a net, with a weight."""

    a: Terminal
    b: Terminal
    weight: float
    is_alone: bool  # the net has no other ports


Net = tuple[Terminal, ...]


@dataclasses.dataclass(frozen=True)
class Graph:
    glyphs: tuple[Glyph, ...]
    nets: tuple[Net, ...]
    weights: tuple[float, ...]  # of the nets
    net_of: tuple[int, ...]  # number of the joint that each net draws

    def side(self, end: Terminal) -> Point:
        return self.glyphs[end.glyph].turned.side(end.port)

    def pairs(self) -> Iterator[Pair]:
        """Connected ports of different glyphs, with weights: all pairs of a net together weigh as its lines."""
        for net, weight in zip(self.nets, self.weights, strict=True):
            for a, b in itertools.combinations(net, 2):
                if a.glyph != b.glyph:
                    yield Pair(a, b, 2.0 * weight / len(net), len(net) == 2)

    def turned(self, number: int, turned: Turned) -> "Graph":
        """A copy in which a glyph has another direction."""
        glyphs = list(self.glyphs)
        glyphs[number] = dataclasses.replace(glyphs[number], turned=turned)
        return dataclasses.replace(self, glyphs=tuple(glyphs))


def graph_of(
    symbols: Mapping[str, Symbol], joints: Sequence[Sequence[tuple[str, str]]], signals: Container[int] = ()
) -> Graph:
    """The graph of symbols by name, from sets of connected ports, each as the name of its symbol and its own name.

    `signals` are the numbers of the sets whose lines may be long, so that loops are open there.
    """
    fixing = {i: name for i, joint in enumerate(joints) if (name := _reference(joint, symbols, joints)) is not None}
    names = [name for name in symbols if name not in fixing.values()]
    number = {name: i for i, name in enumerate(names)}
    used: dict[str, list[str]] = {name: [] for name in names}
    references: dict[str, dict[str, tuple[str, Symbol]]] = {name: {} for name in names}
    nets: dict[int, Net] = {}
    for i, joint in enumerate(joints):
        own = [(name, port) for name, port in joint if name in number]
        for name, port in own:
            if i in fixing:
                references[name][port] = (fixing[i], symbols[fixing[i]])
            elif len(own) > 1:
                used[name].append(port)
        if i not in fixing and len(own) > 1:
            nets[i] = tuple(Terminal(number[name], port) for name, port in own)
    glyphs = (
        Glyph(name, _upright(symbols[name], used[name], references[name]), tuple(used[name]), references[name])
        for name in names
    )
    weights = (SIGNAL if i in signals else 1.0 for i in nets)
    return Graph(tuple(glyphs), tuple(nets.values()), tuple(weights), tuple(nets))


def _reference(joint: Sequence[tuple[str, str]], symbols: Mapping[str, Symbol], joints: Sequence) -> str | None:
    """The reference that fixes a joint, if it is the only one there and in all of its other joints."""
    found = [name for name, _ in joint if symbols[name].is_reference]
    if len(found) != 1 or len(joint) < 2:
        return None
    elsewhere = [{name for name, _ in other if symbols[name].is_reference} for other in joints]
    return found[0] if all(names == {found[0]} for names in elsewhere if found[0] in names) else None


def _upright(symbol: Symbol, used: Sequence[str], references: Mapping[str, tuple[str, Symbol]]) -> Turned:
    """An element from left to right stands upright if only one of its ends has a reference that hangs below a port."""
    ends = sorted((side, port) for port in (*used, *references) for side in [Turned(symbol).side(port)[0]] if side)
    hanging = [side for side, port in ends if port in references and _hangs(references[port][1])]
    if [side for side, _ in ends] == [-1, 1] and len(hanging) == 1:
        return Turned(symbol, is_mirrored=hanging[0] == -1, is_turned=True)
    return Turned(symbol)


def _hangs(reference: Symbol) -> bool:
    return Turned(reference).side(next(iter(reference.ports))) == (0, -1)
