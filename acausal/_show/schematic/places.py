"""Columns of glyphs, and their places in the order of columns, without overlaps."""

import dataclasses
import itertools
from collections.abc import Sequence

import numpy as np
import scipy

from .graph import Glyph, Graph, Rect
from .order import Levels
from .symbols import Point, Turned

Link = tuple[int, int, float, float]  # from, to, distance wanted, weight
Bound = tuple[int, int, float]  # from, to, least distance


def least_lengths(count: int, links: Sequence[Link], bounds: Sequence[Bound]) -> np.ndarray:
    """Integers x with least sum of weight |x_b - x_a - wanted| over links, and x_b - x_a >= least for bounds.

    The matrix of differences is totally unimodular, so with integer distances the vertices are integer.
    """
    if not count:
        return np.zeros(0, int)
    size = count + len(links)
    rows = [_difference(size, a, b, -1.0) for a, b, _ in bounds]
    limits = [-least for _, _, least in bounds]
    for i, (a, b, wanted, _) in enumerate(links):
        for sign in (1.0, -1.0):
            row = _difference(size, a, b, sign)
            row[count + i] = -1.0
            rows.append(row)
            limits.append(sign * wanted)
    # A slight pull towards zero makes the optimum unique.
    cost = np.concatenate([np.full(count, 1e-6), [weight for *_, weight in links]])
    found = scipy.optimize.linprog(
        cost, np.array(rows).reshape(-1, size), limits, bounds=(0.0, None), method="highs-ds"
    )
    return np.round(found.x[:count]).astype(int)


def _difference(size: int, a: int, b: int, sign: float) -> np.ndarray:
    row = np.zeros(size)
    row[b] += sign
    row[a] -= sign
    return row


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


BESIDE, BELOW, NEAR = 4, 2, 2  # least distances: of symbols, of outlines below each other, of names


def places(graph: Graph, levels: Levels, spread: int) -> list[Point]:
    """The corners of the glyphs, with the shortest lines for this order. `spread` widens the gaps."""
    y = _down(graph, levels, spread)
    x = _across(graph, levels, y, spread)
    return list(zip(x.tolist(), y[: len(x)].tolist(), strict=True))


def _down(graph: Graph, levels: Levels, spread: int) -> np.ndarray:
    """The upper edges of all items."""
    outlines = [glyph.outline for glyph in graph.glyphs]
    outlines += [Rect(0, 0, 0, 0)] * (len(levels.heights) - len(outlines))
    bounds = [
        (a, b, float(outlines[a].bottom + BELOW + spread - outlines[b].top))
        for column in levels.columns
        for a, b in itertools.pairwise(column)
    ]
    links = [(link.a, link.b, float(link.y_a - link.y_b), link.weight) for link in levels.links]
    return least_lengths(len(levels.heights), links, bounds)


def _across(graph: Graph, levels: Levels, y: np.ndarray, spread: int) -> np.ndarray:
    """The left edges of the glyphs. Names need a gap only from what is beside them."""
    glyphs = [[item for item in column if item < len(graph.glyphs)] for column in levels.columns]
    bounds = []
    for i, j in itertools.combinations(range(len(glyphs)), 2):
        gap = BESIDE + spread + _tracks(levels, i)
        for a, b in itertools.product(glyphs[i], glyphs[j]):
            needed = _needed(graph.glyphs[a], graph.glyphs[b], int(y[b] - y[a]))
            if j == i + 1:
                needed.append(graph.glyphs[a].rect.right + gap)
            bounds += [(a, b, float(max(needed)))] if needed else []
    links = []
    for a, b, weight, _ in graph.pairs():
        (x_a, _), (x_b, _) = (graph.glyphs[end.glyph].turned.port(end.port) for end in (a, b))
        links.append((a.glyph, b.glyph, float(x_a - x_b), weight))
    return least_lengths(len(graph.glyphs), links, bounds)


def _needed(a: Glyph, b: Glyph, down: int) -> list[int]:
    """The least distances of two glyphs so that parts beside each other do not meet."""
    pairs = itertools.product(a.rects, b.rects)
    beside = ((p, q) for p, q in pairs if p.top - 1 < q.bottom + down and q.top + down < p.bottom + 1)
    return [p.right + NEAR - q.left for p, q in beside]


def _tracks(levels: Levels, i: int) -> int:
    """The number of nets with lines between a column and the next, beyond the first two."""
    left, right = (set(levels.columns[k]) for k in (i, i + 1))
    nets = {link.net for link in levels.links if link.a in left and link.b in right}
    return max(len(nets) - 2, 0)
