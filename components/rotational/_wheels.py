"""Wheel, rack and pinion, lead screw, and belt drives."""

from collections.abc import Mapping
from typing import Any, ClassVar, Self

import jax.numpy as jnp

from acausal import Component, Energy, Equations, Events, Param, Scalar, Var, eq, nonnegative, nonzero, positive, refuse

from ..translational import Flange as Rod
from ._interfaces import Flange


class IdealGearR2T(Component):
    """phi = ratio s and ratio tau + f = 0; lossless, massless, without backlash (MSL `IdealGearR2T`).

    A rack and pinion, or a lead screw.
    """

    elsewhere: ClassVar[Mapping[str, str]] = {"flangeR": "shaft", "flangeT": "rod"}

    ratio: Param[Scalar, "rad/m", nonzero]  # angle of the shaft per travel of the rod
    shaft: Flange = Flange()
    rod: Rod = Rod()

    def equations(self, d: Self) -> Equations:
        return dict(
            kinematics=eq(self.shaft.phi, self.ratio * self.rod.s),
            virtual_work=eq(self.ratio * self.shaft.tau + self.rod.f),
        )


class IdealRollingWheel(Component):
    """s = radius phi and tau + radius f = 0: a massless wheel that rolls without slip (MSL `IdealRollingWheel`)."""

    elsewhere: ClassVar[Mapping[str, str]] = {"flangeR": "shaft", "flangeT": "rod"}

    radius: Param[Scalar, "m", nonzero]  # radius of the wheel
    shaft: Flange = Flange()
    rod: Rod = Rod()  # moves with the axle

    def equations(self, d: Self) -> Equations:
        return dict(
            kinematics=eq(self.rod.s, self.radius * self.shaft.phi),
            virtual_work=eq(self.shaft.tau + self.radius * self.rod.f),
        )


class Belt(Component, partial=True):
    """An elastic open belt between two pulleys, which turn in the same direction, with strands under pretension.

    With x = r_a phi_a - r_b phi_b, the strands are stretched by x and -x. Both have the stiffness EA/length and damping
    d, so that F = 2 (EA/length x + d dx/dt) is the difference of their tensions F_0 + F/2 and F_0 - F/2, tau_a = r_a F
    and tau_b = -r_b F. The axles carry 2 F_0 (Roloff, Matek, `Maschinenelemente`, Riementriebe). Not modelled: the mass
    of the belt, creep, the mesh of teeth. The bearings of both pulleys are on the ground.
    """

    r_a: Param[Scalar, "m", positive]  # radius of the pulley at a
    r_b: Param[Scalar, "m", positive]  # radius of the pulley at b
    F_0: Param[Scalar, "N", positive]  # pretension of a strand
    EA: Param[Scalar, "N", positive]  # force per strain
    length: Param[Scalar, "m", positive]  # length of a strand between the pulleys
    d: Param[Scalar, "N.s/m", nonnegative] = 0.0  # damping coefficient of a strand
    x: Var[Scalar, "m"] = 0.0  # elongation of the strand that pulls if a drives forward
    v: Var[Scalar, "m/s"] = 0.0  # dx/dt
    F: Var[Scalar, "N"] = 0.0  # transmitted force, the difference of the tensions
    a: Flange = Flange()
    b: Flange = Flange()

    def equations(self, d: Any) -> Equations:
        return dict(
            stretch=eq(self.x, self.r_a * self.a.phi - self.r_b * self.b.phi),
            rate=eq(self.v, d.x),
            law=eq(self.F, 2.0 * (self.EA / self.length * self.x + self.d * self.v)),
            torque_a=eq(self.a.tau, self.r_a * self.F),
            torque_b=eq(self.b.tau, -self.r_b * self.F),
        )

    def energy(self) -> Energy:
        return Energy(stored=self.EA / self.length * self.x**2, dissipated=2.0 * self.d * self.v**2)


class SynchronousBelt(Belt):
    """A toothed belt: see `Belt`. A run ends with an error if a strand becomes slack, at |F| = 2 F_0."""

    def events(self) -> Events:
        is_slack = jnp.abs(self.F) > 2.0 * self.F_0
        return dict(slack=refuse(is_slack, "a strand of a belt is slack. Increase its pretension F_0."))


class FrictionBelt(Belt):
    """A flat or V-belt: see `Belt`. A run ends with an error if it would slip, at |F| = 2 F_0 tanh(mu wrap/2).

    There the ratio of the tensions is exp(mu wrap) (Euler, Eytelwein). For a V-belt, mu is the coefficient of friction
    over the sine of half the groove angle.
    """

    mu: Param[Scalar, "1", positive]  # coefficient of friction between belt and pulley
    wrap: Param[Scalar, "rad", positive]  # smaller wrap angle of both pulleys

    def grip(self) -> Scalar:
        """Greatest force in N that the belt transmits without slip."""
        return 2.0 * self.F_0 * jnp.tanh(0.5 * self.mu * self.wrap)

    def events(self) -> Events:
        slips = jnp.abs(self.F) > self.grip()
        return dict(slip=refuse(slips, "a belt slips. Increase its pretension F_0, mu or wrap, or reduce the torque."))
