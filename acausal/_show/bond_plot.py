"""Plot of a bond graph, laid out without other programs; needs matplotlib."""

import itertools
from collections.abc import Mapping
from typing import Any

import numpy as np
import scipy

from .._extras import Axes, given_or_new
from .bond_graph import BondGraph
from .diagram import COLOURS

SPREAD = np.array([1.3, 1.0])  # inches between neighbours
SIZE = {"0": (0.3, 0.3), "1": (0.3, 0.3)}  # inches, of junctions
HEIGHT, PER_LETTER, LEAST = 0.46, 0.068, 0.45  # inches, of all others
TIED = "#b00020"  # colour of a store with derivative causality
STROKE, HALF = 0.09, 0.12  # inches: half a causal stroke, and a half arrow


def plot_bond_graph(graph: BondGraph, ax: Axes | None, chosen: Mapping[str, str]) -> Axes:
    """See `BondGraph.plot`."""
    sizes = np.array([_size(graph, i) for i in range(len(graph.places))]).reshape(-1, 2)
    edges = np.array([(bond.tail, bond.head) for bond in graph.bonds], dtype=int).reshape(-1, 2)
    points = apart(_left_to_right(placed(edges, len(sizes)), edges) * SPREAD, sizes + 0.12)
    extent = np.ptp(points, axis=0) + sizes.max(axis=0, initial=1.0) + 0.4
    ax = given_or_new(ax, *np.maximum(extent, 2.0))
    domains = dict.fromkeys(bond.domain for bond in graph.bonds)
    free = itertools.cycle([colour for colour in COLOURS if colour not in chosen.values()] or COLOURS)
    colours = {domain: chosen[domain] if domain in chosen else next(free) for domain in domains}
    for bond, stroke in zip(graph.bonds, graph.strokes, strict=True):
        _draw_bond(ax, points, sizes, bond, stroke, colours[bond.domain])
    for i, (x, y) in enumerate(points):
        _draw_place(ax, graph, i, x, y)
    for domain, colour in colours.items():
        ax.plot([], [], color=colour, linewidth=1.6, label=domain)
    if graph.derivative:
        ax.plot([], [], color=TIED, linestyle="none", marker="s", label="derivative causality")
    ax.legend(loc="best", fontsize="small", frameon=False)
    ax.set_aspect("equal")
    ax.set_xlim(np.min(points[:, 0] - sizes[:, 0]), np.max(points[:, 0] + sizes[:, 0]))
    ax.set_ylim(np.min(points[:, 1] - 0.5), np.max(points[:, 1] + 0.5))
    ax.axis("off")
    ax.set_title(f"{graph.name}, bond graph; values in SI units", fontsize="medium")
    return ax


def _left_to_right(points: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """The points, mirrored if most bonds point to the left."""
    way = points[edges[:, 1], 0] - points[edges[:, 0], 0]
    return points * [-1.0, 1.0] if np.sum(way) < 0.0 else points


def _size(graph: BondGraph, i: int) -> tuple[float, float]:
    place = graph.places[i]
    return SIZE.get(place.kind, (max(LEAST, PER_LETTER * max(len(place.name), len(_value(graph, i)))), HEIGHT))


def _value(graph: BondGraph, i: int) -> str:
    value = graph.places[i].value
    return "" if value is None else f"{value:.4g}"


def _draw_place(ax: Axes, graph: BondGraph, i: int, x: float, y: float) -> None:
    place = graph.places[i]
    tied = place.kind in ("I", "C") and place.name in graph.derivative
    if place.kind in SIZE:
        ax.text(x, y, place.kind, ha="center", va="center", fontsize=11, fontweight="bold")
        return
    ax.text(x, y + 0.14, place.kind, ha="center", va="center", fontsize=9, fontweight="bold")
    ax.text(x, y, place.name, ha="center", va="center", fontsize=7, color=TIED if tied else "0.2")
    ax.text(x, y - 0.13, _value(graph, i), ha="center", va="center", fontsize=7, color="0.4")


def _draw_bond(ax: Axes, points: np.ndarray, sizes: np.ndarray, bond: Any, stroke: int, colour: str) -> None:
    """A line between the edges of two places, with its half arrow at the head and its stroke at one end."""
    tail, head = points[bond.tail], points[bond.head]
    way = head - tail
    length = max(float(np.linalg.norm(way)), 1e-9)
    along = way / length
    aside = np.array([-along[1], along[0]])
    start, end = tail + along * _reach(sizes[bond.tail], along), head - along * _reach(sizes[bond.head], along)
    ax.plot(*np.transpose([start, end]), color=colour, linewidth=1.6)
    ax.plot(*np.transpose([end, end - HALF * along + 0.7 * HALF * aside]), color=colour, linewidth=1.6)
    place = end if stroke == bond.head else start
    ax.plot(*np.transpose([place - STROKE * aside, place + STROKE * aside]), color="black", linewidth=1.8)


def _reach(size: np.ndarray, along: np.ndarray) -> float:
    """The distance from the centre of a place to its edge in a direction."""
    with np.errstate(divide="ignore"):
        return float(np.min(size / 2.0 / np.abs(along)))


ROUNDS = 300


def placed(edges: np.ndarray, count: int) -> np.ndarray:
    """Points in the plane whose distances match those along the edges: stress majorisation.

    It starts from classical scaling, so the result is reproducible (Gansner, Koren and North, Graph Drawing by Stress
    Majorization, 2004). The longer axis is horizontal.
    """
    if count < 2:
        return np.zeros((count, 2))
    graph = scipy.sparse.csr_array((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), shape=(count, count))
    far = scipy.sparse.csgraph.shortest_path(graph, directed=False, unweighted=True)
    far = np.where(np.isfinite(far), far, np.max(far, where=np.isfinite(far), initial=1.0) + 1.0)
    weight = np.divide(1.0, far**2, out=np.zeros_like(far), where=far > 0.0)
    laplacian = np.diag(weight.sum(axis=1)) - weight
    inverse = np.linalg.pinv(laplacian)
    points = _classical(far)
    for _ in range(ROUNDS):
        gap = np.linalg.norm(points[:, None] - points, axis=-1)
        pull = np.divide(weight * far, gap, out=np.zeros_like(gap), where=gap > 1e-9)
        points = inverse @ (np.diag(pull.sum(axis=1)) - pull) @ points
    points = points - points.mean(axis=0)
    _, _, axes = np.linalg.svd(points * (1.0 + 1e-3 * _irregular(count)[:, :1]), full_matrices=False)
    return _signed(points @ axes.T)


def _classical(far: np.ndarray) -> np.ndarray:
    """Points from the two largest eigenvectors of the centred squared distances."""
    centre, irregular = np.eye(len(far)) - 1.0 / len(far), _irregular(len(far))
    # In a symmetric graph, rounding would choose among eigenvectors, and the picture would depend on the machine.
    uneven = far**2 * (1.0 + 1e-3 * irregular @ irregular.T)
    values, vectors = np.linalg.eigh(-0.5 * centre @ uneven @ centre)
    # Equivalent nodes would coincide and stay together.
    return _signed(vectors[:, -2:]) * np.sqrt(np.maximum(values[-2:], 0.0)) + 1e-2 * irregular


def _signed(vectors: np.ndarray) -> np.ndarray:
    """Eigenvectors with a sign that is the same on all machines."""
    return vectors * np.where(np.sum(vectors * _irregular(len(vectors)), axis=0) < 0.0, -1.0, 1.0)


def _irregular(count: int) -> np.ndarray:
    """Pairs of numbers without any symmetry."""
    return np.stack([np.cos(np.arange(count)), np.sin(1.7 * np.arange(count))], axis=1)


def apart(points: np.ndarray, sizes: np.ndarray) -> np.ndarray:
    """Points moved until no two boxes overlap, each time along the axis with less overlap."""
    points, gap = points.copy(), 0.16
    for _ in range(ROUNDS):
        overlap = (sizes[:, None] + sizes) / 2.0 + gap - np.abs(points[:, None] - points)
        overlap[np.arange(len(points)), np.arange(len(points))] = 0.0
        pairs = np.argwhere(np.all(overlap > 1e-6, axis=-1))
        if not len(pairs):
            break
        for i, j in pairs[pairs[:, 0] < pairs[:, 1]]:
            axis = int(np.argmin(overlap[i, j]))
            way = 0.5 * overlap[i, j, axis] * (1.0 if points[i, axis] >= points[j, axis] else -1.0)
            points[i, axis] += way
            points[j, axis] -= way
    return points
