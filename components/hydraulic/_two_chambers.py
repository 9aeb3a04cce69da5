"""Base class of cylinders and rotary actuators: two liquid chambers on both sides of a piston or vane."""

import abc
from typing import Any, ClassVar

from acausal import Component, Energy, Equations, Param, Scalar, Var, eq, nonnegative, positive, prefer

from . import _content as content
from ._interfaces import FluidPort
from ._liquids import AnyLiquid


class TwoChambers(Component, partial=True):
    """Two liquid chambers: d(V_a r(p_a))/dt = q_a - Q and d(V_b r(p_b))/dt = q_b + Q, with Q = leakage (p_a - p_b).

    r is the density of the liquid over that at atmospheric pressure, to which all flows refer.
    """

    if_singular: ClassVar[str] = content.EMPTY

    liquid: AnyLiquid
    dead_a: Param[Scalar, "m3", positive]  # volume of chamber a at its end, lines included
    dead_b: Param[Scalar, "m3", positive]  # volume of chamber b at the other end
    leakage: Param[Scalar, "m3/(s.Pa)", nonnegative] = 0.0  # leakage flow from a to b per pressure difference
    p_a: Var[Scalar, "Pa", prefer] = 0.0  # pressure in chamber a
    p_b: Var[Scalar, "Pa", prefer] = 0.0  # pressure in chamber b
    a: FluidPort = FluidPort()
    b: FluidPort = FluidPort()

    @abc.abstractmethod
    def _swept(self) -> tuple[Scalar, Scalar]:
        """Swept volumes of the chambers, beyond their dead volumes, in m3."""

    @abc.abstractmethod
    def _growth(self) -> tuple[Scalar, Scalar]:
        """Growth rates of the volumes in m3/s."""

    def equations(self, d: Any) -> Equations:
        (volume_a, volume_b), (into_a, into_b) = self._volumes(), self._inflows()
        (growth_a, growth_b), liquid = self._growth(), self.liquid
        taken_a, taken_b = growth_a * liquid.relative_density(self.p_a), growth_b * liquid.relative_density(self.p_b)
        return dict(
            pressure_a=eq(self.p_a, self.a.p),
            pressure_b=eq(self.p_b, self.b.p),
            content_a=eq(content.capacity(liquid, volume_a, self.p_a, 0.0) * d.p_a, into_a - taken_a),
            content_b=eq(content.capacity(liquid, volume_b, self.p_b, 0.0) * d.p_b, into_b - taken_b),
        )

    def energy(self) -> Energy:
        volumes, inflows, growths = self._volumes(), self._inflows(), self._growth()
        shares = zip((self.p_a, self.p_b), volumes, inflows, growths, strict=True)
        in_a, in_b = (self.liquid.account(*share) for share in shares)
        return Energy(
            stored=in_a.stored + in_b.stored,
            supplied=in_a.supplied + in_b.supplied,
            dissipated=self.leakage * (self.p_a - self.p_b) ** 2,
        )

    def _lost(self) -> Scalar:
        """Whether half of the dead volume of a chamber is used up."""
        volume_a, volume_b = self._volumes()
        return (volume_a < 0.5 * self.dead_a) | (volume_b < 0.5 * self.dead_b)

    def _volumes(self) -> tuple[Scalar, Scalar]:
        swept_a, swept_b = self._swept()
        return self.dead_a + swept_a, self.dead_b + swept_b

    def _inflows(self) -> tuple[Scalar, Scalar]:
        leaked = self.leakage * (self.p_a - self.p_b)
        return self.a.q - leaked, self.b.q + leaked
