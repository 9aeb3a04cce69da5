"""Conical disc springs: Belleville springs and the diaphragm spring of a clutch."""

from typing import Self

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
    positive,
    require,
)

from .._limit import positive_part
from ._interfaces import Compliant, Flange


def _cubic(s: Scalar, rate: Scalar, height: Scalar, thickness: Scalar) -> Scalar:
    """rate s [(h - s)(h - s/2) + t^2]."""
    return rate * s * ((height - s) * (height - 0.5 * s) + thickness**2)


def _area(s: Scalar, rate: Scalar, height: Scalar, thickness: Scalar) -> Scalar:
    """Integral of `_cubic` from 0 to s."""
    return rate * s**2 * (0.5 * (height**2 + thickness**2) - 0.5 * height * s + 0.125 * s**2)


class ConicalDisc(Record):
    """A disc spring loaded at its edges: F = 4 E/(1 - nu^2) t^4/(K_1 De^2) s/t [(h/t - s/t)(h/t - s/(2 t)) + 1].

    K_1 = ((d - 1)/d)^2/((d + 1)/(d - 1) - 2/ln(d))/pi with d = De/Di (Almen, Laszlo, Trans. ASME 58, 1936; DIN EN
    16984). Valid for 0 <= s <= h; contact flats, friction and set are neglected. Above h/t = sqrt(2) the force has a
    maximum and a minimum, at s = h -+ sqrt((h^2 - 2 t^2)/3).
    """

    De: Param[Scalar, "m", positive]  # outer diameter
    Di: Param[Scalar, "m", positive]  # inner diameter
    t: Param[Scalar, "m", positive]  # thickness
    h: Param[Scalar, "m", nonnegative]  # height of the unloaded cone: the free height minus t
    E: Param[Scalar, "Pa", positive] = 206e9  # modulus of elasticity
    nu: Param[Scalar, "1", nonnegative] = 0.3  # Poisson's ratio

    def requirements(self) -> Requirements:
        return (
            require(self.Di < self.De, "Di must be below De"),
            require(self.nu < 0.5, "nu must be below 0.5"),
        )

    def _rate(self) -> Scalar:
        d = self.De / self.Di
        k_1 = ((d - 1.0) / d) ** 2 / ((d + 1.0) / (d - 1.0) - 2.0 / jnp.log(d)) / jnp.pi
        return 4.0 * self.E / (1.0 - self.nu**2) * self.t / (k_1 * self.De**2)

    def force(self, s: Scalar) -> Scalar:
        """Force in N at the deflection s in m."""
        return _cubic(s, self._rate(), self.h, self.t)

    def work(self, s: Scalar) -> Scalar:
        """Integral of the force in J."""
        return _area(s, self._rate(), self.h, self.t)


class Diaphragm(Record):
    """The diaphragm spring of a clutch: a disc with slotted fingers, loaded between the circles R_1 and r_1.

    With the deflection x of R_1 against r_1 and k = (R - r)/(R_1 - r_1): F = pi E t x/(6 (1 - nu^2)) ln(R/r)/(R_1 -
    r_1)^2 [(H - k x)(H - k x/2) + t^2] (Almen, Laszlo 1936 with load circles; SAE AE-21, `Spring Design Manual`).
    Rigid fingers balance F at R_1 with F/lever at their tips, on the circle r_f: lever = (r_1 - r_f)/(R_1 - r_1).
    """

    R: Param[Scalar, "m", positive]  # outer radius of the disc part
    r: Param[Scalar, "m", positive]  # inner radius of the disc part
    R_1: Param[Scalar, "m", positive]  # radius of the contact with the pressure plate
    r_1: Param[Scalar, "m", positive]  # radius of the pivot on the cover
    r_f: Param[Scalar, "m", positive]  # radius at which the release bearing loads the fingers
    t: Param[Scalar, "m", positive]  # thickness
    H: Param[Scalar, "m", nonnegative]  # height of the unloaded cone of the disc part
    E: Param[Scalar, "Pa", positive] = 206e9  # modulus of elasticity
    nu: Param[Scalar, "1", nonnegative] = 0.3  # Poisson's ratio

    def requirements(self) -> Requirements:
        return (
            require(self.r < self.R, "r must be below R"),
            require(self.r_1 < self.R_1, "r_1 must be below R_1"),
            require(self.r_f < self.r_1, "r_f must be below r_1"),
            require(self.nu < 0.5, "nu must be below 0.5"),
        )

    @property
    def lever(self) -> Scalar:
        """Ratio of the travel of the finger tips to that of the pressure plate."""
        return (self.r_1 - self.r_f) / (self.R_1 - self.r_1)

    def _cone(self) -> tuple[Scalar, Scalar, Scalar, Scalar]:
        """k and the coefficients of `_cubic` for the deflection k x."""
        arm = self.R_1 - self.r_1
        k = (self.R - self.r) / arm
        rate = jnp.pi * self.E * self.t / (6.0 * (1.0 - self.nu**2)) * jnp.log(self.R / self.r) / arm**2
        return k, rate, self.H, self.t

    def force(self, x: Scalar) -> Scalar:
        """Clamp load in N at the deflection x in m."""
        k, rate, height, thickness = self._cone()
        return _cubic(k * x, rate / k, height, thickness)

    def work(self, x: Scalar) -> Scalar:
        """Integral of the clamp load in J."""
        k, rate, height, thickness = self._cone()
        return _area(k * x, rate / k**2, height, thickness)


class DiscSpring(Compliant):
    """A stack of disc springs that only pushes: f = -m F(x/n), x = s_rel0 - s_rel, and f = 0 for x < 0.

    F is the force of the `ConicalDisc`. The stack has n packets in series, each with m discs in parallel. Not modelled:
    friction between the discs of a packet, blocking of flat discs at x > n h (see `HardStop`).
    """

    disc: ConicalDisc
    series: Param[Scalar, "1", positive] = 1.0  # n, number of packets in series
    parallel: Param[Scalar, "1", positive] = 1.0  # m, number of discs in each packet
    s_rel0: Param[Scalar, "m"] = 0.0  # relative position of the unloaded stack: its free length

    def _deflection(self) -> Scalar:
        x = self.s_rel0 - self.s_rel
        return positive_part(x) / self.series

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(law=eq(self.f, -self.parallel * self.disc.force(self._deflection())))

    def energy(self) -> Energy:
        return Energy(stored=self.series * self.parallel * self.disc.work(self._deflection()))


class DiaphragmClutch(Component):
    """The release curve of a clutch with diaphragm spring: f = F(x)/lever with x = engaged - wear + s/lever.

    s >= 0 is the travel of the release bearing from its contact with the fingers; F and the lever are those of the
    `Diaphragm`. As the facings wear, the pressure plate moves towards the flywheel and the spring is deflected less:
    the clamp load passes through its maximum and the release load rises. Fingers and cover are rigid. Not modelled:
    cushion springs between the facings, friction of the pivots.
    """

    spring: Diaphragm
    engaged: Param[Scalar, "m", nonnegative]  # deflection x of the engaged clutch with new facings
    wear: Param[Scalar, "m", nonnegative] = 0.0  # displacement of the plate by wear of the facings
    clamp: Var[Scalar, "N"] = 0.0  # clamp load F(x) at the pressure plate
    flange: Flange = Flange()

    def requirements(self) -> Requirements:
        return (require(self.wear <= self.engaged, "wear must be at most engaged, at which the spring is unloaded"),)

    def _deflection(self) -> Scalar:
        return self.engaged - self.wear + self.flange.s / self.spring.lever

    def equations(self, d: Self) -> Equations:
        return dict(
            spring=eq(self.clamp, self.spring.force(self._deflection())),
            lever=eq(self.spring.lever * self.flange.f, self.clamp),
        )

    def energy(self) -> Energy:
        return Energy(stored=self.spring.work(self._deflection()))
