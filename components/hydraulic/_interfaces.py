"""Hydraulic ports and the base classes of parts with ports, which also carry heat if the liquid of the circuit does.

`fill(circuit, liquid)` decides: for a liquid that carries heat, it exchanges each `FluidPort` for a `ThermalFluidPort`,
and gives each part a `HeatCarrier` and a heat port at the temperature of the liquid inside. The heat balance follows
from the other statements of a part: the flows of its ports, its dissipation, and the liquid that it holds.
"""

import dataclasses
from collections.abc import Iterator
from typing import Any, ClassVar, Self

import jax.numpy as jnp

from acausal import (
    Component,
    Energy,
    Equations,
    Flow,
    ModelError,
    Param,
    Port,
    Requirements,
    Scalar,
    Var,
    eq,
    nonnegative,
    positive,
    require,
)

from ..thermal import HeatPort
from ._heat_carrier import HeatCarrier, with_carrier
from ._liquids import Liquid


class FluidPort(Port):
    """A connection for liquid; p q is the power into the component."""

    reference: ClassVar[str] = "a Tank"
    storage: ClassVar[str] = "a Chamber or a Volume"

    p: Var[Scalar, "Pa"] = 0.0  # pressure above the atmosphere
    q: Flow[Scalar, "m3/s"] = 0.0  # volume flow rate, positive into the component

    def power(self, d: Self) -> Scalar:
        del d
        return self.p * self.q


class ThermalFluidPort(Port):
    """A `FluidPort` of a circuit whose liquid carries heat; p q + H_flow is the power into the component.

    `fill` makes it. T is the temperature of the node, at which its inflows mix.
    """

    reference: ClassVar[str] = FluidPort.reference
    storage: ClassVar[str] = FluidPort.storage

    p: Var[Scalar, "Pa"] = 0.0  # pressure above the atmosphere
    T: Var[Scalar, "K", positive] = 293.15  # temperature at the node
    q: Flow[Scalar, "m3/s"] = 0.0  # volume flow rate, positive into the component
    H_flow: Flow[Scalar, "W"] = 0.0  # heat that the liquid carries, positive into the component

    def power(self, d: Self) -> Scalar:
        del d
        return self.p * self.q + self.H_flow


def upstream(q: Scalar, a: ThermalFluidPort, b: ThermalFluidPort) -> Scalar:
    """Temperature at the node from which a flow q from a to b comes."""
    return jnp.where(q > 0.0, a.T, b.T)


class FluidPart(Component, partial=True):
    """A part with fluid ports. `carrying`, `shared_equations` and `shared_energy` state what happens to heat in it."""

    carrier: HeatCarrier | None = None  # set by `fill`

    def start_requirements(self) -> Requirements:
        liquid = vars(self).get("liquid")
        if not isinstance(liquid, Liquid):
            return ()
        least, names = liquid.least_pressure(), [name for name in ("p", "p_a", "p_b", "p_inner") if name in vars(self)]
        text = "must not start below the vapour pressure of the liquid"
        return tuple(require(getattr(self, name) >= least, f"{name} {text}") for name in names)

    def carrying(self, carrier: HeatCarrier) -> Self:
        """A copy that carries heat."""
        return with_carrier(self, carrier)

    def thermal_ports(self) -> Iterator[tuple[str, ThermalFluidPort]]:
        """The ports through which liquid carries heat, by name."""
        for field in dataclasses.fields(self):
            value = getattr(self, field.name)
            if isinstance(value, ThermalFluidPort):
                yield field.name, value
            for index, port in enumerate(value if isinstance(value, tuple) else ()):
                yield f"{field.name}_{index}", port

    def shared_equations(self, d: Any) -> Equations:
        liquid = vars(self).get("liquid")
        if self.carrier is None and isinstance(liquid, Liquid) and liquid.caloric is not None:
            raise ModelError(
                f"The liquid of {type(self).__name__} carries heat, but its ports do not. Use fill(model, liquid) on "
                "the model with the whole circuit."
            )
        return {}

    def _carried_laws(self, carrier: HeatCarrier, inside: Scalar) -> Equations:
        """The heat through each port of a part with the temperature `inside`."""
        return {
            f"heat_{name}": eq(port.H_flow, carrier.flow(port.q, port.T, inside)) for name, port in self.thermal_ports()
        }

    def dissipated(self) -> Any:
        """Power in W that the part turns into heat, from its own account."""
        own = self.energy()
        return 0.0 if own is None else own.dissipated


class MixedPart(FluidPart, partial=True):
    """A part in which all liquid has one temperature, that of `heat`.

    With `heat=HeatPort()`, the dissipated power leaves there; without, it is lost. If the liquid carries heat, it stays
    in the liquid, `heat` is the inside of the wall, and

    density specific_heat V dT/dt = heat carried in by the liquid + dissipated power + heat from the wall,

    where V is the volume of liquid that the part holds; its viscosity is then that at T. If it holds none, T is the
    temperature of the outflow.
    """

    heat: HeatPort | None = None  # wall

    def held_liquid(self) -> Any:
        """Volume of liquid in the part in m3, referred to atmospheric density; None if it holds none."""
        return None

    def drawn(self) -> Any:
        """Heat in W that leaves the liquid by other ways than `heat` and the fluid ports."""
        return 0.0

    def carrying(self, carrier: HeatCarrier) -> Self:
        heat = HeatPort(T=carrier.temperature) if self._holds_liquid() else HeatPort()
        return with_carrier(self, carrier, heat=heat)

    def shared_equations(self, d: Any) -> Equations:
        heat, carrier = self.heat, self.carrier
        if heat is None:
            return super().shared_equations(d)
        gained = heat.Q_flow + self.dissipated() - self.drawn()
        if carrier is None:
            return super().shared_equations(d) | dict(heating=eq(gained))
        ports = [port for _, port in self.thermal_ports()]
        carried, inflow = sum(port.H_flow for port in ports), sum(port.q for port in ports)
        return self._carried_laws(carrier, heat.T) | dict(
            heating=carrier.balance(d.heat, heat, carried + gained, self.held_liquid(), inflow)
        )

    def shared_energy(self, own: Energy) -> Energy:
        if self.heat is None:
            return own
        carrier, volume = self.carrier, self.held_liquid()
        warmth = 0.0 if carrier is None or volume is None else carrier.stored(volume, self.heat)
        return own._replace(stored=own.stored + warmth, dissipated=0.0)

    def _holds_liquid(self) -> bool:
        return type(self).held_liquid is not MixedPart.held_liquid

    def _temperature(self) -> Any:
        """Temperature for the viscosity in K, or None for the one stored in the liquid."""
        # In a part without a volume, the viscosity would determine a temperature that determines the viscosity.
        is_unknown = self.carrier is not None and not self._holds_liquid()
        return None if self.heat is None or is_unknown else self.heat.T


class StatedVolume(MixedPart, partial=True):
    """A part whose law does not depend on how much liquid it holds: `volume` is for liquids that carry heat."""

    volume: Param[Scalar, "m3", nonnegative] = 0.0  # liquid at zero pressure, in a cylinder at s = 0

    def requirements(self) -> Requirements:
        if self.carrier is None:
            return ()
        return (require(self.volume > 0.0, "volume must be positive, because the liquid carries heat"),)


class TwoPort(MixedPart, partial=True):
    """An element with one flow path, from a to b, without storage: dp = p_a - p_b, q = q_a = -q_b."""

    dp: Var[Scalar, "Pa"] = 0.0  # pressure drop from a to b
    q: Var[Scalar, "m3/s"] = 0.0  # flow from a to b
    a: FluidPort = FluidPort()
    b: FluidPort = FluidPort()

    def equations(self, d: Any) -> Equations:
        return dict(
            drop=eq(self.dp, self.a.p - self.b.p),
            flow=eq(self.q, self.a.q),
            continuity=eq(self.a.q + self.b.q),
        )

    def _inlet(self, inside: Scalar) -> Scalar:
        """Temperature of the inflow in K: that of its node, or the one inside if the liquid carries no heat."""
        ports = [port for _, port in self.thermal_ports()]
        return upstream(self.q, *ports) if ports else inside
