"""Columns of a schematic: the direction of each glyph, and its column."""

import dataclasses

import numpy as np

from .graph import Graph
from .programs import least_lengths
from .symbols import Turned

SLIGHT = 1e-3  # weight that makes an optimum unique
LEAST_GAIN = 0.05  # below which a glyph keeps its direction
RELIEF = 0.3  # of strain, for which an element is turned upright


def facing(graph: Graph) -> tuple[Graph, np.ndarray]:
    """The graph with glyphs mirrored so that ports face their partners, and places from left to right.

    A port on the right wants its partners one to the right. The places minimise the squared deviations from that
    (Carmel, Harel, Koren, Drawing directed graphs using one-dimensional optimization, 2002). Shapes are mirrored one
    after the other while this lowers the minimum.
    """
    count = len(graph.glyphs)
    matrix, pull, alike = SLIGHT * np.eye(count), np.zeros((count, count)), np.zeros((count, count))
    can_turn = np.array([glyph.turned.symbol.can_turn and not glyph.turned.is_turned for glyph in graph.glyphs])
    for a, b, weight, is_alone in graph.pairs():
        ends = np.array([a.glyph, b.glyph])
        matrix[ends, ends] += weight
        matrix[ends, ends[::-1]] -= weight
        pull[ends, a.glyph] += 0.5 * weight * graph.side(a)[0] * np.array([-1.0, 1.0])
        pull[ends, b.glyph] += 0.5 * weight * graph.side(b)[0] * np.array([1.0, -1.0])
        if not is_alone:  # ports on the same side of a line may stand below each other
            alike[ends, ends[::-1]] += 0.25 * weight * graph.side(a)[0] * graph.side(b)[0]
    inverse = np.linalg.inv(matrix)
    energy, sense = pull.T @ inverse @ pull + alike, np.ones(count)
    for _ in range(2 * count):
        gain = -4.0 * sense * (energy @ sense) + 4.0 * np.diag(energy)
        best = np.argmax(np.where(can_turn, gain, 0.0))
        if gain[best] < LEAST_GAIN:
            break
        sense[best] *= -1.0
    for number in np.flatnonzero(sense < 0.0).tolist():
        turned = graph.glyphs[number].turned
        graph = graph.turned(number, dataclasses.replace(turned, is_mirrored=not turned.is_mirrored))
    return graph, inverse @ pull @ sense


def standing(graph: Graph) -> tuple[Graph, np.ndarray]:
    """The graph as `facing` returns it, with elements upright whose two ports cannot both face their partners."""
    graph, x = facing(graph)
    strain = _strain(graph, x)
    for number, glyph in enumerate(graph.glyphs):
        turned = glyph.turned
        sides = [turned.side(port)[0] for port in (*glyph.used, *glyph.references)]
        if turned.is_turned or not turned.symbol.can_turn or sorted(side for side in sides if side) != [-1, 1]:
            continue
        for mirrored in (False, True):
            other, places = facing(graph.turned(number, Turned(turned.symbol, mirrored, is_turned=True)))
            if _strain(other, places) < strain - RELIEF:
                graph, x, strain = other, places, _strain(other, places)
    return graph, x


def _strain(graph: Graph, x: np.ndarray) -> float:
    """The sum of squared deviations from the distances that ports want."""
    return sum(
        weight * (x[b.glyph] - x[a.glyph] - 0.5 * (graph.side(a)[0] - graph.side(b)[0])) ** 2
        for a, b, weight, _ in graph.pairs()
    )


def columns(graph: Graph, x: np.ndarray) -> np.ndarray:
    """The column of each glyph, so that the lines are short and ports face their partners."""
    order = np.lexsort((np.arange(len(x)), np.round(x, 2)))
    place = np.argsort(order)
    links, bounds = [], []
    for a, b, weight, _ in graph.pairs():
        a, b = (a, b) if place[a.glyph] < place[b.glyph] else (b, a)
        (right_a, down_a), (right_b, down_b) = graph.side(a), graph.side(b)
        faces, is_beside = right_a > right_b, down_a == down_b != 0
        links.append((a.glyph, b.glyph, 1.0 if faces or is_beside else 0.0, 4.0 * weight if is_beside else weight))
        bounds += [(a.glyph, b.glyph, 1.0)] if faces else []
    return least_lengths(len(graph.glyphs), links, bounds)
