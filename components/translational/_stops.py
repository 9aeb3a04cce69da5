"""Rigid stops, and a mass that moves between them."""

from typing import Self

import jax.numpy as jnp

from acausal import (
    Component,
    Connections,
    Discrete,
    Equations,
    Events,
    Param,
    Requirements,
    Scalar,
    Var,
    connect,
    eq,
    nonnegative,
    prefer,
    require,
)

from .. import _impact
from ._basic import Mass
from ._dry_friction import StribeckFriction
from ._interfaces import Flange


class HardStop(Component):
    """Rigid stops on the ground that keep a rod within s_min <= s <= s_max, with Newton's law of impact.

    At a stop the speed v turns to -restitution v. A rebound no faster than `v_rest` does not happen: the rod rests
    there, held by the contact force f, until it is pulled away. This ends the infinitely many jumps of a ball after a
    finite number; as |f| only pushes, nothing sticks. Impacts and lift-off are events. The rod has to have a mass. An
    impact changes the speed of what is rigidly joined to the rod, and no other: it is right for one moving body, but
    does not share an impulse among several that are joined by planetary gears or levers.

    Where a stop and dry friction hold the rod at once, the stop carries the load, since it does not creep; where two
    stops do, give one of them a `creep` of 1e-10 / kg.
    """

    s_min: Param[Scalar, "m"] = -jnp.inf  # position of the lower stop
    s_max: Param[Scalar, "m"] = jnp.inf  # position of the upper stop
    restitution: Param[Scalar, "1", nonnegative] = 0.0  # speed after over speed before an impact, at most 1
    v_rest: Param[Scalar, "m/s", nonnegative] = 1e-3  # rebound speed up to which it rests
    creep: Param[Scalar, "1/kg", nonnegative] = 0.0  # acceleration per force while it rests
    v: Var[Scalar, "m/s", prefer] = 0.0  # speed
    acceleration: Var[Scalar, "m/s2"] = 0.0
    f: Var[Scalar, "N"] = 0.0  # contact force into the stop; negative at the lower one
    path: Var[Scalar, "N"] = 0.0  # f while it rests, else the acceleration as a number
    mode: Discrete[Scalar, "1"] = 0.0  # -1 resting at the lower stop, 0 free, 1 at the upper one
    flange: Flange = Flange()

    def requirements(self) -> Requirements:
        return (
            require(self.s_min < self.s_max, "s_min must be smaller than s_max"),
            require(self.restitution <= 1.0, "restitution must be at most 1"),
        )

    def equations(self, d: Self) -> Equations:
        held = _impact.acceleration(
            self.mode, self.path, self.creep, place=self.flange.s, speed=self.v, low=self.s_min, high=self.s_max
        )  # fmt: skip
        return dict(
            speed=eq(self.v, d.flange.s),
            acceleration=eq(self.acceleration, d.v),
            held=eq(self.acceleration, held, check_units=False),
            contact=eq(self.f, _impact.effort(self.mode, self.path)),
            force=eq(self.flange.f, self.f),
        )

    def events(self) -> Events:
        return _impact.stops(
            self.mode, self.flange.s, self.v, self.path, self.s_min, self.s_max,
            e=self.restitution, slow=self.v_rest, name="v",
        )  # fmt: skip


class MassWithStopAndFriction(Component):
    """A mass with Stribeck friction between rigid stops without rebound (MSL `MassWithStopAndFriction`).

    `MassWithStopAndFriction(m=..., s_min=..., s_max=..., Fc=..., Fs=..., vs=..., C=...)`: see `StribeckFriction` and
    `HardStop`; v and s are the start values of speed and position.
    """

    mass: Mass
    friction: StribeckFriction
    stop: HardStop
    a: Flange = Flange()
    b: Flange = Flange()

    def __init__(
        self,
        *,
        m: Scalar,
        s_min: Scalar,
        s_max: Scalar,
        Fc: Scalar,
        Fs: Scalar,
        vs: Scalar,
        C: Scalar = 0.0,
        restitution: Scalar = 0.0,
        s: Scalar = 0.0,
        v: Scalar = 0.0,
    ) -> None:
        self.mass = Mass(m=m, v=v, a=Flange(s=s))
        self.friction = StribeckFriction(Fc=Fc, Fs=Fs, vs=vs, C=C)
        self.stop = HardStop(s_min=s_min, s_max=s_max, restitution=restitution)
        self.a, self.b = Flange(), Flange()

    def connections(self) -> Connections:
        return (
            connect(self.a, self.mass.a),
            connect(self.mass.b, self.friction.flange, self.stop.flange, self.b),
        )
