"""Places of the nodes of a graph in the plane, without overlaps."""

import numpy as np
import scipy

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
