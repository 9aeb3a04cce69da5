"""A leg of a bridge: two switches with diodes, switched or averaged, with their losses."""

from typing import Any, Self

import jax.numpy as jnp

from acausal import (
    Component,
    Discrete,
    Energy,
    Equations,
    Events,
    Param,
    Scalar,
    Time,
    Var,
    at,
    eq,
    nonnegative,
    positive,
)

from .._limit import limited
from ..blocks import Input
from ..blocks._intervals import began
from ..thermal import HeatPort
from ._interfaces import Pin


class Leg(Component, partial=True):
    """Two switches with antiparallel diodes between p and n, and the output between them.

    With the gate g, 1 while p is connected and 0 while n is, and the current i out of the leg: v_out = v_n + g v - V_0
    tanh(i/i_0) - R_on i, with v = v_p - v_n, for a switch or a diode alike. Turning on and off costs the energy
    t_switch v |i| in each period, proportional to voltage and current as data sheets are scaled (Graovac, Puerschel,
    `IGBT Power Losses Calculation Using the Data-Sheet Parameters`, Infineon 2009): t_switch = (E_on + E_off +
    E_rr)/(V I) at the voltage V and current I of the data sheet. With `heat=HeatPort()` the losses leave as heat.
    """

    frequency: Param[Scalar, "Hz", positive]  # switching frequency
    dead_time: Param[Scalar, "s", nonnegative] = 0.0  # time between turning one switch off and the other on
    R_on: Param[Scalar, "ohm", nonnegative] = 0.0  # differential resistance of a switch or diode
    V_0: Param[Scalar, "V", nonnegative] = 0.0  # threshold voltage of a switch or diode
    t_switch: Param[Scalar, "s", nonnegative] = 0.0  # energy of turning on and off, per voltage and current
    i_0: Param[Scalar, "A", positive] = 0.1  # width of the transition of threshold and dead time through zero current
    g: Var[Scalar, "1"] = 0.0  # gate, or its mean
    p: Pin = Pin()
    n: Pin = Pin()
    out: Pin = Pin()
    duty: Input = Input()  # share of a period during which p is connected, limited to 0 .. 1
    heat: HeatPort | None = None

    def _sign(self) -> Scalar:
        """Sign of the current out of the leg, smoothed at zero."""
        return jnp.tanh(-self.out.i / self.i_0)

    def _drop(self) -> Scalar:
        return self.V_0 * self._sign() - self.R_on * self.out.i

    def switching(self) -> Scalar:
        """Current in A that switching draws from p to n."""
        raise NotImplementedError

    def _loss(self) -> Scalar:
        return self.switching() * (self.p.v - self.n.v) - self._drop() * self.out.i

    def equations(self, d: Any) -> Equations:
        heat = {} if self.heat is None else dict(loss=eq(self.heat.Q_flow, -self._loss()))
        return heat | dict(
            kirchhoff=eq(self.p.i + self.n.i + self.out.i),
            output=eq(self.out.v, self.n.v + self.g * (self.p.v - self.n.v) - self._drop()),
            supply=eq(self.p.i, -self.g * self.out.i + self.switching()),
        )

    def energy(self) -> Energy:
        return Energy(dissipated=self._loss() if self.heat is None else 0.0)


class HalfBridge(Leg):
    """A leg of a bridge that switches: pulses in the middle of each period, with dead time. See `Leg`.

    The duty is sampled at the beginning of each period (regular sampling, symmetric carrier). During the dead time the
    current flows through a diode: if it leaves the leg, the pulse begins late, otherwise it ends late. Pulses shorter
    than the dead time are left out. The energy of switching in a period is drawn from the supply during the next. Not
    modelled: currents that cross zero during the dead time and rest there, shoot-through, overvoltage. The average is
    an `AveragedHalfBridge`.
    """

    on: Discrete[Scalar, "1"] = 0.0  # gate
    rises: Discrete[Scalar, "s"] = jnp.inf  # time at which the lower switch turns off
    falls: Discrete[Scalar, "s"] = jnp.inf  # time at which the upper switch turns off
    rises_late: Discrete[Scalar, "s"] = jnp.inf  # time at which the upper switch turns on
    falls_late: Discrete[Scalar, "s"] = jnp.inf  # time at which the lower switch turns on
    charge: Discrete[Scalar, "C"] = 0.0  # charge drawn for switching in this period
    drawn: Discrete[Scalar, "A"] = 0.0  # current for the switching of the last period
    t: Time[Scalar, "s"] = 0.0

    def switching(self) -> Scalar:
        return self.drawn

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(gate=eq(self.g, self.on))

    def events(self) -> Events:
        leaves, period = self.out.i < 0.0, 1.0 / self.frequency
        change = 0.5 * self.t_switch * jnp.abs(self.out.i)
        duty = limited(self.duty.value, 0.0, 1.0)
        start, half = began(self.t, 0.0, period), 0.5 * period
        in_dead_time = (self.falls_late > self.t) & (self.falls_late < jnp.inf)
        # A gate that stays on or off for a whole period does not switch at its ends.
        stays = (duty == 1.0) | in_dead_time
        return dict(
            upper_off=at(
                self.falls,
                on=jnp.where(leaves, 0.0, self.on),
                falls_late=self.falls + self.dead_time,
                rises_late=jnp.inf,
                charge=self.charge + change * self.on,
            ),
            lower_on=at(self.falls_late, on=0.0),
            lower_off=at(
                self.rises,
                on=jnp.where(leaves, self.on, 1.0),
                rises_late=self.rises + self.dead_time,
                falls_late=jnp.inf,
                charge=self.charge + change * (1.0 - self.on),
            ),
            upper_on=at(self.rises_late, on=1.0),
            sample=at(
                0.0,
                every=period,
                on=jnp.where(stays, self.on, 0.0),
                rises=jnp.where(duty > 0.0, start + half * (1.0 - duty), jnp.inf),
                falls=jnp.where((duty > 0.0) & (duty < 1.0), start + half * (1.0 + duty), jnp.inf),
                drawn=self.charge * self.frequency,
                charge=jnp.where(stays, 0.0, change * self.on),
            ),
        )


class AveragedHalfBridge(Leg):
    """A leg of a bridge, averaged over its switching: g = duty - dead_time frequency tanh(i/i_0), limited to 0 .. 1.

    See `Leg` for the law, with the switching loss t_switch frequency v |i|, smoothed at zero current. Choose i_0 about
    a quarter of the ripple. It has the arguments of `HalfBridge`, its switched counterpart. Not modelled: ripple, gates
    that stay on or off. At a duty of 0 or 1 it still has the switching loss and the dead time, `HalfBridge` has none.
    """

    def switching(self) -> Scalar:
        return -self.t_switch * self.frequency * self.out.i * self._sign()

    def equations(self, d: Self) -> Equations:
        mean = self.duty.value - self.dead_time * self.frequency * self._sign()
        return super().equations(d) | dict(gate=eq(self.g, limited(mean, 0.0, 1.0)))
