"""Rigid contact between two bodies."""

from typing import Any, Self

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
    nonnegative,
    prefer,
    require,
    when,
)

from .. import _impact
from ._interfaces import Compliant

RESTS, FREE, PROBED = -1.0, 0.0, 1.0
PROBE = -1.0  # N, contact force during the instant in which the masses are felt


class RigidContact(Compliant):
    """Rigid contact that keeps s_rel >= s_rel0, with Newton's law of impact: v_rel changes to -restitution v_rel.

    The impulse P is the same on both sides, and each speed changes by P / m. The contact does not know the masses m: at
    an impact, it applies a probing force for an instant, and the accelerations answer with the mass of all that moves
    with each flange, such as J_1 / r^2 + J_2 / (i r)^2 of a gear pair behind a rack. If the rebound is no faster than
    `rest`, the bodies move on together, until they are pulled apart. Impacts and separation are events.

    Each flange must belong to one moving train: of a train with several degrees of freedom, such as a planetary gear
    with no shaft held, only the speed of the flange changes. A friction pair that sticks continues to stick during the
    impact. For a stop on the ground see `HardStop`, for an elastic contact `ElastoGap`.
    """

    s_rel0: Param[Scalar, "m"] = 0.0  # relative position at contact
    restitution: Param[Scalar, "1", nonnegative] = 0.0  # ratio of the relative speeds after and before, at most 1
    rest: Param[Scalar, "m/s", nonnegative] = 1e-3  # rebound speed up to which the bodies stay together
    creep: Param[Scalar, "1/kg", nonnegative] = 0.0  # relative acceleration per force while together
    v_a: Var[Scalar, "m/s", prefer] = 0.0  # speed of a
    v_b: Var[Scalar, "m/s", prefer] = 0.0  # speed of b
    acceleration_a: Var[Scalar, "m/s2"] = 0.0
    acceleration_b: Var[Scalar, "m/s2"] = 0.0
    path: Var[Scalar, "N"] = 0.0  # f while together, otherwise the value of the relative acceleration
    mode: Discrete[Scalar, "1"] = FREE  # -1 together, 0 apart, 1 during an impact
    before_a: Discrete[Scalar, "m/s2"] = 0.0  # accelerations without the probing force
    before_b: Discrete[Scalar, "m/s2"] = 0.0

    def requirements(self) -> Requirements:
        return (require(self.restitution <= 1.0, "restitution must be at most 1"),)

    @property
    def v_rel(self) -> Scalar:
        """Relative speed in m/s, negative while the bodies approach."""
        return self.v_b - self.v_a

    def equations(self, d: Self) -> Equations:
        held = _impact.acceleration(
            jnp.where(self.mode == RESTS, RESTS, FREE), self.path, self.creep,
            place=self.s_rel, speed=self.v_rel, low=self.s_rel0, high=jnp.inf,
        )  # fmt: skip
        apart = jnp.where(self.mode == PROBED, PROBE, 0.0)
        return super().equations(d) | dict(
            speed_a=eq(self.v_a, d.a.s),
            speed_b=eq(self.v_b, d.b.s),
            acceleration_a=eq(self.acceleration_a, d.v_a),
            acceleration_b=eq(self.acceleration_b, d.v_b),
            held=eq(self.acceleration_b - self.acceleration_a, held, check_units=False),
            contact=eq(self.f, jnp.where(self.mode == RESTS, self.path, apart), check_units=False),
        )

    def events(self) -> Events:
        speed, slow = self.v_rel, self.rest
        beyond, free = self.s_rel0 - self.s_rel, self.mode == FREE
        presses = (beyond >= 0.0) & (-self.path > _impact.PRESS * slow / _impact.LAG) | (beyond > slow * _impact.LAG)

        def probe(condition: Any) -> Any:
            return when(free & condition, mode=PROBED, before_a=self.acceleration_a, before_b=self.acceleration_b)

        stays = self.restitution * jnp.abs(speed) <= slow
        answer_a, answer_b = self.acceleration_a - self.before_a, self.acceleration_b - self.before_b
        change = -jnp.where(stays, 1.0, 1.0 + self.restitution) * speed / (answer_b - answer_a)
        return dict(
            impact=probe((beyond > 0.0) & (-speed > 1e-6 * slow)),
            rest=probe((jnp.abs(speed) <= slow) & presses),
            share=when(
                self.mode == PROBED,
                mode=jnp.where(stays, RESTS, FREE),
                v_a=self.v_a + answer_a * change,
                v_b=self.v_b + answer_b * change,
            ),
            lift=when((self.mode == RESTS) & (self.path > 0.0), mode=FREE),
        )

    def energy(self) -> Energy:
        """Supplies the work that parts overlapping bodies; impact losses are recorded with the events."""
        return Energy(supplied=-self.f * self.v_rel)
