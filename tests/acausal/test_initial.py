"""Consistent start values."""

import numpy as np
import pytest
from _models import gear_train

from acausal import simulate


@pytest.mark.parametrize(("ratio", "speed"), [(-3.0, 2.0), (10.0, 500.0), (50.0, -2e3)])
def test_given_start_propagates_through_gear(ratio: float, speed: float) -> None:
    """What is given holds exactly, however large the speeds are beside their nominal size."""
    sol = simulate(gear_train(ratio, w2=speed), 1e-3, save="end")
    np.testing.assert_allclose(sol.final.second.w, speed, rtol=1e-12)
    np.testing.assert_allclose(sol.final.first.w, ratio * speed, rtol=1e-12)
