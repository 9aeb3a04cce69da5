"""Contact between two bodies: rigid, or elastic with lift-off."""

from collections.abc import Mapping
from typing import ClassVar, Self

import jax.numpy as jnp

from acausal import (
    Discrete,
    Energy,
    Equations,
    Events,
    Param,
    Requirements,
    Scalar,
    Var,
    eq,
    ifelse,
    nonnegative,
    positive,
    require,
    yields,
)

from .. import _impact
from .._limit import limited
from ._interfaces import Compliant


class RigidContact(Compliant):
    """Rigid contact that keeps s_rel >= s_rel0, with Newton's law of impact: v_rel changes to -restitution v_rel.

    The impulse changes the speeds of the whole model, also through gears, levers, belts and racks, and conserves their
    momentum. Closed contacts transmit it or separate. Contacts struck at one instant share the impulse so that each of
    them obeys the law or separates faster (`acausal.impact`). A body that strikes two others in touch, all of mass m,
    moves at -1/3 of its speed after an elastic impact if their contact is closed. If they only touch, unloaded, the
    contacts are struck one after the other, as in Newton's cradle.

    If the rebound is no faster than `rest`, the bodies move on together, until they are pulled apart. Impacts and
    separation are events. Friction that sticks lets go during an impact. For a stop on the ground see `HardStop`, for
    an elastic contact `ElastoGap`.
    """

    mode_names: ClassVar[Mapping[str, Mapping[float, str]]] = {"mode": {_impact.LOW: "together", _impact.FREE: "apart"}}

    s_rel0: Param[Scalar, "m"] = 0.0  # relative position at contact
    restitution: Param[Scalar, "1", nonnegative] = 0.0  # ratio of the relative speeds after and before, at most 1
    rest: Param[Scalar, "m/s", nonnegative] = 1e-3  # rebound speed up to which the bodies stay together
    creep: Param[Scalar, "1/kg", nonnegative] = 0.0  # relative acceleration per force while together
    v_rel: Var[Scalar, "m/s"] = 0.0  # relative speed, negative while the bodies approach
    acceleration: Var[Scalar, "m/s2"] = 0.0  # its rate
    path: Var[Scalar, "N"] = 0.0  # f while together, otherwise the value of the relative acceleration
    mode: Discrete[Scalar, "1"] = _impact.FREE  # -1 together, 0 apart
    push: Discrete[Scalar, "N"] = 0.0  # force of an impact, positive apart; zero except at an impact

    def requirements(self) -> Requirements:
        return (require(self.restitution <= 1.0, "restitution must be at most 1"),)

    def equations(self, d: Self) -> Equations:
        held = _impact.acceleration(
            self.mode, self.path, self.creep, place=self.s_rel, speed=self.v_rel, low=self.s_rel0, high=jnp.inf
        )
        return super().equations(d) | dict(
            speed=eq(self.v_rel, d.s_rel),
            acceleration=eq(self.acceleration, d.v_rel),
            held=eq(self.acceleration, held, check_units=False),
            contact=eq(self.f, _impact.effort(self.mode, self.path, -self.push)),
        )

    def events(self) -> Events:
        return _impact.stop(
            _impact.LOW, self.mode, self.s_rel0 - self.s_rel, self.v_rel, self.acceleration, self.path,
            e=self.restitution, slow=self.rest, push="push",
        ) | dict(_yields=yields(mode=_impact.FREE))  # fmt: skip

    def energy(self) -> Energy:
        """Supplies the work that parts overlapping bodies; impact losses are recorded with the events."""
        return Energy(supplied=-self.f * self.v_rel)


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
