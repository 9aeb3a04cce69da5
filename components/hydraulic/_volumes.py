"""Volumes of liquid, and chambers: with a constant bulk modulus, dp/dt = beta/V q (Merritt, `Hydraulic Control`)."""

from typing import ClassVar, Self

from acausal import Energy, Equations, Nominal, Param, Scalar, Var, eq, nonnegative, positive, prefer

from . import _content as content
from ._interfaces import FluidPort, MixedPart, StatedVolume
from ._liquids import AnyLiquid


class Volume(MixedPart):
    """A rigid liquid-filled chamber, dp/dt = bulk_modulus / volume q."""

    volume: Param[Scalar, "m3", positive]  # V
    bulk_modulus: Param[Scalar, "Pa", positive]  # beta, of liquid and walls together
    p: Var[Scalar, "Pa", prefer] = 0.0  # pressure
    port: FluidPort = FluidPort()

    def equations(self, d: Self) -> Equations:
        return dict(
            pressure=eq(self.p, self.port.p),
            compression=eq(self.volume * d.p, self.bulk_modulus * self.port.q),
        )

    def held_liquid(self) -> Scalar:
        return self.volume * (1.0 + self.p / self.bulk_modulus)

    def energy(self) -> Energy:
        return Energy(stored=0.5 * self.volume / self.bulk_modulus * self.p**2)


class Line(StatedVolume):
    """A short line whose liquid acts as a spring with damping (Kelvin-Voigt): p = stiffness V + damping dV/dt.

    V is the volume by which the liquid is compressed, dV/dt = q_a + q_b, and the pressure is uniform. The damping
    represents the losses of compression. If the liquid carries heat, the line is one mixed volume. Not modelled:
    pressure drop along the line, waves, inertia.
    """

    stiffness: Param[Scalar, "Pa/m3", positive]  # bulk modulus over volume of the line
    damping: Param[Scalar, "Pa.s/m3", nonnegative] = 0.0  # pressure per rate of compression
    # The liquid is compressed by a small fraction of the line volume, hence the nominal value.
    V: Var[Scalar, "m3", prefer, Nominal(1e-8)] = 0.0  # compressed volume
    q: Var[Scalar, "m3/s"] = 0.0  # rate of compression, net flow into the line
    p: Var[Scalar, "Pa"] = 0.0  # pressure
    a: FluidPort = FluidPort()
    b: FluidPort = FluidPort()

    @classmethod
    def from_bulk_modulus(cls, *, bulk_modulus: Scalar, volume: Scalar, damping: Scalar = 0.0) -> "Line":
        """A line with the given volume in m3 of a liquid with the given bulk modulus in Pa."""
        return cls(stiffness=bulk_modulus / volume, damping=damping, volume=volume)

    def equations(self, d: Self) -> Equations:
        return dict(
            pressure_a=eq(self.p, self.a.p),
            pressure_b=eq(self.p, self.b.p),
            balance=eq(self.q, self.a.q + self.b.q),
            compression=eq(d.V, self.q),
            kelvin_voigt=eq(self.p, self.stiffness * self.V + self.damping * self.q),
        )

    def held_liquid(self) -> Scalar:
        return self.volume + self.V

    def energy(self) -> Energy:
        return Energy(stored=0.5 * self.stiffness * self.V**2, dissipated=self.damping * self.q**2)


class Chamber(MixedPart):
    """A closed volume of liquid, d(V r(p))/dt = q, with rigid or elastic walls, V = volume (1 + wall p).

    r is the density of the liquid over that at atmospheric pressure, to which all flows refer.

    `Volume` is the counterpart with a constant bulk modulus, without a `Liquid`.
    """

    if_singular: ClassVar[str] = content.EMPTY

    volume: Param[Scalar, "m3", positive]  # volume at atmospheric pressure
    liquid: AnyLiquid
    wall: Param[Scalar, "1/Pa", nonnegative] = 0.0  # relative increase of the volume with pressure
    p: Var[Scalar, "Pa", prefer] = 0.0  # pressure
    port: FluidPort = FluidPort()

    def equations(self, d: Self) -> Equations:
        return dict(
            pressure=eq(self.p, self.port.p),
            compression=eq(content.capacity(self.liquid, self.volume, self.p, self.wall) * d.p, self.port.q),
        )

    def held_liquid(self) -> Scalar:
        return self.volume * (1.0 + self.wall * self.p) * self.liquid.relative_density(self.p)

    def energy(self) -> Energy:
        return content.account(self.liquid, self.volume, self.p, self.wall, self.port.q)
