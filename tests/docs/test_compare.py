"""The comparison of texts with numbers."""

import pytest

from docs._compare import first_difference


@pytest.mark.parametrize(
    ("a", "b"),
    [
        ("x 1.00000 m", "x 1.00001 m"),
        ("total   12.5", "total 12.5"),
        ("imbalance: 1e-07 J", "imbalance: -3.2e-08 J"),
        ("-1e-15", "0.0"),
    ],
)
def test_same(a: str, b: str) -> None:
    assert first_difference(a, b) is None


@pytest.mark.parametrize(
    ("a", "b"), [("x 1.0 m", "x 1.1 m"), ("a", "b"), ("a 1", "b 1"), ("a", "a\nb"), ("1 2", "1"), ("1", "-1")]
)
def test_different(a: str, b: str) -> None:
    assert first_difference(a, b) is not None
