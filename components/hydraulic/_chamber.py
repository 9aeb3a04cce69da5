"""Chambers filled with a liquid."""

from typing import ClassVar, Self

from acausal import Energy, Equations, Param, Scalar, Var, eq, nonnegative, positive, prefer

from . import _content as content
from ._interfaces import FluidPort, MixedPart
from ._liquids import AnyLiquid


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
