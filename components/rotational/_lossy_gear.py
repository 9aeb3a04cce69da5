"""Gear with losses, sticking and self-locking."""

from collections.abc import Mapping
from typing import ClassVar, Self

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
    yields,
)

from .. import _stick_slip as stick_slip
from .._checks import increasing
from .._tables import linear
from ._interfaces import Flange

SAME = 1e-10  # N.m, torques closer than this are treated as equal


class LossyGear(Component):
    """A gear with mesh and bearing losses, phi_a = ratio phi_b (MSL `LossyGear`; Pelchen, Schweiger, Otter 2002).

    `losses` has rows [w, eta1, eta2, bearing1, bearing2] for speeds |w_a| that increase from 0: the mesh efficiencies
    when a drives b and when b drives a, and the bearing friction in N.m in these two cases. Interpolation between the
    rows and extrapolation beyond the last are linear. x = -tau_b / ratio would be tau_a without losses. The torque
    tau_a that keeps the gear turning follows one of two lines, which cross where the mesh carries no torque:

    - forward, the greater of (x + bearing1) / eta1 (a drives b) and eta2 (x + bearing2) (b drives a);
    - backward, the lesser of (x - bearing1) / eta1 (a drives b) and eta2 (x - bearing2) (b drives a).

    The losses are therefore continuous when the load reverses, because the bearings take up the torque first: with
    equal bearing frictions, the driver changes at x = -bearing forward and at x = bearing backward. (This is the rule
    of MSL after 3.1, of C. Bertsch, `Problem with model LossyGear and a proposed solution`, 2009: the sign of tau_a
    minus the bearing friction at a decides. The rule of the paper, the sign of tau_a alone, leaves some loads without a
    solution.)

    At rest the gear is stuck as long as tau_a lies between the two. With eta2 <= 0 it is self-locking: b alone cannot
    drive it. `LossyGear.worm` has the same mesh friction in both directions of power: eta2 = 2 - 1 / eta1.

    Sticking, sliding and changes of the driver are events; for the modes and for `creep` see `DryFriction`. Impulses
    pass without losses. If several motions or none are possible, which can happen with eta2 < 0 and small inertias,
    the run fails with endless events.
    """

    mode_names: ClassVar[Mapping[str, Mapping[float, str]]] = {"mode": stick_slip.MODES}

    elsewhere: ClassVar[Mapping[str, str]] = {"lossTable": "losses"}

    ratio: Param[Scalar, "1", nonzero]  # turns of a for one turn of b
    losses: Param[Vector, ""]  # rows [w, eta1, eta2, bearing1, bearing2] in rad/s, 1, 1, N.m, N.m
    creep: Param[Scalar, "1/(kg.m2)", nonnegative] = stick_slip.CREEP  # acceleration of a per torque while stuck
    rest: Param[Scalar, "rad/s", nonnegative] = stick_slip.REST  # speed of a that counts as rest
    w: Var[Scalar, "rad/s", prefer] = 0.0  # speed of a
    acceleration: Var[Scalar, "rad/s2"] = 0.0  # acceleration of a
    x: Var[Scalar, "N.m"] = 0.0  # torque at a without losses
    path: Var[Scalar, "N.m"] = 0.0  # lost torque tau_a - x while stuck, otherwise the value of the acceleration
    mode: Discrete[Scalar, "1"] = stick_slip.FREE
    moving: Discrete[Scalar, "1"] = 0.0  # 1 once it turns fast enough to stick again
    driver: Discrete[Scalar, "1"] = 1.0  # 1 if a drives b, -1 if b drives a; without effect while stuck
    a: Flange = Flange()
    b: Flange = Flange()

    def requirements(self) -> Requirements:
        if self.losses.ndim != 2 or self.losses.shape[1] != 5:
            return (require(False, "losses must have rows [w, eta1, eta2, bearing1, bearing2]"),)
        speeds, eta1, eta2, bearing1, bearing2 = self.losses.T
        return (
            require(speeds[0] == 0.0, "losses must start at a speed of 0"),
            require(increasing(speeds), "losses must have increasing speeds"),
            require((eta1 > 0.0) & (eta1 <= 1.0), "losses must have eta1 above 0 and at most 1"),
            require(eta2 <= 1.0, "losses must have eta2 at most 1"),
            require(self.losses[:, 3:] >= 0.0, "losses must have bearing friction >= 0"),
            # The minimum power loss, with an unloaded mesh; negative only with eta2 < 0.
            require(
                (1.0 - eta2) * bearing1 + eta2 * (1.0 - eta1) * bearing2 >= 0.0,
                "losses must have bearing2 at most (1 - eta2) / (-eta2 (1 - eta1)) bearing1 if eta2 < 0",
            ),
        )

    @classmethod
    def worm(cls, *, ratio: Scalar, efficiency: Scalar) -> "LossyGear":
        """A worm a with its wheel b, without bearing friction; self-locking below an efficiency of 0.5."""
        row = [0.0, efficiency, 2.0 - 1.0 / efficiency, 0.0, 0.0]
        return cls(ratio=ratio, losses=jnp.stack([jnp.asarray(item, float) for item in row])[None])

    def _torques(self, direction: Scalar) -> tuple[Scalar, Scalar]:
        """Torques at a that turn the gear in a direction, 1 or -1, if a drives b and if b drives a."""
        row = self.losses[0, 1:]
        if len(self.losses) > 1:
            row = linear(stick_slip.along(self.mode, self.w), self.losses[:, 0], self.losses[:, 1:])
        eta1, eta2, bearing1, bearing2 = row
        return (self.x + direction * bearing1) / eta1, eta2 * (self.x + direction * bearing2)

    def equations(self, d: Self) -> Equations:
        driving, driven = self._torques(self.mode)
        sliding = jnp.where(self.driver > 0.0, driving, driven)
        held = jnp.where(stick_slip.stuck(self.mode), self.x + self.path, self.x)
        torque = jnp.where(stick_slip.rubs(self.mode), sliding, held)
        return dict(
            kinematics=eq(self.a.phi, self.ratio * self.b.phi),
            speed=eq(self.w, d.a.phi),
            acceleration=eq(self.acceleration, d.w),
            held=eq(
                self.acceleration,
                stick_slip.acceleration(self.mode, self.path, self.w, self.creep),
                check_units=False,
            ),
            ideal=eq(self.ratio * self.x + self.b.tau),
            losses=eq(self.a.tau, torque, check_units=False),
        )

    def events(self) -> Events:
        forward, backward = jnp.maximum(*self._torques(1.0)), jnp.minimum(*self._torques(-1.0))
        known = stick_slip.changes(
            self.mode, self.moving, self.w, self.path,
            low=backward - self.x, high=forward - self.x, rest=self.rest, creep=self.creep,
        )  # fmt: skip
        driving, driven = self._torques(self.mode)
        more = self.mode * (driving - driven)  # extra torque at a if a drives
        rubs = stick_slip.rubs(self.mode)
        return known | dict(
            # The losses depend on the sign of the impulse, which the mode before the impact does not know.
            _slips=yields(mode=stick_slip.FREE),
            drives=when(rubs & (self.driver < 0.0) & (more > SAME), driver=1.0),
            is_driven=when(rubs & (self.driver > 0.0) & (more < -SAME), driver=-1.0),
        )

    def energy(self) -> Energy:
        return Energy(dissipated=(self.a.tau - self.x) * self.w)
