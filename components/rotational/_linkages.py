"""Crank and slider, flexible coupling, release bearing."""

from typing import Self

import jax.numpy as jnp

from acausal import (
    Component,
    Energy,
    Equations,
    Param,
    Requirements,
    Scalar,
    Var,
    eq,
    nonnegative,
    positive,
    prefer,
    require,
)

from ..translational import Flange as Rod
from ._interfaces import Compliant, Flange


class CrankSlider(Component):
    """Crank and slider: s = r cos(phi) + sqrt(l^2 - (r sin(phi) - e)^2) from the axis of the crank; tau = -f ds/dphi.

    At phi = 0 the crank points along the slider's line, which is the outer dead centre without offset. Rigid, massless,
    without friction or backlash. A full turn requires r + |e| < l (Norton, `Design of Machinery`). For a crank that
    lifts from s = 0, see `EccentricDisc`.
    """

    crank: Param[Scalar, "m", positive]  # r, radius of the crank
    rod_length: Param[Scalar, "m", positive]  # l, length of the connecting rod
    offset: Param[Scalar, "m"] = 0.0  # e, offset of the slider's line from the axis, towards phi = pi/2
    slope: Var[Scalar, "m/rad"] = 0.0  # ds/dphi
    shaft: Flange = Flange()
    slider: Rod = Rod()

    def requirements(self) -> Requirements:
        reach = self.crank + jnp.abs(self.offset)
        return (require(reach < self.rod_length, "rod_length must be above crank + |offset|"),)

    def _across(self) -> Scalar:
        return self.crank * jnp.sin(self.shaft.phi) - self.offset

    def _along(self) -> Scalar:
        return jnp.sqrt(self.rod_length**2 - self._across() ** 2)

    @property
    def rod_angle(self) -> Scalar:
        """Angle between the connecting rod and the slider's line in rad."""
        return jnp.arcsin(self._across() / self.rod_length)

    def equations(self, d: Self) -> Equations:
        sine, cosine = self.crank * jnp.sin(self.shaft.phi), self.crank * jnp.cos(self.shaft.phi)
        return dict(
            position=eq(self.slider.s, cosine + self._along()),
            slope=eq(self.slope, -sine - self._across() * cosine / self._along()),
            virtual_work=eq(self.shaft.tau, -self.slider.f * self.slope),
        )


class FlexibleCoupling(Compliant):
    """An elastic coupling with the inertia of its halves: tau = c x + c_3 x^3 + d dx/dt, x = phi_rel - phi_rel0.

    J_a dw_a/dt = tau_a + tau and J_b dw_b/dt = tau_b - tau (DIN 740-2, with a progressive stiffness). Data sheets of
    rubber couplings state the relative damping psi, the loss per cycle over the elastic energy: d = psi c/(2 pi w) at
    the angular frequency w. Not modelled: damping that depends on frequency and temperature, radial and angular
    misalignment. A `SpringDamper` has no inertia, an `ElastoBacklash` has backlash.
    """

    J_a: Param[Scalar, "kg.m2", positive]  # moment of inertia of the half at a
    J_b: Param[Scalar, "kg.m2", positive]  # moment of inertia of the half at b
    c: Param[Scalar, "N.m/rad", positive]  # stiffness at the unloaded angle
    d: Param[Scalar, "N.m.s/rad", nonnegative] = 0.0  # damping coefficient
    c_3: Param[Scalar, "N.m/rad3", nonnegative] = 0.0  # coefficient of the progressive (cubic) part
    phi_rel0: Param[Scalar, "rad"] = 0.0  # relative angle without load
    w_a: Var[Scalar, "rad/s", prefer] = 0.0  # speed of a
    w_b: Var[Scalar, "rad/s", prefer] = 0.0  # speed of b

    def equations(self, d: Self) -> Equations:
        x = self.phi_rel - self.phi_rel0
        return dict(
            relative_angle=eq(self.phi_rel, self.b.phi - self.a.phi),
            speed_a=eq(self.w_a, d.a.phi),
            speed_b=eq(self.w_b, d.b.phi),
            law=eq(self.tau, self.c * x + self.c_3 * x**3 + self.d * (self.w_b - self.w_a)),
            newton_a=eq(self.J_a * d.w_a, self.a.tau + self.tau),
            newton_b=eq(self.J_b * d.w_b, self.b.tau - self.tau),
        )

    def energy(self) -> Energy:
        x = self.phi_rel - self.phi_rel0
        halves = 0.5 * self.J_a * self.w_a**2 + 0.5 * self.J_b * self.w_b**2
        return Energy(
            stored=halves + 0.5 * self.c * x**2 + 0.25 * self.c_3 * x**4,
            dissipated=self.d * (self.w_b - self.w_a) ** 2,
        )


class ReleaseBearing(Component):
    """A thrust bearing that passes the force F from a to b; side b turns with a shaft. Drag mu |F| d/2 tanh(w/w_0).

    The estimate of bearing makers, M = 0.5 mu P d with the bore d (SKF, `Rolling bearings`, friction): mu is about
    0.002 for angular-contact and 0.0013 for thrust ball bearings at moderate load and speed. The drag brakes the shaft
    against the ground and fades out below the speed w_0. Axially rigid and massless, for either sign of F. For the
    friction of the sleeve on its guide, add a `translational.DryFriction`.
    """

    mu: Param[Scalar, "1", nonnegative]  # coefficient of friction
    diameter: Param[Scalar, "m", positive]  # d, bore to which mu refers
    w_0: Param[Scalar, "rad/s", positive] = 1.0  # width of the transition through rest
    w: Var[Scalar, "rad/s"] = 0.0  # speed of the shaft
    f: Var[Scalar, "N"] = 0.0  # force passed from a to b
    a: Rod = Rod()
    b: Rod = Rod()
    shaft: Flange = Flange()

    def equations(self, d: Self) -> Equations:
        return dict(
            rigid=eq(self.a.s, self.b.s),
            force_a=eq(self.f, self.a.f),
            force_b=eq(self.f, -self.b.f),
            speed=eq(self.w, d.shaft.phi),
            drag=eq(self.shaft.tau, self._drag()),
        )

    def _drag(self) -> Scalar:
        return 0.5 * self.mu * self.diameter * jnp.abs(self.f) * jnp.tanh(self.w / self.w_0)

    def energy(self) -> Energy:
        return Energy(dissipated=self._drag() * self.w)
