"""Places of the nodes of a graph in the plane."""

import numpy as np
import pytest

from acausal._show.bond_plot import apart, placed


def test_layout_keeps_distances_of_a_path() -> None:
    """Five points in a row, where distances along the edges can be met exactly."""
    points = placed(np.array([[0, 1], [1, 2], [2, 3], [3, 4]]), 5)
    gaps = np.linalg.norm(points[:, None] - points, axis=-1)
    np.testing.assert_allclose(gaps, np.abs(np.subtract.outer(np.arange(5), np.arange(5))), atol=0.05)
    np.testing.assert_allclose(points[:, 1], 0.0, atol=0.05)  # it lies across


def test_boxes_are_moved_apart() -> None:
    points, sizes = np.array([[0.0, 0.0], [0.1, 0.0], [5.0, 0.0]]), np.ones((3, 2))
    moved = apart(points, sizes)
    assert abs(moved[0, 0] - moved[1, 0]) >= 1.0
    np.testing.assert_array_equal(moved[2], points[2])


@pytest.mark.parametrize(
    "edges",
    [
        [(0, i) for i in range(1, 7)],
        [(i, i + 1) for i in range(9)],
        [(i, (i + 1) % 8) for i in range(8)],
        [(i, i + 1) for i in range(8) if i % 3 < 2] + [(i, i + 3) for i in range(6)],
    ],
    ids=["star", "path", "ring", "grid"],
)
def test_layout_is_the_same_on_all_machines(edges: list[tuple[int, int]], monkeypatch: pytest.MonkeyPatch) -> None:
    """Signs of eigenvectors and singular vectors, and which of equal ones come first, are up to LAPACK."""
    rng, eigh, svd = np.random.default_rng(0), np.linalg.eigh, np.linalg.svd
    pairs = np.array(edges)
    count = int(pairs.max()) + 1
    expected = placed(pairs, count)

    def other_eigh(matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        values, vectors = eigh(matrix + 1e-15 * rng.normal(size=matrix.shape))
        return values, vectors * rng.choice([-1.0, 1.0], size=count)

    def other_svd(matrix: np.ndarray, full_matrices: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        left, values, right = svd(matrix + 1e-15 * rng.normal(size=matrix.shape), full_matrices=full_matrices)
        return left, values, right * rng.choice([-1.0, 1.0], size=(2, 1))

    monkeypatch.setattr(np.linalg, "eigh", other_eigh)
    monkeypatch.setattr(np.linalg, "svd", other_svd)
    for _ in range(5):
        np.testing.assert_allclose(placed(pairs, count), expected, atol=1e-9)
