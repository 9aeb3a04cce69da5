"""Passive elements with a value given by a signal or by the temperature."""

from typing import Self

import jax.numpy as jnp

from acausal import (
    Component,
    Energy,
    Equations,
    Param,
    Scalar,
    Var,
    eq,
    nonnegative,
    positive,
    prefer,
)

from .._limit import limited
from ..blocks import Input
from ..thermal import HeatPort
from ._interfaces import Pin, TwoPin


class VariableResistor(TwoPin):
    """v = u i, with the resistance u in ohm; a negative resistance supplies energy."""

    u: Input = Input()

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(ohm=eq(self.v, self.u.value * self.i))

    def energy(self) -> Energy:
        power = self.u.value * self.i**2
        return Energy(dissipated=jnp.maximum(power, 0.0), supplied=jnp.maximum(-power, 0.0))


class VariableCapacitor(TwoPin):
    """Q = u v and dQ/dt = i, with the capacitance u in F, positive and smooth in time.

    Moving the plates takes work: `supplied` is -v^2/2 du/dt.
    """

    Q: Var[Scalar, "C", prefer] = 0.0  # charge
    rate: Var[Scalar, "F/s"] = 0.0  # du/dt
    u: Input = Input()

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(
            capacitance=eq(self.Q, self.u.value * self.v),
            charge=eq(d.Q, self.i),
            rate=eq(self.rate, d.u.value),
        )

    def energy(self) -> Energy:
        return Energy(stored=0.5 * self.Q * self.v, supplied=-0.5 * self.v**2 * self.rate)


class VariableInductor(TwoPin):
    """Psi = u i and dPsi/dt = v, with the inductance u in H, positive and smooth in time.

    Moving the core takes work: `supplied` is -i^2/2 du/dt.
    """

    Psi: Var[Scalar, "Wb", prefer] = 0.0  # flux linkage
    rate: Var[Scalar, "H/s"] = 0.0  # du/dt
    u: Input = Input()

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(
            inductance=eq(self.Psi, self.u.value * self.i),
            induction=eq(d.Psi, self.v),
            rate=eq(self.rate, d.u.value),
        )

    def energy(self) -> Energy:
        return Energy(stored=0.5 * self.Psi * self.i, supplied=-0.5 * self.i**2 * self.rate)


class Potentiometer(Component):
    """A resistor R between p and n with a contact at the fraction u from n (MSL `Potentiometer`).

    v_p - v_contact = (1 - u) R i_p and v_n - v_contact = u R i_n, with u limited to 0 .. 1.
    """

    R: Param[Scalar, "ohm", nonnegative]  # resistance from p to n
    p: Pin = Pin()
    n: Pin = Pin()
    contact: Pin = Pin()
    u: Input = Input()

    def _share(self) -> Scalar:
        return limited(self.u.value, 0.0, 1.0)

    def equations(self, d: Self) -> Equations:
        share = self._share()
        return dict(
            kirchhoff=eq(self.p.i + self.n.i + self.contact.i),
            upper=eq(self.p.v - self.contact.v, (1.0 - share) * self.R * self.p.i),
            lower=eq(self.n.v - self.contact.v, share * self.R * self.n.i),
        )

    def energy(self) -> Energy:
        share = self._share()
        return Energy(dissipated=self.R * ((1.0 - share) * self.p.i**2 + share * self.n.i**2))


class HeatingResistor(TwoPin):
    """v = R_ref (1 + alpha (T - T_ref)) i with the temperature T of the heat port, through which the loss v i leaves.

    As MSL `HeatingResistor`. The heat port must be connected, for example to a `FixedTemperature`. The energy account
    of the resistor therefore shows no dissipation.
    """

    R_ref: Param[Scalar, "ohm", positive]  # resistance at T_ref
    T_ref: Param[Scalar, "K", positive] = 293.15  # reference temperature
    alpha: Param[Scalar, "1/K"] = 0.0  # temperature coefficient at T_ref; copper at 20 C: 3.93e-3 1/K
    heat: HeatPort = HeatPort()

    def equations(self, d: Self) -> Equations:
        resistance = self.R_ref * (1.0 + self.alpha * (self.heat.T - self.T_ref))
        return super().equations(d) | dict(
            ohm=eq(self.v, resistance * self.i),
            loss=eq(self.heat.Q_flow, -self.v * self.i),
        )
