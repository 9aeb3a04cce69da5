"""A gear with losses that sticks and locks itself."""

from typing import Any, Self

import jax.numpy as jnp

from acausal import (
    Component,
    Discrete,
    Energy,
    Equations,
    Events,
    Param,
    Requirements,
    Scalar,
    Var,
    Vector,
    eq,
    nonnegative,
    nonzero,
    prefer,
    require,
    when,
)

from .. import _pieces as pieces
from .. import _stick_slip as stick_slip
from .._checks import increasing
from .._tables import linear
from ._interfaces import Flange

NO_LOAD = 1e-10  # torque in N.m that counts as none


class LossyGear(Component):
    """A gear with mesh and bearing losses, phi_a = ratio phi_b (MSL `LossyGear`; Pelchen, Schweiger, Otter 2002).

    `losses` has a row [w, eta1, eta2, bearing1, bearing2] for each of some speeds |w_a|, increasing from 0: the mesh
    efficiencies when a drives b and when b drives a, and the bearing friction in N.m in these two cases; straight lines
    between the rows, the last one goes on. With x = -tau_b / ratio, which would be tau_a without losses, the torque
    tau_a that keeps the gear turning forward, w_a > 0, is

    - (x + bearing1) / eta1 where a drives b, x > 0, and eta2 (x + bearing2) where b drives a, x < 0;

    and turning backward eta2 (x - bearing2) for x > 0, (x - bearing1) / eta1 for x < 0. At rest the gear is stuck as
    long as tau_a lies between the two. With eta2 <= 0 it locks itself: b alone cannot drive it. Mesh friction that
    does not depend on the direction of power has eta2 = 2 - 1 / eta1, as in worm gears: `LossyGear.worm`.

    What sticks, slides and changes sides are events; for the modes and for `creep` see `DryFriction`. Where several
    motions are possible or none, as may be with eta2 < 0 and small inertias, the run ends with endless events.
    """

    ratio: Param[Scalar, "1", nonzero]  # turns of a for one turn of b
    losses: Param[Vector, ""]  # rows [w, eta1, eta2, bearing1, bearing2] in rad/s, 1, 1, N.m, N.m
    creep: Param[Scalar, "1/(kg.m2)", nonnegative] = stick_slip.CREEP  # acceleration of a per torque while stuck
    rest: Param[Scalar, "rad/s", nonnegative] = stick_slip.REST  # speed of a that counts as rest
    w: Var[Scalar, "rad/s", prefer] = 0.0  # speed of a
    acceleration: Var[Scalar, "rad/s2"] = 0.0  # acceleration of a
    x: Var[Scalar, "N.m"] = 0.0  # torque at a without losses
    path: Var[Scalar, "N.m"] = 0.0  # lost torque tau_a - x while stuck, else the acceleration as a number
    mode: Discrete[Scalar, "1"] = stick_slip.FREE
    moving: Discrete[Scalar, "1"] = 0.0  # 1 while it turns faster than at rest
    side: Discrete[Scalar, "1"] = 1.0  # sign of x
    piece: Discrete[Scalar, "1"] = 0.0  # number of rows below the speed
    a: Flange = Flange()
    b: Flange = Flange()

    def requirements(self) -> Requirements:
        if self.losses.ndim != 2 or self.losses.shape[1] != 5:
            return (require(False, "losses must have rows [w, eta1, eta2, bearing1, bearing2]"),)
        speeds, eta1, eta2 = self.losses[:, 0], self.losses[:, 1], self.losses[:, 2]
        return (
            require(speeds[0] == 0.0, "losses must be led by a speed of 0"),
            require(increasing(speeds), "losses must have increasing speeds"),
            require((eta1 > 0.0) & (eta1 <= 1.0), "losses must have eta1 above 0 and at most 1"),
            require(eta2 <= 1.0, "losses must have eta2 at most 1"),
            require(self.losses[:, 3:] >= 0.0, "losses must have bearing friction >= 0"),
        )

    @classmethod
    def worm(cls, *, ratio: Scalar, efficiency: Scalar) -> "LossyGear":
        """A worm a with its wheel b, without bearing friction: it locks itself below an efficiency of 0.5."""
        row = [0.0, efficiency, 2.0 - 1.0 / efficiency, 0.0, 0.0]
        return cls(ratio=ratio, losses=jnp.stack([jnp.asarray(item, float) for item in row])[None])

    def _limits(self, side: Any) -> tuple[Scalar, Scalar]:
        """The torques at a that turn the gear forward and backward, with x on the given side (its sign)."""
        row = self.losses[0, 1:]
        if len(self.losses) > 1:
            row = linear(stick_slip.along(self.mode, self.w), self.losses[:, 0], self.losses[:, 1:], self.piece)
        eta1, eta2, bearing1, bearing2 = row
        forward = jnp.where(side > 0.0, (self.x + bearing1) / eta1, eta2 * (self.x + bearing2))
        backward = jnp.where(side > 0.0, eta2 * (self.x - bearing2), (self.x - bearing1) / eta1)
        return forward, backward

    def equations(self, d: Self) -> Equations:
        forward, backward = self._limits(self.side)
        sliding = jnp.where(self.mode == 1.0, forward, jnp.where(self.mode == -1.0, backward, self.x))
        torque = jnp.where(stick_slip.stuck(self.mode), self.x + self.path, sliding)
        held = stick_slip.acceleration(self.mode, self.path, self.w, self.creep)
        return dict(
            kinematics=eq(self.a.phi, self.ratio * self.b.phi),
            speed=eq(self.w, d.a.phi),
            acceleration=eq(self.acceleration, d.w),
            held=eq(self.acceleration, held, check_units=False),
            ideal=eq(self.ratio * self.x + self.b.tau),
            losses=eq(self.a.tau, torque, check_units=False),
        )

    def events(self) -> Events:
        forward, backward = self._limits(jnp.where(self.x >= 0.0, 1.0, -1.0))
        known = stick_slip.changes(
            self.mode, self.moving, self.w, self.path,
            low=backward - self.x, high=forward - self.x, rest=self.rest, creep=self.creep,
        )  # fmt: skip
        if len(self.losses) > 1:
            known |= pieces.passes_through(stick_slip.along(self.mode, self.w), self.piece, self.losses[:, 0])
        return known | dict(
            drives=when((self.side < 0.0) & (self.x > NO_LOAD), side=1.0),
            is_driven=when((self.side > 0.0) & (self.x < -NO_LOAD), side=-1.0),
        )

    def energy(self) -> Energy:
        return Energy(dissipated=(self.a.tau - self.x) * self.w)
