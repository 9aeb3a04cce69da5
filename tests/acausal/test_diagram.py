"""Components and connections as a graph, and its picture."""

import re

import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np
import pytest
from _models import rc
from matplotlib.patches import FancyBboxPatch

from acausal import Array as Parts
from acausal import Component, Connections, ModelError, connect, diagram, repeat
from acausal._show.diagram_plot import apart, placed
from components.rotational import Inertia, SpringDamper
from docs.drive import drive


def test_boxes_and_joints() -> None:
    found = diagram(drive)
    assert found.boxes["motor"] == "DCMotor"
    assert len(found.boxes) == 7
    seen = {(joint.domain, joint.ports) for joint in found.joints}
    assert ("electrical", (("motor", "p"), ("supply", "p"))) in seen
    assert ("electrical", (("ground", "p"), ("motor", "n"), ("supply", "n"))) in seen
    assert ("rotational", (("gear", "a"), ("motor", "shaft"))) in seen
    assert len(seen) == len(found.joints) == 6


def test_all_levels() -> None:
    """What is connected through the ports of a composite is seen as connected."""
    found = diagram(drive, depth=None)
    assert found.boxes.keys() >= {"motor.resistor", "motor.emf", "gear"}
    assert "motor" not in found.boxes
    seen = {joint.ports for joint in found.joints}
    assert (("motor.resistor", "p"), ("supply", "p")) in seen
    assert (("gear", "a"), ("motor.rotor", "b")) in seen
    assert diagram(drive, depth=2) == found


def test_domains_have_colours() -> None:
    found = diagram(drive)
    assert list(found.colours) == ["electrical", "rotational"]
    assert found.colour_of("supply") == found.colours["electrical"]
    assert found.colour_of("motor") not in found.colours.values()  # it is in both


class Chain(Component):
    """Inertias with springs between them."""

    inertias: Parts[Inertia]
    springs: Parts[SpringDamper]

    def connections(self) -> Connections:
        return (
            connect(self.inertias[:-1].b, self.springs[:].a),
            connect(self.springs[:].b, self.inertias[1:].a),
        )


def test_arrays_are_one_box() -> None:
    found = diagram(Chain(inertias=repeat(Inertia(J=1.0), 5), springs=repeat(SpringDamper(c=jnp.ones(4), d=0.1), 4)))
    assert found.boxes == {"inertias[]": "5 × Inertia", "springs[]": "4 × SpringDamper"}
    # Connections join the two sides of an inertia, whose angles are one only by its equation.
    assert {joint.boxes for joint in found.joints} == {("inertias[]", "springs[]")}


def test_a_component_without_parts() -> None:
    found = diagram(Inertia(J=1.0))
    assert (found.boxes, found.joints) == ({"Inertia": "Inertia"}, ())
    found.plot()
    plt.close("all")


def test_text_for_graphviz() -> None:
    lines = str(diagram(rc())).splitlines()
    assert lines[0] == 'graph "RC" {'
    assert lines[-1] == "}"
    assert sum("shape=box" in line for line in lines) == 4
    assert any(re.search(r'"r" -- "source" \[color="#\w+", taillabel="p", headlabel="p"\];', line) for line in lines)


def test_picture_shows_each_box_once_and_apart() -> None:
    ax = diagram(drive, depth=None).plot()
    texts = [text.get_text() for text in ax.texts]
    assert {"motor.resistor", "Resistor", "wall"} <= set(texts)
    boxes = [patch.get_bbox() for patch in ax.patches if isinstance(patch, FancyBboxPatch)]
    assert len(boxes) == 10
    assert not any(a.overlaps(b) for i, a in enumerate(boxes) for b in boxes[:i])
    plt.close("all")
    assert diagram(rc())._repr_png_().startswith(b"\x89PNG")


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


@pytest.mark.parametrize("depth", [0, -1, 1.5, True])
def test_bad_depth(depth: int) -> None:
    with pytest.raises(ModelError, match="depth must be a positive integer, or None for all levels"):
        diagram(drive, depth=depth)


def test_no_component() -> None:
    with pytest.raises(ModelError, match=r"^3 is no component: draw a model\."):
        diagram(3)  # pyright: ignore[reportArgumentType]


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
