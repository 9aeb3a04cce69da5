"""The comparison of texts with numbers, and of pictures."""

import io
import math

import matplotlib.pyplot as plt
import pytest

from docs._compare import ALIKE, first_difference, picture_difference


@pytest.mark.parametrize(
    ("a", "b"),
    [
        ("x 1.00000 m", "x 1.00001 m"),
        ("total   12.5", "total 12.5"),
        ("imbalance: 1e-07 J", "imbalance: -3.2e-08 J"),
        ("-1e-15", "0.0"),
        ("optimal, KKT residual 2.3e-11, a minimum", "optimal, KKT residual 1e-15, a minimum"),
        ("36 designs, 7 of which could not be computed, 41.8 s", "35 designs, 3.2 s"),
        ("100 steps accepted, 3 rejected", "108 steps accepted, 1 rejected"),
    ],
)
def test_same(a: str, b: str) -> None:
    assert first_difference(a, b) is None


@pytest.mark.parametrize(
    ("a", "b"),
    [
        ("x 1.0 m", "x 1.1 m"),
        ("a", "b"),
        ("a 1", "b 1"),
        ("a", "a\nb"),
        ("1 2", "1"),
        ("1", "-1"),
        ("100 steps accepted, 3 rejected", "120 steps accepted, 3 rejected"),
    ],
)
def test_different(a: str, b: str) -> None:
    assert first_difference(a, b) is not None


def drawn(*values: float, size: float = 3.0) -> bytes:
    """A line, as PNG."""
    figure, ax = plt.subplots(figsize=(size, 2.0))
    ax.plot(values)
    file = io.BytesIO()
    figure.savefig(file, format="png")
    plt.close(figure)
    return file.getvalue()


def test_pictures() -> None:
    assert picture_difference(drawn(1.0, 2.0, 4.0), drawn(1.0, 2.0, 4.0)) == 0.0
    assert picture_difference(drawn(1.0, 2.0, 4.0), drawn(1.0, 2.0001, 4.0)) < ALIKE
    assert picture_difference(drawn(1.0, 2.0, 4.0), drawn(1.0, 2.5, 4.0)) > ALIKE
    assert picture_difference(drawn(1.0, 2.0), drawn(1.0, 2.0, size=4.0)) == math.inf
