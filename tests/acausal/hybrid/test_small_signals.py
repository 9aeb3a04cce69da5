"""Laws in pieces of a signal far below its nominal size, whose relations change for the first time in a run."""

from typing import Self

import jax.numpy as jnp
import numpy as np
import pytest

from acausal import Component, Equations, Param, Scalar, Time, UnresolvedWarning, Var, eq, ifelse, segment, simulate


class Stairs(Component):
    """x rises at the rate r from zero; y counts the knots 0, h, 2 h, 3 h that it has passed, and z the time above 0."""

    r: Param[Scalar, ""]
    h: Param[Scalar, ""]
    x: Var[Scalar, ""] = 0.0
    y: Var[Scalar, ""] = 0.0
    z: Var[Scalar, "s"] = 0.0

    def equations(self, d: Self) -> Equations:
        passed = segment(self.x, self.h * jnp.arange(1.0, 4.0))
        return dict(
            rise=eq(d.x, self.r, check_units=False),
            count=eq(d.y, passed, check_units=False),
            above=eq(d.z, ifelse(self.x > 0.0, 1.0, 0.0), check_units=False),
        )


@pytest.mark.filterwarnings("ignore::acausal.UnresolvedWarning")  # a change back would not be seen
@pytest.mark.parametrize("h", [1.0, 1e-4, 1e-7])
def test_knots_are_passed_in_time(h: float) -> None:
    """x reaches i h at i s, and leaves the corner at zero at once."""
    end = simulate(Stairs(r=h, h=h), 4.5, rtol=1e-6, save="end").final
    np.testing.assert_allclose(jnp.array([end.y, end.z]), [3.5 + 2.5 + 1.5, 4.5], rtol=1e-4)


class Comparator(Component):
    """y is the time for which u = A sin t was positive."""

    A: Param[Scalar, "V"]
    t: Time[Scalar, "s"] = 0.0
    u: Var[Scalar, "V"] = 0.0
    y: Var[Scalar, "s"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(
            source=eq(self.u, self.A * jnp.sin(self.t), check_units=False),
            count=eq(d.y, ifelse(self.u > 0.0, 1.0, 0.0), check_units=False),
        )


@pytest.mark.thorough
@pytest.mark.parametrize("amplitude", [1.0, 1e-5, 1e-7])
def test_what_changes_to_and_fro_within_the_tolerance_is_told(amplitude: float) -> None:
    comparator = Comparator(A=amplitude)
    if amplitude < 1e-6:
        with pytest.warns(UnresolvedWarning, match=r"u \(at most 9.*nominal=\{'u': 9e-08\}"):
            assert list(simulate(comparator, 4.0 * np.pi).unresolved) == ["u"]
    sized = simulate(comparator, 4.0 * np.pi, nominal={"u": amplitude})
    assert not sized.unresolved
    np.testing.assert_allclose(sized.final.y, 2.0 * np.pi, rtol=1e-9)
