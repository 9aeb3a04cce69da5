"""Non-linear blocks in a run: where their iterations start, and what is said where they fail."""

from typing import Self

import jax.numpy as jnp
import numpy as np
import pytest

from acausal import (
    Component,
    Equations,
    Param,
    Result,
    Scalar,
    SimulationError,
    Time,
    Var,
    eq,
    prefer,
    simulate,
)


class Branches(Component):
    """(y - 3 sin(w t))^2 = 4, which has the solutions 3 sin(w t) - 2 and 3 sin(w t) + 2; the integral of y."""

    w: Param[Scalar, "rad/s"] = 1.0
    t: Time[Scalar, "s"] = 0.0
    y: Var[Scalar, "1"] = 0.0
    x: Var[Scalar, "s", prefer] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(law=eq((self.y - 3.0 * jnp.sin(self.w * self.t)) ** 2, 4.0), integral=eq(d.x, self.y))


@pytest.mark.thorough
@pytest.mark.parametrize("start", [-2.0, 2.0])
def test_the_branch_of_the_start_is_kept(start: float) -> None:
    """Iterations that always began at the start value would change over when 3 sin(w t) passes -2 or 2."""
    sol = simulate(Branches(y=start), 2.0 * np.pi, rtol=1e-9)
    np.testing.assert_allclose(sol.y - 3.0 * np.sin(sol.ts), start, rtol=1e-12)
    np.testing.assert_allclose(sol.final.x, start * 2.0 * np.pi, rtol=1e-8)


def test_start_values_choose_among_solutions() -> None:
    """One that is not a solution is a guess."""
    sol = simulate(Branches(y=-1.5), 1.0)
    np.testing.assert_allclose(sol.y - 3.0 * np.sin(sol.ts), -2.0, rtol=1e-12)


class Shrinking(Component):
    """y^2 + z^2 = 2 (1 - t / T) and y = z^3: no solution after T."""

    T: Param[Scalar, "s"] = 1.0
    t: Time[Scalar, "s"] = 0.0
    y: Var[Scalar, "1"] = 1.0
    z: Var[Scalar, "1"] = 1.0
    x: Var[Scalar, "s", prefer] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(
            circle=eq(self.y**2 + self.z**2, 2.0 * (1.0 - self.t / self.T)),
            cube=eq(self.y, self.z**3),
            integral=eq(d.x, self.y),
        )


class Holder(Component):
    part: Shrinking


@pytest.mark.thorough
def test_equations_without_solution_are_named() -> None:
    model = Holder(part=Shrinking())
    assert simulate(model, 2.0, throw=False).result == Result.not_finite
    with pytest.raises(SimulationError) as info:
        simulate(model, 2.0)
    message = str(info.value)
    time = float(message.partition("t = ")[2].partition(" s")[0])
    assert time == pytest.approx(1.0, abs=1e-3)
    assert "The equations part.cube, part.circle for part.y, part.z have no solution there" in message
    assert "Remedy: give start values near the solution for part.z, or check the range of validity" in message
