"""Ideal gears, and reducers with inertia and losses. The housing is the ground unless stated otherwise."""

from collections.abc import Mapping
from typing import ClassVar, Self

import jax.numpy as jnp

from acausal import (
    Component,
    Energy,
    Equations,
    Param,
    Record,
    Requirements,
    Scalar,
    Var,
    eq,
    nonnegative,
    nonzero,
    positive,
    prefer,
    require,
)

from .._data_sheet import DataSheet
from ._interfaces import Flange


class IdealGear(Component):
    """phi_a = ratio phi_b and ratio tau_a + tau_b = 0; lossless, massless, without backlash (MSL `IdealGear`).

    The housing is the ground. With `support=Flange()` it is a flange: the angles are then relative to it, and it takes
    the reaction -(tau_a + tau_b).
    """

    ratio: Param[Scalar, "1", nonzero]  # turns of a for one turn of b; negative for opposite senses of rotation
    a: Flange = Flange()
    b: Flange = Flange()
    support: Flange | None = None

    def equations(self, d: Self) -> Equations:
        torques = dict(torques=eq(self.ratio * self.a.tau + self.b.tau))
        if self.support is None:
            return dict(kinematics=eq(self.a.phi, self.ratio * self.b.phi)) | torques
        housing = self.support.phi
        return torques | dict(
            kinematics=eq(self.a.phi - housing, self.ratio * (self.b.phi - housing)),
            reaction=eq(self.support.tau + self.a.tau + self.b.tau),
        )


class PlanetaryGear(Component):
    """Ideal epicyclic gear (MSL `IdealPlanetary`).

    With i = ring_to_sun: (1 + i) phi_carrier = phi_sun + i phi_ring (Willis), tau_ring = i tau_sun and
    tau_carrier = -(1 + i) tau_sun. With the ring held, the speed ratio from sun to carrier is 1 + i.
    """

    elsewhere: ClassVar[Mapping[str, str]] = {"ratio": "ring_to_sun"}

    ring_to_sun: Param[Scalar, "1", positive]  # teeth of the ring over teeth of the sun
    sun: Flange = Flange()
    ring: Flange = Flange()
    carrier: Flange = Flange()

    def equations(self, d: Self) -> Equations:
        return dict(
            willis=eq((1.0 + self.ring_to_sun) * self.carrier.phi, self.sun.phi + self.ring_to_sun * self.ring.phi),
            torque_ring=eq(self.ring.tau, self.ring_to_sun * self.sun.tau),
            torque_carrier=eq(self.carrier.tau, -(1.0 + self.ring_to_sun) * self.sun.tau),
        )


class MeshLoss(Record):
    """Loss of a gear mesh in proportion to the power P that it delivers: P_loss = (1/efficiency - 1) P tanh(P / P_t).

    The driving torque is the ideal torque times 1 + (1/efficiency - 1) tanh(P / P_t). The efficiency is `efficiency`
    when driven forward and 2 - 1/efficiency when driven backward: equal loads cause equal friction. Below 0.5 the gear
    is self-locking (Niemann, Winter, `Maschinenelemente`, on worm gears).

    The law is smoothed: the loss fades out below the power P_t, so that a mesh at rest does not hold a load, and a
    self-locking mesh creeps at the power P_t atanh(efficiency / (1 - efficiency)).
    """

    efficiency: Param[Scalar, "1", positive]  # efficiency when driven forward, at most 1
    transition_power: Param[Scalar, "W", positive] = 0.1  # P_t, width of the transition through zero power

    def requirements(self) -> Requirements:
        return (require(self.efficiency <= 1.0, "efficiency must be at most 1"),)

    def factor(self, delivered: Scalar) -> Scalar:
        """Driving torque over ideal driving torque when the mesh delivers the given power in W."""
        return 1.0 + (1.0 / self.efficiency - 1.0) * jnp.tanh(delivered / self.transition_power)


class EqualMeshLoss(Record):
    """Loss of a gear mesh with the same efficiency in both directions.

    The driving torque is efficiency^-x times the ideal torque, with x = tanh(P/P_t) and the power P that the mesh
    delivers (Mueller, `Die Umlaufgetriebe`; VDI 2157). `MeshLoss` instead has the same friction in both directions, as
    in a worm gear, and explains the width P_t. Near an efficiency of 1 they differ by (1 - efficiency)^2.
    """

    efficiency: Param[Scalar, "1", positive]  # efficiency in both directions, at most 1
    transition_power: Param[Scalar, "W", positive] = 0.1  # P_t, width of the transition through zero power

    def requirements(self) -> Requirements:
        return (require(self.efficiency <= 1.0, "efficiency must be at most 1"),)

    def factor(self, delivered: Scalar) -> Scalar:
        """Driving torque over ideal driving torque when the mesh delivers the given power in W."""
        return self.efficiency ** -jnp.tanh(delivered / self.transition_power)


class PlanetaryGearbox(Component):
    """Single planetary stage with inertia and mesh losses; a reducer when its ring is held (connect it to `Fixed`).

    With N = ratio = 1 + teeth of the ring / teeth of the sun, and a prime for torques without the inertial part:

    - N phi_carrier = phi_sun + (N - 1) phi_ring (Willis);
    - tau_sun = J_sun dw_sun/dt + tau_sun', and likewise for the carrier;
    - tau_sun' + tau_ring + tau_carrier' = 0;
    - (N - 1) tau_sun' = tau_ring factor, where the factor is 1 or that of the mesh loss. Losses arise from rolling
      relative to the carrier (Mueller, `Die Umlaufgetriebe`): P is the power that the sun passes to the ring in the
      frame of the carrier. With the ring held, the efficiency from sun to carrier is (1 + (N - 1) eta) / N.

    Not modelled: backlash, elasticity, inertia of the ring and of the planets' spin, several stages, no-load losses.
    """

    ratio: Param[Scalar, "1", positive]  # N > 1, speed ratio from sun to carrier with the ring held
    J_sun: Param[Scalar, "kg.m2", nonnegative] = 0.0  # moment of inertia that turns with the sun
    J_carrier: Param[Scalar, "kg.m2", nonnegative] = 0.0  # moment of inertia that turns with the carrier, with planets
    loss: MeshLoss | EqualMeshLoss | None = None  # of the meshes in series, with the carrier held
    data_sheet: DataSheet | None = None  # source of the parameters; see `catalogues`
    w_sun: Var[Scalar, "rad/s", prefer] = 0.0  # speed of the sun
    w_carrier: Var[Scalar, "rad/s"] = 0.0  # speed of the carrier
    tau_mesh: Var[Scalar, "N.m"] = 0.0  # tau_sun'
    sun: Flange = Flange()
    ring: Flange = Flange()
    carrier: Flange = Flange()

    def requirements(self) -> Requirements:
        return (require(self.ratio > 1.0, "ratio must be greater than 1"),)

    @classmethod
    def from_teeth(
        cls,
        *,
        sun: int,
        ring: int,
        J_sun: Scalar = 0.0,
        J_carrier: Scalar = 0.0,
        loss: MeshLoss | EqualMeshLoss | None = None,
    ) -> "PlanetaryGearbox":
        """A stage with the given numbers of teeth."""
        return cls(ratio=1.0 + ring / sun, J_sun=J_sun, J_carrier=J_carrier, loss=loss)

    def equations(self, d: Self) -> Equations:
        return dict(
            willis=eq(self.ratio * self.carrier.phi, self.sun.phi + (self.ratio - 1.0) * self.ring.phi),
            speed_sun=eq(self.w_sun, d.sun.phi),
            speed_carrier=eq(self.w_carrier, d.carrier.phi),
            newton_sun=eq(self.J_sun * d.w_sun, self.sun.tau - self.tau_mesh),
            newton_carrier=eq(self.J_carrier * d.w_carrier, self.carrier.tau + (self.tau_mesh + self.ring.tau)),
            mesh=eq((self.ratio - 1.0) * self.tau_mesh, self.ring.tau * self._factor()),
        )

    def _delivered(self) -> Scalar:
        """Power passed to the ring in the frame of the carrier; w_ring - w_carrier = -(w_sun - w_carrier)/(N - 1)."""
        return self.ring.tau * (self.w_sun - self.w_carrier) / (self.ratio - 1.0)

    def _factor(self) -> Scalar:
        return 1.0 if self.loss is None else self.loss.factor(self._delivered())

    def energy(self) -> Energy:
        return Energy(
            stored=0.5 * self.J_sun * self.w_sun**2 + 0.5 * self.J_carrier * self.w_carrier**2,
            dissipated=(self._factor() - 1.0) * self._delivered(),
        )


class WormGear(Component):
    """Worm and wheel, phi_worm = ratio phi_wheel, with inertia of the worm and mesh loss.

    ratio (tau_worm - J dw/dt) + tau_wheel factor = 0. The factor is 1 or that of the mesh loss, with the power P
    delivered at the wheel. Not modelled: backlash, elasticity, bearing friction, no-load losses.
    """

    ratio: Param[Scalar, "1", positive]  # teeth of the wheel over starts of the worm
    J: Param[Scalar, "kg.m2", nonnegative] = 0.0  # moment of inertia that turns with the worm
    loss: MeshLoss | None = None
    w: Var[Scalar, "rad/s", prefer] = 0.0  # speed of the worm
    worm: Flange = Flange()
    wheel: Flange = Flange()

    def equations(self, d: Self) -> Equations:
        return dict(
            kinematics=eq(self.worm.phi, self.ratio * self.wheel.phi),
            speed=eq(self.w, d.worm.phi),
            newton=eq(self.ratio * self.J * d.w, self.ratio * self.worm.tau + self.wheel.tau * self._factor()),
        )

    def _delivered(self) -> Scalar:
        return -self.wheel.tau * self.w / self.ratio

    def _factor(self) -> Scalar:
        return 1.0 if self.loss is None else self.loss.factor(self._delivered())

    def energy(self) -> Energy:
        return Energy(stored=0.5 * self.J * self.w**2, dissipated=(self._factor() - 1.0) * self._delivered())
