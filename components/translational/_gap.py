"""Elastic contact with lift-off."""

from typing import Self

import jax.numpy as jnp

from acausal import (
    Energy,
    Equations,
    Param,
    Requirements,
    Scalar,
    Var,
    eq,
    ifelse,
    nonnegative,
    positive,
    require,
)

from .._limit import limited
from ._interfaces import Compliant

TINY = 1e-100  # replaces zero, at which powers have no derivative


class ElastoGap(Compliant):
    """A spring and damper that only push: no force while s_rel > s_rel0 (MSL `ElastoGap`).

    In contact, f = -c s_ref x^n + d v_rel with the indentation x = (s_rel0 - s_rel)/s_ref. The damping force is limited
    to the absolute value of the first term, so that the force is continuous at contact and never pulls. Contact and
    reaching this limit are events.
    """

    c: Param[Scalar, "N/m", nonnegative]  # stiffness, as a secant at an indentation of s_ref
    d: Param[Scalar, "N.s/m", nonnegative]  # damping coefficient
    s_rel0: Param[Scalar, "m"] = 0.0  # relative position at which contact begins
    n: Param[Scalar, "1", positive] = 1.0  # exponent, at least 1; 1.5 for a Hertzian point contact
    s_ref: Param[Scalar, "m", positive] = 1.0  # reference length; with 1 m, c equals its value in N/m^n
    v_rel: Var[Scalar, "m/s"] = 0.0  # relative speed

    def requirements(self) -> Requirements:
        return (require(self.n >= 1.0, "n must be at least 1"),)

    def _power(self, exponent: Scalar) -> Scalar:
        """Power of x, 0 without contact. Written as |x|^(n-1) x, it continues smoothly where contact ends."""
        x = (self.s_rel0 - self.s_rel) / self.s_ref
        return ifelse(x > 0.0, jnp.maximum(jnp.abs(x), TINY) ** (exponent - 1.0) * x, 0.0)

    def _elastic(self) -> Scalar:
        return self.c * self.s_ref * self._power(self.n)

    def _damping(self) -> Scalar:
        most = self._elastic()
        return limited(self.d * self.v_rel, -most, most)

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(
            relative_speed=eq(self.v_rel, d.s_rel),
            law=eq(self.f, self._damping() - self._elastic()),
        )

    def energy(self) -> Energy:
        stored = self.c * self.s_ref**2 / (self.n + 1.0) * self._power(self.n + 1.0)
        return Energy(stored=stored, dissipated=self._damping() * self.v_rel)
