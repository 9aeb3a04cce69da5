"""Sliding on a helix: efficiencies of worms and screws, and a screw with its nut."""

import jax.numpy as jnp

from acausal import Component, Connections, Param, Record, Requirements, Scalar, connect, nonnegative, positive, require

from ..translational import Flange as Rod
from ._interfaces import Flange
from ._lossy_gear import LossyGear
from ._wheels import IdealGearR2T


class Helix(Record):
    """Friction of flanks that slide on a helix of lead angle g, with the friction angle rho: tan(rho) = mu/cos(flank).

    The efficiency is tan(g)/tan(g + rho) where the helix drives and tan(g - rho)/tan(g) where it is driven; at g <= rho
    the latter is not above 0: it locks itself (Niemann, Winter, `Maschinenelemente` 3, for worms; Roloff, Matek,
    `Maschinenelemente`, for screws). For the sliding of the flanks only: bearings and churning come on top.
    """

    lead: Param[Scalar, "rad", positive]  # g, of the mean helix
    mu: Param[Scalar, "1", nonnegative]  # coefficient of friction
    flank: Param[Scalar, "rad", nonnegative] = 0.0  # pressure angle in the normal section

    def requirements(self) -> Requirements:
        return (
            require(self.flank < 0.5 * jnp.pi, "flank must be below pi/2"),
            require(self.lead + self.friction_angle < 0.5 * jnp.pi, "lead must be below pi/2 less the friction angle"),
        )

    @classmethod
    def of_worm(cls, *, starts: Scalar, quotient: Scalar, mu: Scalar, flank: Scalar = jnp.pi / 9.0) -> "Helix":
        """A worm of a number of starts; its diameter quotient is the mean diameter over the axial module."""
        return cls(lead=jnp.arctan(starts / quotient), mu=mu, flank=flank)

    @classmethod
    def of_screw(cls, *, diameter: Scalar, lead: Scalar, mu: Scalar, flank: Scalar = 0.0) -> "Helix":
        """A screw of mean diameter and lead in m (pitch times starts); `flank` in the axial section, in rad."""
        angle = jnp.arctan(lead / (jnp.pi * diameter))
        return cls(lead=angle, mu=mu, flank=jnp.arctan(jnp.tan(flank) * jnp.cos(angle)))

    @property
    def friction_angle(self) -> Scalar:
        """rho in rad."""
        return jnp.arctan(self.mu / jnp.cos(self.flank))

    @property
    def driving(self) -> Scalar:
        """Efficiency where worm or screw drive."""
        return jnp.tan(self.lead) / jnp.tan(self.lead + self.friction_angle)

    @property
    def driven(self) -> Scalar:
        """Efficiency where wheel or nut drive; where it is negative, they need help at worm or screw instead."""
        return jnp.tan(self.lead - self.friction_angle) / jnp.tan(self.lead)

    def gear(self, ratio: Scalar) -> LossyGear:
        """A gear with these losses, a the worm; it sticks, and locks itself where `driven` is not above 0."""
        row = [0.0, self.driving, self.driven, 0.0, 0.0]
        return LossyGear(ratio=ratio, losses=jnp.stack([jnp.asarray(item, float) for item in row])[None])


class LossyGearR2T(Component):
    """From rotation to translation with losses: a `LossyGear` of ratio 1 and an `IdealGearR2T` behind it.

    A screw with a nut that cannot turn, or a rack and pinion: `LossyGearR2T.screw(...)`, `LossyGearR2T.rack(...)`.
    Without losses, phi = ratio s and ratio tau + f = 0; with them it sticks, and can lock itself.
    """

    gear: LossyGear
    converter: IdealGearR2T
    shaft: Flange = Flange()
    rod: Rod = Rod()

    @classmethod
    def screw(cls, *, diameter: Scalar, lead: Scalar, mu: Scalar, flank: Scalar = 0.0) -> "LossyGearR2T":
        """A screw of mean diameter and lead in m; `flank` is half the angle of its thread in rad. See `Helix`."""
        helix = Helix.of_screw(diameter=diameter, lead=lead, mu=mu, flank=flank)
        return cls(gear=helix.gear(1.0), converter=IdealGearR2T(ratio=2.0 * jnp.pi / lead))

    @classmethod
    def rack(cls, *, radius: Scalar, efficiency: Scalar = 1.0) -> "LossyGearR2T":
        """A rack on a pinion of pitch radius in m, with the same friction whichever of them drives."""
        gear = LossyGear.worm(ratio=1.0, efficiency=efficiency)
        return cls(gear=gear, converter=IdealGearR2T(ratio=1.0 / radius))

    def connections(self) -> Connections:
        return (
            connect(self.shaft, self.gear.a),
            connect(self.gear.b, self.converter.shaft),
            connect(self.converter.rod, self.rod),
        )
