"""The last steps of a search for an optimum, from where a solver has ended."""

import numpy as np

from acausal.design._certificate.first_order import Point
from acausal.design._optimise.descent import polished

LOW, HIGH = np.zeros(2), np.ones(2)


def steep_beside_a_bound(z: np.ndarray) -> Point:
    """f = (x - 0.3)^2/2 + 15 (x - 0.3) (y - 1) - y, least at (0.3, 1) where y is bounded by 1."""
    x, y = z[0] - 0.3, z[1] - 1.0
    gradient = np.array([x + 15.0 * y, 15.0 * x - 1.0])
    return Point(np.array(z), 0.5 * x**2 + 15.0 * x * y - z[1], gradient, np.zeros(0), np.zeros((0, 2)))


def test_what_a_bound_moves_by_changes_the_slope_of_others() -> None:
    end = polished(steep_beside_a_bound, np.array([0.3 + 1e-8, 1.0 - 1e-7]), (LOW, HIGH), np.zeros(0, bool))
    np.testing.assert_allclose(end, [0.3, 1.0], rtol=0.0, atol=1e-14)
