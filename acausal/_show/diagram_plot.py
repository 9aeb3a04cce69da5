"""Plot of a diagram, laid out without other programs; needs matplotlib."""

import numpy as np
import scipy

from .._extras import Axes, given_or_new
from .diagram import Diagram

SPREAD = np.array([2.1, 1.25])  # inches between neighbours
HEIGHT, PER_LETTER, MARGIN = 0.46, 0.078, 0.24  # inches, of boxes
ROUNDS = 300


def plot_diagram(diagram: Diagram, ax: Axes | None) -> Axes:
    """See `Diagram.plot`."""
    names = list(diagram.boxes)
    sizes = np.array([_size(name, diagram.boxes[name]) for name in names]).reshape(-1, 2)
    edges = _edges(diagram)
    sizes = np.concatenate([sizes, np.full((edges.max(initial=-1) + 1 - len(names), 2), 0.1)]) if len(edges) else sizes
    points = apart(placed(edges, len(sizes)) * SPREAD, sizes)
    extent = np.ptp(points, axis=0) + sizes.max(axis=0, initial=1.0) + 0.3
    ax = given_or_new(ax, *np.maximum(extent, 2.0))
    _draw_lines(ax, diagram, points)
    for name, point, size in zip(names, points, sizes, strict=False):
        _draw_box(ax, diagram, name, point, size)
    for domain, colour in diagram.colours.items():
        ax.plot([], [], color=colour, linewidth=2.0, label=domain)
    if diagram.colours:
        ax.legend(loc="best", fontsize="small", frameon=False)
    ax.set_aspect("equal")
    ax.margins(0.02)
    ax.autoscale_view()
    ax.axis("off")
    ax.set_title(diagram.name, fontsize="medium")
    return ax


def _size(name: str, kind: str) -> tuple[float, float]:
    return PER_LETTER * max(len(name), len(kind)) + MARGIN, HEIGHT


def _edges(diagram: Diagram) -> np.ndarray:
    """Pairs of points: boxes, then the junctions of more than two ports."""
    place = {name: i for i, name in enumerate(diagram.boxes)}
    pairs, junction = [], len(place)
    for joint in diagram.joints:
        ends = [place[box] for box in joint.boxes]
        if len(ends) == 2:
            pairs.append(ends)
        else:
            pairs += [[junction, end] for end in ends]
            junction += 1
    return np.array(pairs, dtype=int).reshape(-1, 2)


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


def _draw_lines(ax: Axes, diagram: Diagram, points: np.ndarray) -> None:
    place = {name: i for i, name in enumerate(diagram.boxes)}
    junction = len(place)
    for joint in diagram.joints:
        ends, colour = [points[place[box]] for box in joint.boxes], diagram.colours[joint.domain]
        middle = points[junction] if len(ends) > 2 else np.mean(ends, axis=0)
        if len(ends) > 2:
            ax.plot(*middle, "o", color=colour, markersize=5, zorder=2)
            junction += 1
        for end in ends:
            ax.plot(*np.transpose([middle, end]), color=colour, linewidth=1.6, zorder=1)


def _draw_box(ax: Axes, diagram: Diagram, name: str, point: np.ndarray, size: np.ndarray) -> None:
    from matplotlib.patches import FancyBboxPatch

    left, low = point - size / 2.0
    style = "round,pad=0,rounding_size=0.06"
    colour = diagram.colour_of(name)
    ax.add_patch(
        FancyBboxPatch((left, low), *size, boxstyle=style, facecolor="white", edgecolor=colour, linewidth=1.6, zorder=3)
    )
    x, y = point
    ax.text(x, y + 0.09, name, ha="center", va="center", fontsize=8, fontweight="bold", zorder=4)
    ax.text(x, y - 0.11, diagram.boxes[name], ha="center", va="center", fontsize=7, color="0.35", zorder=4)
