"""Sliding friction on a helix: efficiencies of worms and screws, and a screw with its nut."""

import jax.numpy as jnp

from acausal import Component, Connections, Param, Record, Requirements, Scalar, connect, nonnegative, positive, require

from ..translational import Flange as Rod
from ._interfaces import Flange
from ._lossy_gear import LossyGear
from ._wheels import IdealGearR2T


class Helix(Record):
    """Friction of flanks that slide on a helix of lead angle g, with the friction angle rho: tan(rho) = mu/cos(flank).

    The efficiency is tan(g)/tan(g + rho) if the helix drives and tan(g - rho)/tan(g) if it is driven. At g <= rho the
    latter is not positive and the helix is self-locking (Niemann, Winter, `Maschinenelemente` 3, for worms; Roloff,
    Matek, `Maschinenelemente`, for screws). Bearing and churning losses are not included.
    """

    lead: Param[Scalar, "rad", positive]  # g, lead angle of the mean helix
    mu: Param[Scalar, "1", nonnegative]  # coefficient of friction
    flank: Param[Scalar, "rad", nonnegative] = 0.0  # pressure angle in the normal section

    def requirements(self) -> Requirements:
        return (
            require(self.flank < 0.5 * jnp.pi, "flank must be below pi/2"),
            require(self.lead + self.friction_angle < 0.5 * jnp.pi, "lead must be below pi/2 minus the friction angle"),
        )

    @classmethod
    def of_worm(cls, *, starts: Scalar, quotient: Scalar, mu: Scalar, flank: Scalar = jnp.pi / 9.0) -> "Helix":
        """A worm with the given number of starts and diameter quotient (mean diameter over axial module)."""
        return cls(lead=jnp.arctan(starts / quotient), mu=mu, flank=flank)

    @classmethod
    def of_screw(cls, *, diameter: Scalar, lead: Scalar, mu: Scalar, flank: Scalar = 0.0) -> "Helix":
        """A screw of given mean diameter and lead (pitch times starts) in m; `flank` in the axial section, in rad."""
        angle = jnp.arctan(lead / (jnp.pi * diameter))
        return cls(lead=angle, mu=mu, flank=jnp.arctan(jnp.tan(flank) * jnp.cos(angle)))

    @property
    def friction_angle(self) -> Scalar:
        """rho in rad."""
        return jnp.arctan(self.mu / jnp.cos(self.flank))

    @property
    def driving(self) -> Scalar:
        """Efficiency if the worm or screw drives."""
        return jnp.tan(self.lead) / jnp.tan(self.lead + self.friction_angle)

    @property
    def driven(self) -> Scalar:
        """Efficiency if the wheel or nut drives; if negative, the worm or screw must be driven as well."""
        return jnp.tan(self.lead - self.friction_angle) / jnp.tan(self.lead)

    def gear(self, ratio: Scalar) -> LossyGear:
        """A gear with these losses, with the worm at a; it sticks, and is self-locking if `driven` is not positive."""
        row = [0.0, self.driving, self.driven, 0.0, 0.0]
        return LossyGear(ratio=ratio, losses=jnp.stack([jnp.asarray(item, float) for item in row])[None])


class LossyGearR2T(Component):
    """Conversion of rotation to translation with losses: a `LossyGear` of ratio 1 followed by an `IdealGearR2T`.

    `LossyGearR2T.screw(...)` is a screw with a nut that cannot turn, `LossyGearR2T.rack(...)` a rack and pinion.
    Without losses, phi = ratio s and ratio tau + f = 0; with losses it sticks and can be self-locking.
    """

    gear: LossyGear
    converter: IdealGearR2T
    shaft: Flange = Flange()
    rod: Rod = Rod()

    @classmethod
    def screw(cls, *, diameter: Scalar, lead: Scalar, mu: Scalar, flank: Scalar = 0.0) -> "LossyGearR2T":
        """A screw with the given mean diameter and lead in m; `flank` is half the thread angle in rad. See `Helix`."""
        helix = Helix.of_screw(diameter=diameter, lead=lead, mu=mu, flank=flank)
        return cls(gear=helix.gear(1.0), converter=IdealGearR2T(ratio=2.0 * jnp.pi / lead))

    @classmethod
    def rack(cls, *, radius: Scalar, efficiency: Scalar = 1.0) -> "LossyGearR2T":
        """A rack on a pinion with the given pitch radius in m, with the same friction in both directions of power."""
        gear = LossyGear.worm(ratio=1.0, efficiency=efficiency)
        return cls(gear=gear, converter=IdealGearR2T(ratio=1.0 / radius))

    def connections(self) -> Connections:
        return (
            connect(self.shaft, self.gear.a),
            connect(self.gear.b, self.converter.shaft),
            connect(self.converter.rod, self.rod),
        )
