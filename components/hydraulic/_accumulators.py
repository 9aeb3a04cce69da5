"""Accumulators: liquid against a gas or a spring, with an empty and a full state."""

import abc
from collections.abc import Mapping
from typing import Any, ClassVar, Self

import jax.numpy as jnp

from acausal import (
    Discrete,
    Energy,
    Equations,
    Events,
    Nominal,
    Param,
    Requirements,
    Scalar,
    Var,
    eq,
    nonnegative,
    positive,
    prefer,
    refuse,
    require,
    when,
)

from .._series import expm1_over
from ._interfaces import FluidPort, MixedPart


class Accumulator(MixedPart, partial=True):
    """A volume V of liquid under a pressure p(V), behind an inlet: resistance q = p_port - p, dV/dt = q.

    When empty (V = 0) or full (V = capacity), the inlet is shut, as by a poppet or a diaphragm, until the pressure
    outside opens it again. Both are events; while the inlet is shut, the circuit alone determines the pressure at the
    port. A run ends with an error if V starts outside its limits or contradicts `end`.
    """

    mode_names: ClassVar[Mapping[str, Mapping[float, str]]] = {"end": {-1.0: "empty", 0.0: "in between", 1.0: "full"}}

    capacity: Param[Scalar, "m3", positive]  # maximum volume of liquid
    resistance: Param[Scalar, "Pa.s/m3", positive]  # flow resistance of the inlet
    V: Var[Scalar, "m3", prefer, Nominal(1e-4)] = 0.0  # volume of liquid inside
    p: Var[Scalar, "Pa"] = 0.0  # pressure of the liquid inside, above the atmosphere
    drop: Var[Scalar, "Pa"] = 0.0  # p_port - p
    end: Discrete[Scalar, "1"] = 0.0  # -1 empty, 0 in between, 1 full
    port: FluidPort = FluidPort()

    @abc.abstractmethod
    def held(self) -> Scalar:
        """p(V) in Pa above the atmosphere."""

    def equations(self, d: Any) -> Equations:
        is_open = jnp.where(jnp.abs(self.end) < 0.5, 1.0, 0.0)
        return dict(
            held=eq(self.p, self.held()),
            drop=eq(self.drop, self.port.p - self.p),
            inlet=eq(self.resistance * self.port.q, is_open * self.drop),
            content=eq(d.V, self.port.q),
        )

    def events(self) -> Events:
        return dict(
            empty=when((self.end > -0.5) & (self.V < 0.0) & (self.drop < 0.0), end=-1.0, V=0.0),
            full=when((self.end < 0.5) & (self.capacity < self.V) & (self.drop > 0.0), end=1.0, V=self.capacity),
            fill=when((self.end < -0.5) & (self.drop > 0.0), end=0.0),
            drain=when((self.end > 0.5) & (self.drop < 0.0), end=0.0),
            beyond=refuse(
                self._beyond() > 1e-3 * self.capacity,
                "V must be 0 if end is -1, equal to capacity if end is 1, "
                "and in between otherwise: change its start value",
            ),
        )

    def held_liquid(self) -> Scalar:
        # A thousandth of the capacity stays behind the inlet, so that an empty accumulator has a temperature.
        return self.V + 1e-3 * self.capacity

    def _beyond(self) -> Scalar:
        """Distance in m3 between V and the range that `end` implies."""
        empty, full = self.V, self.V - self.capacity
        outside = jnp.maximum(jnp.maximum(-empty, full), 0.0)
        return jnp.where(self.end < -0.5, jnp.abs(empty), jnp.where(self.end > 0.5, jnp.abs(full), outside))


class SpringAccumulator(Accumulator):
    """Liquid against a spring-loaded piston, p = preload + stiffness V."""

    preload: Param[Scalar, "Pa", nonnegative]  # pressure at which it begins to fill
    stiffness: Param[Scalar, "Pa/m3", positive]  # spring rate over the square of the piston area

    def held(self) -> Scalar:
        return self.preload + self.stiffness * self.V

    def energy(self) -> Energy:
        stored = self.V * (self.preload + 0.5 * self.stiffness * self.V)
        return Energy(stored=stored, dissipated=self.drop * self.port.q)


class Gas(Accumulator, partial=True):
    """An accumulator with a gas volume of volume - V, precharged when empty of liquid."""

    volume: Param[Scalar, "m3", positive]  # gas volume when empty of liquid
    precharge: Param[Scalar, "Pa", positive]  # gas pressure when empty of liquid, above the atmosphere
    atmosphere: Param[Scalar, "Pa", nonnegative] = 101325.0  # absolute atmospheric pressure

    def requirements(self) -> Requirements:
        return (require(self.capacity < self.volume, "capacity must be below volume, so that the gas has room"),)

    @property
    def compression(self) -> Scalar:
        """ln(volume / gas volume)."""
        return -jnp.log1p(-self.V / self.volume)


class GasAccumulator(Gas):
    """Liquid against a gas with p v^n = const, p absolute (bladder, diaphragm, piston).

    n = 1 is isothermal, for changes over minutes; 1.4 is adiabatic, for changes over seconds; in between, polytropic.
    Above 200 bar nitrogen is stiffer than the ideal gas assumed here, by 10 % at 300 bar.
    """

    n: Param[Scalar, "1", positive] = 1.4  # polytropic exponent

    def held(self) -> Scalar:
        return (self.precharge + self.atmosphere) * jnp.exp(self.n * self.compression) - self.atmosphere

    def energy(self) -> Energy:
        """The stored energy is the work done on the gas, the integral of p dV."""
        log = self.compression
        work = (self.precharge + self.atmosphere) * self.volume * log * expm1_over((self.n - 1.0) * log)
        return Energy(stored=work - self.atmosphere * self.V, dissipated=self.drop * self.port.q)


class ThermalAccumulator(Gas):
    """Liquid against an ideal gas that exchanges heat with its surroundings (Otis, Pourmovahed 1985).

    dT/dt = (T_0 - T)/tau - (kappa - 1) T/v dv/dt with v = volume - V, and p = (precharge + atmosphere) volume T/(v T_0)
    - atmosphere. It stores the internal energy of the gas; heat to the surroundings counts as negative supplied power.
    """

    tau: Param[Scalar, "s", positive]  # thermal time constant, seconds to minutes
    T_0: Param[Scalar, "K", positive] = 293.15  # temperature of the surroundings and of the precharge
    kappa: Param[Scalar, "1", positive] = 1.4  # ratio of the specific heats, above 1
    T: Var[Scalar, "K", prefer, positive] = 293.15  # gas temperature

    def requirements(self) -> Requirements:
        return (*super().requirements(), require(self.kappa > 1.0, "kappa must be above 1"))

    def held(self) -> Scalar:
        compressed = jnp.exp(self.compression) * self.T / self.T_0
        return (self.precharge + self.atmosphere) * compressed - self.atmosphere

    def equations(self, d: Self) -> Equations:
        gas = self.volume - self.V
        heated = (self.T_0 - self.T) / self.tau + (self.kappa - 1.0) * self.T / gas * self.port.q
        return super().equations(d) | dict(temperature=eq(d.T, heated))

    def energy(self) -> Energy:
        heat_capacity = (self.precharge + self.atmosphere) * self.volume / (self.T_0 * (self.kappa - 1.0))
        return Energy(
            stored=heat_capacity * (self.T - self.T_0) - self.atmosphere * self.V,
            supplied=heat_capacity * (self.T_0 - self.T) / self.tau,
            dissipated=self.drop * self.port.q,
        )
