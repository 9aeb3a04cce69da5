"""Base class of cylinders and rotary actuators: two liquid chambers on both sides of a piston or vane."""

import abc
from typing import Any, ClassVar, Self

import jax.numpy as jnp

from acausal import Energy, Equations, Param, Scalar, Var, eq, nonnegative, positive, prefer

from ..thermal import HeatPort
from . import _content as content
from ._heat_carrier import HeatCarrier, with_carrier
from ._interfaces import FluidPart, FluidPort
from ._liquids import AnyLiquid


class TwoChambers(FluidPart, partial=True):
    """Two liquid chambers: d(V_a r(p_a))/dt = q_a - Q and d(V_b r(p_b))/dt = q_b + Q, with Q = leakage (p_a - p_b).

    r is the density of the liquid over that at atmospheric pressure, to which all flows refer. With `heat_a=HeatPort()`
    and `heat_b=HeatPort()`, the loss of the leakage leaves there, half by each. If the liquid carries heat, each
    chamber has a temperature, that of its heat port.
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
    heat_a: HeatPort | None = None  # wall of chamber a
    heat_b: HeatPort | None = None  # wall of chamber b

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

    def carrying(self, carrier: HeatCarrier) -> Self:
        walls = {name: HeatPort(T=carrier.temperature) for name in ("heat_a", "heat_b")}
        return with_carrier(self, carrier, **walls)

    def shared_equations(self, d: Any) -> Equations:
        heats, carrier, loss = self._heats(), self.carrier, self.dissipated()
        if carrier is None:
            return super().shared_equations(d) | {
                f"heating_{name}": eq(heat.Q_flow + loss / len(heats)) for name, heat in heats.items()
            }
        leaked = self.leakage * (self.p_a - self.p_b)
        carried = carrier.flow(leaked, heats["a"].T, heats["b"].T)
        gains = dict(a=jnp.where(leaked > 0.0, 0.0, loss) - carried, b=jnp.where(leaked > 0.0, loss, 0.0) + carried)
        inflows, rates = dict(zip("ab", self._inflows(), strict=True)), dict(a=d.heat_a, b=d.heat_b)
        laws: Equations = {}
        for name, port in self.thermal_ports():
            heat = heats[name]
            gained = port.H_flow + heat.Q_flow + gains[name]
            laws[f"heat_{name}"] = eq(port.H_flow, carrier.flow(port.q, port.T, heat.T))
            laws[f"heating_{name}"] = carrier.balance(rates[name], heat, gained, self._held()[name], inflows[name])
        return laws

    def shared_energy(self, own: Energy) -> Energy:
        heats, carrier = self._heats(), self.carrier
        if not heats:
            return own
        warmth = [] if carrier is None else [carrier.stored(self._held()[name], heat) for name, heat in heats.items()]
        return own._replace(stored=own.stored + sum(warmth), dissipated=0.0)

    def _heats(self) -> dict[str, HeatPort]:
        return {name: heat for name, heat in (("a", self.heat_a), ("b", self.heat_b)) if heat is not None}

    def _held(self) -> dict[str, Scalar]:
        """Liquid in each chamber in m3, referred to atmospheric density."""
        pressures = (self.p_a, self.p_b)
        shares = zip("ab", self._volumes(), pressures, strict=True)
        return {name: volume * self.liquid.relative_density(p) for name, volume, p in shares}

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
