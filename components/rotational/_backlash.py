"""Play between two shafts."""

from typing import Self

import jax.numpy as jnp

from acausal import Energy, Equations, Param, Scalar, Var, eq, nonnegative

from .._limit import limited
from ._interfaces import Compliant


class ElastoBacklash(Compliant):
    """A play between elastic stops with damping (MSL `ElastoBacklash`).

    With the deflection x = phi_rel - phi_rel0 -+ play/2 beyond the play, else 0: tau = c x + d w_rel, where the damping
    is limited to the size of c x, so that the torque is continuous at contact and the stops do not pull. It has kinks
    at contact and where that limit is met, and no event: the integrator shortens its steps there, and a gradient
    through them is less accurate than the solution.
    """

    c: Param[Scalar, "N.m/rad", nonnegative]  # stiffness
    d: Param[Scalar, "N.m.s/rad", nonnegative]  # damping coefficient
    play: Param[Scalar, "rad", nonnegative]  # total play
    phi_rel0: Param[Scalar, "rad"] = 0.0  # relative angle in the middle of the play
    w_rel: Var[Scalar, "rad/s"] = 0.0  # relative speed

    def _elastic(self) -> Scalar:
        x = self.phi_rel - self.phi_rel0
        return self.c * (x - limited(x, -0.5 * self.play, 0.5 * self.play))

    def _damping(self) -> Scalar:
        size = jnp.abs(self._elastic())
        return limited(self.d * self.w_rel, -size, size)

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(
            relative_speed=eq(self.w_rel, d.phi_rel),
            law=eq(self.tau, self._elastic() + self._damping()),
        )

    def energy(self) -> Energy:
        x = self.phi_rel - self.phi_rel0
        x = x - limited(x, -0.5 * self.play, 0.5 * self.play)
        return Energy(stored=0.5 * self.c * x**2, dissipated=self._damping() * self.w_rel)
