"""Inertia, spring, damper and fixed flange."""

from collections.abc import Mapping
from typing import Any, Self

from acausal import (
    Component,
    Energy,
    Equations,
    Param,
    Record,
    Requirements,
    Scalar,
    Var,
    Vector,
    eq,
    nonnegative,
    positive,
    prefer,
)

from .._checks import damping
from .._starts import placed
from .._tables import monotone_cubic
from ._interfaces import Compliant, Flange


class Angle(Record):
    """Angle of a fixed flange."""

    phi0: Param[Scalar, "rad"]  # angle


class Fixed(Component):
    """A flange fixed at the angle phi0, zero by default (MSL `Fixed`).

    If phi0 is given, it is the parameter `place.phi0`. Otherwise there is no parameter, and the flange is eliminated.
    """

    place: Angle | None = None
    flange: Flange = Flange()

    def __init__(
        self,
        *,
        phi0: Param[Scalar, "rad"] | None = None,  # angle of the flange
        flange: Flange | None = None,
    ) -> None:
        self.place = None if phi0 is None else Angle(phi0=phi0)
        self.flange = Flange() if flange is None else flange

    def equations(self, d: Self) -> Equations:
        return dict(held=eq(self.flange.phi, 0.0 if self.place is None else self.place.phi0))


class Inertia(Component):
    """A rigid rotor, J dw/dt = tau_a + tau_b (MSL `Inertia`).

    `Inertia(J=..., phi=..., w=...)` starts at the given angle and speed. phi is the angle of the flanges and not a
    separate variable: `inertia.phi` reads `inertia.a.phi`, which is its name in results and start values.
    """

    J: Param[Scalar, "kg.m2", positive]  # moment of inertia
    w: Var[Scalar, "rad/s", prefer] = 0.0  # speed
    a: Flange = Flange()
    b: Flange = Flange()

    def __init__(
        self,
        *,
        J: Param[Scalar, "kg.m2"],
        phi: Param[Scalar, "rad"] | None = None,  # angle at the start
        w: Any = None,
        a: Flange | None = None,
        b: Flange | None = None,
        nominal: Mapping[str, Any] | None = None,
    ) -> None:
        self.J, self.w = J, w
        self.nominal = {} if nominal is None else nominal
        self.a, self.b = placed(self, Flange, "phi", phi, a), Flange() if b is None else b

    @property
    def phi(self) -> Scalar:
        """Angle in rad."""
        return self.a.phi

    def equations(self, d: Self) -> Equations:
        return dict(
            rigid=eq(self.a.phi, self.b.phi),
            speed=eq(self.w, d.a.phi),
            newton=eq(self.J * d.w, self.a.tau + self.b.tau),
        )

    def energy(self) -> Energy:
        return Energy(stored=0.5 * self.J * self.w**2)


class Disc(Component):
    """A rigid massless shaft with a fixed angle between its flanges, phi_b = phi_a + delta_phi."""

    delta_phi: Param[Scalar, "rad"] = 0.0  # fixed angle from a to b
    a: Flange = Flange()
    b: Flange = Flange()

    def equations(self, d: Self) -> Equations:
        return dict(rigid=eq(self.b.phi, self.a.phi + self.delta_phi), balance=eq(self.a.tau + self.b.tau))


class Spring(Compliant):
    """Linear torsion spring, tau = c (phi_rel - phi_rel0)."""

    c: Param[Scalar, "N.m/rad", nonnegative]  # stiffness
    phi_rel0: Param[Scalar, "rad"] = 0.0  # relative angle of the unloaded spring

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(hooke=eq(self.tau, self.c * (self.phi_rel - self.phi_rel0)))

    def energy(self) -> Energy:
        return Energy(stored=0.5 * self.c * (self.phi_rel - self.phi_rel0) ** 2)


class Damper(Compliant):
    """Linear damper, tau = d w_rel."""

    d: Param[Scalar, "N.m.s/rad", nonnegative]  # damping coefficient
    w_rel: Var[Scalar, "rad/s"] = 0.0  # relative speed

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(
            relative_speed=eq(self.w_rel, d.phi_rel),
            damping=eq(self.tau, self.d * self.w_rel),
        )

    def energy(self) -> Energy:
        return Energy(dissipated=self.d * self.w_rel**2)


class SpringDamper(Compliant):
    """Spring and damper in parallel, tau = c (phi_rel - phi_rel0) + d w_rel."""

    c: Param[Scalar, "N.m/rad", nonnegative]  # stiffness
    d: Param[Scalar, "N.m.s/rad", nonnegative]  # damping coefficient
    phi_rel0: Param[Scalar, "rad"] = 0.0  # relative angle of the unloaded spring
    w_rel: Var[Scalar, "rad/s"] = 0.0  # relative speed

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(
            relative_speed=eq(self.w_rel, d.phi_rel),
            law=eq(self.tau, self.c * (self.phi_rel - self.phi_rel0) + self.d * self.w_rel),
        )

    def energy(self) -> Energy:
        return Energy(
            stored=0.5 * self.c * (self.phi_rel - self.phi_rel0) ** 2,
            dissipated=self.d * self.w_rel**2,
        )


class TabulatedDamper(Compliant):
    """A torsional damper with a sampled characteristic tau(w_rel), such as that of a viscous coupling.

    Monotone cubic interpolation with continuous slope, without extrema between the samples (Fritsch, Butland 1984);
    linear extrapolation beyond them. The origin is a sample, because a damper at rest carries no torque.
    """

    speeds: Param[Vector, "rad/s"]  # relative speeds, increasing, with 0 among them
    torques: Param[Vector, "N.m"]  # torques at these speeds, with the sign of the speed
    w_rel: Var[Scalar, "rad/s"] = 0.0  # relative speed

    def requirements(self) -> Requirements:
        return damping(self, "torques", "speeds")

    def torque(self) -> Scalar:
        """Torque at the current relative speed in N.m."""
        return monotone_cubic(self.w_rel, self.speeds, self.torques)

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(
            relative_speed=eq(self.w_rel, d.phi_rel),
            characteristic=eq(self.tau, self.torque()),
        )

    def energy(self) -> Energy:
        return Energy(dissipated=self.torque() * self.w_rel)
