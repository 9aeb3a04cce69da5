"""Rest that is so near to the first guess that hardly anything lacks there."""

from typing import Self

import numpy as np
import pytest

from acausal import Component, Equations, Param, Scalar, Var, eq, initialise, positive


class Warm(Component):
    """A body that is warmed a little: C dT/dt = heat - G (T - room)."""

    heat: Param[Scalar, "W"]
    G: Param[Scalar, "W/K", positive]
    C: Param[Scalar, "J/K", positive] = 20.0
    room: Param[Scalar, "K"] = 293.15
    T: Var[Scalar, "K", positive] = 293.15

    def equations(self, d: Self) -> Equations:
        return dict(heat=eq(self.C * d.T, self.heat - self.G * (self.T - self.room)))


@pytest.mark.parametrize("rise", [10.0**k for k in range(-12, 2)])
def test_any_distance_from_the_guess_is_found(rise: float) -> None:
    for G in (1e-2, 0.5, 30.0):
        rest = initialise(Warm(heat=G * rise, G=G), steady=True)
        np.testing.assert_allclose(rest.T - 293.15, rise, rtol=1e-6, atol=1e-12)
