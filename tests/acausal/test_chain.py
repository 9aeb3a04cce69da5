"""Dependent variables that follow from others one equation at a time."""

from typing import Any

import numpy as np
from _mechanisms import PointOnRod

from acausal import Equations, Scalar, Var, choose_states, eq, simulate


class SquaredRod(PointOnRod):
    """A pendulum with the squares of its coordinates as variables."""

    across: Var[Scalar, "m2"] = 0.0
    down: Var[Scalar, "m2"] = 0.0

    def equations(self, d: Any) -> Equations:
        return super().equations(d) | dict(
            across=eq(self.across, self.x**2),
            down=eq(self.down, self.y**2),
            rod=eq(self.across + self.down, self.L**2),
        )


def test_a_run_is_projected_in_its_states() -> None:
    model = SquaredRod(x=1.0, y=0.0)
    system = choose_states(model)
    assert set(system.state_names) == {"x", "y", "u", "v"}
    assert set(system.invariants.pairs) == set(system.states)
    assert len(system.invariants.names) == 2  # of 6 constraints
    sol = simulate(model, 0.5, rtol=1e-9, save="end", system=system)
    np.testing.assert_allclose(sol.final.across + sol.final.down, 1.0, rtol=1e-12)
    # The angle as an elliptic function of time: see the pendulum in test_index_reduction.py.
    np.testing.assert_allclose(np.asarray(sol.final.x), 0.391048791551, rtol=1e-8)
