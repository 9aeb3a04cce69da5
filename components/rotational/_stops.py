"""Rigid stops of a shaft."""

from typing import Self

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
    eq,
    nonnegative,
    prefer,
    require,
    unbounded,
)

from .. import _impact
from ._interfaces import Flange


class HardStop(Component):
    """Rigid stops on the ground that keep a shaft within phi_min <= phi <= phi_max, with Newton's law of impact.

    At a stop the speed w turns to -restitution w. A rebound no faster than `rest` does not happen: the shaft rests
    there, held by the contact torque, until it is pulled away. So rebounds that would go on without end, ever smaller,
    end after a finite number. Impacts and lift-off are events. The shaft has to have an inertia. An impact changes the
    speed of what is rigidly joined to the shaft, and no other: it is right for one moving body, but does not share an
    impulse among several that are joined by planetary gears or levers.

    Where a stop and dry friction hold the shaft at once, the stop carries the load, since it does not creep; where two
    stops do, give one of them a `creep` of 1e-10 / (kg.m2).
    """

    phi_min: Param[Scalar, "rad", unbounded] = -jnp.inf  # angle of the lower stop
    phi_max: Param[Scalar, "rad", unbounded] = jnp.inf  # angle of the upper stop
    restitution: Param[Scalar, "1", nonnegative] = 0.0  # speed after over speed before an impact, at most 1
    rest: Param[Scalar, "rad/s", nonnegative] = 1e-3  # rebound speed up to which it rests
    creep: Param[Scalar, "1/(kg.m2)", nonnegative] = 0.0  # acceleration per torque while it rests
    w: Var[Scalar, "rad/s", prefer] = 0.0  # speed
    acceleration: Var[Scalar, "rad/s2"] = 0.0
    tau: Var[Scalar, "N.m"] = 0.0  # contact torque into the stop; negative at the lower one
    path: Var[Scalar, "N.m"] = 0.0  # tau while it rests, else the acceleration as a number
    mode: Discrete[Scalar, "1"] = 0.0  # -1 resting at the lower stop, 0 free, 1 at the upper one
    flange: Flange = Flange()

    def requirements(self) -> Requirements:
        return (
            require(self.phi_min < self.phi_max, "phi_min must be smaller than phi_max"),
            require(self.restitution <= 1.0, "restitution must be at most 1"),
        )

    def equations(self, d: Self) -> Equations:
        held = _impact.acceleration(
            self.mode, self.path, self.creep, place=self.flange.phi, speed=self.w, low=self.phi_min, high=self.phi_max
        )  # fmt: skip
        return dict(
            speed=eq(self.w, d.flange.phi),
            acceleration=eq(self.acceleration, d.w),
            held=eq(self.acceleration, held, check_units=False),
            contact=eq(self.tau, _impact.effort(self.mode, self.path)),
            torque=eq(self.flange.tau, self.tau),
        )

    def events(self) -> Events:
        return _impact.stops(
            self.mode, self.flange.phi, self.w, self.path, self.phi_min, self.phi_max,
            e=self.restitution, slow=self.rest, name="w",
        )  # fmt: skip

    def energy(self) -> Energy:
        """What is left of a speed while it rests is taken from it; what impacts take is listed with the events."""
        return Energy(dissipated=self.tau * self.w)
