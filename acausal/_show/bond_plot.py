"""Plot of a bond graph, laid out without other programs; needs matplotlib."""

import itertools
from collections.abc import Mapping
from typing import Any

import numpy as np

from .._extras import Axes, given_or_new
from .bond_graph import BondGraph
from .diagram import COLOURS
from .placing import apart, placed

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
