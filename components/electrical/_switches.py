"""Ideal diode and switches (as in MSL `Modelica.Electrical.Analog.Ideal`), which switch by events."""

from collections.abc import Mapping
from typing import Any, ClassVar, Self

import jax.numpy as jnp
from jax import Array

from acausal import Component, Discrete, Energy, Equations, Events, Param, Scalar, Var, eq, nonnegative, when

from ..blocks import Input
from ._interfaces import Pin, TwoPin


class IdealDiode(TwoPin):
    """A diode with a piecewise linear characteristic, forward from p to n (MSL `IdealDiode`).

    Conducting: v = Vknee + Ron (i - Goff Vknee). Blocking: i = Goff v. The lines meet at v = Vknee. The path parameter
    s is i - Goff Vknee while conducting and v - Vknee while blocking; its zero crossing is the switching event, with
    `i_near` and `v_near` as hysteresis. These must be above rounding and well below the currents and voltages of the
    circuit: a reverse current smaller than `i_near` is not blocked.

    Small positive Ron and Goff keep circuits with diodes in series or in parallel determinate. A diode in parallel with
    a capacitor needs a positive Ron; in series with a coil, a positive Goff. The leakage current determines the voltage
    of the latter while it blocks, and so the time at which it conducts. This is accurate if the leakage is well above
    the tolerance of the coil current, to which `nominal={"coil.i": ...}` gives a small nominal value.
    """

    mode_names: ClassVar[Mapping[str, Mapping[float, str]]] = {"on": {0.0: "blocks", 1.0: "conducts"}}

    Ron: Param[Scalar, "ohm", nonnegative] = 1e-5  # resistance while conducting
    Goff: Param[Scalar, "S", nonnegative] = 1e-5  # conductance while blocking
    Vknee: Param[Scalar, "V", nonnegative] = 0.0  # forward threshold voltage
    i_near: Param[Scalar, "A", nonnegative] = 1e-10  # reverse current at which it blocks
    v_near: Param[Scalar, "V", nonnegative] = 1e-10  # forward voltage above Vknee at which it conducts
    s: Var[Scalar, ""] = 0.0  # path parameter, in A or V
    on: Discrete[Scalar, "1"] = 0.0  # 1 while conducting

    def equations(self, d: Self) -> Equations:
        on, leak = self.on > 0.5, self.Goff * self.Vknee
        return super().equations(d) | dict(
            voltage_path=eq(self.v, self.Vknee + jnp.where(on, self.Ron * self.s, self.s), check_units=False),
            current_path=eq(self.i, leak + jnp.where(on, self.s, self.Goff * self.s), check_units=False),
        )

    def events(self) -> Events:
        on = self.on > 0.5
        return dict(
            conduct=when(~on & (self.s > self.v_near), on=1.0),
            block=when(on & (self.s < -self.i_near), on=0.0),
        )

    def energy(self) -> Energy:
        return Energy(dissipated=self.v * self.i)


class ControlledSwitch(TwoPin, partial=True):
    """A contact that switches instantly, by an event when the signal u crosses `threshold`.

    Closed: v = Ron i. Open: i = Goff v. To interrupt the current of an inductor, add a path for it, such as a diode.
    """

    elsewhere: ClassVar[Mapping[str, str]] = {"control": "u"}

    Ron: Param[Scalar, "ohm", nonnegative] = 1e-5  # resistance while closed
    Goff: Param[Scalar, "S", nonnegative] = 1e-5  # conductance while open
    threshold: Param[Scalar, ""] = 0.5  # value of u at which it switches
    s: Var[Scalar, ""] = 0.0  # path parameter: i while closed, v while open
    high: Discrete[Scalar, "1"] = 0.0  # 1 while u is above the threshold
    u: Input = Input()

    def closed(self) -> Array | bool:
        """Whether the contact is closed."""
        raise NotImplementedError

    def equations(self, d: Any) -> Equations:
        closed = self.closed()
        return super().equations(d) | dict(
            voltage_path=eq(self.v, jnp.where(closed, self.Ron * self.s, self.s), check_units=False),
            current_path=eq(self.i, jnp.where(closed, self.s, self.Goff * self.s), check_units=False),
        )

    def events(self) -> Events:
        above = self.u.value > self.threshold
        return dict(rise=when(above, high=1.0), fall=when(~above & (self.high > 0.5), high=0.0))

    def energy(self) -> Energy:
        return Energy(dissipated=self.v * self.i)


class IdealClosingSwitch(ControlledSwitch):
    """A contact that is closed while the signal u exceeds `threshold` (MSL `IdealClosingSwitch`)."""

    def closed(self) -> Array | bool:
        return self.high > 0.5


class IdealOpeningSwitch(ControlledSwitch):
    """A contact that is open while the signal u exceeds `threshold` (MSL `IdealOpeningSwitch`)."""

    def closed(self) -> Array | bool:
        return self.high < 0.5


class IdealCommutingSwitch(Component):
    """Connects p to n2 while the signal u exceeds `threshold`, otherwise to n1 (MSL `IdealCommutingSwitch`)."""

    elsewhere: ClassVar[Mapping[str, str]] = {"control": "u"}

    Ron: Param[Scalar, "ohm", nonnegative] = 1e-5  # resistance of the closed contact
    Goff: Param[Scalar, "S", nonnegative] = 1e-5  # conductance of the open contact
    threshold: Param[Scalar, ""] = 0.5  # value of u at which it switches
    s1: Var[Scalar, ""] = 0.0  # path parameter of n1: current while closed, voltage while open
    s2: Var[Scalar, ""] = 0.0  # path parameter of n2
    high: Discrete[Scalar, "1"] = 0.0  # 1 while u is above the threshold
    p: Pin = Pin()
    n1: Pin = Pin()
    n2: Pin = Pin()
    u: Input = Input()

    def equations(self, d: Self) -> Equations:
        high, on, off = self.high > 0.5, self.Ron, self.Goff
        voltage1, current1 = jnp.where(high, self.s1, on * self.s1), jnp.where(high, off * self.s1, self.s1)
        voltage2, current2 = jnp.where(high, on * self.s2, self.s2), jnp.where(high, self.s2, off * self.s2)
        return dict(
            kirchhoff=eq(self.p.i + self.n1.i + self.n2.i),
            voltage_1=eq(self.p.v - self.n1.v, voltage1, check_units=False),
            voltage_2=eq(self.p.v - self.n2.v, voltage2, check_units=False),
            current_1=eq(-self.n1.i, current1, check_units=False),
            current_2=eq(-self.n2.i, current2, check_units=False),
        )

    def events(self) -> Events:
        above = self.u.value > self.threshold
        return dict(rise=when(above, high=1.0), fall=when(~above & (self.high > 0.5), high=0.0))

    def energy(self) -> Energy:
        return Energy(dissipated=-(self.p.v - self.n1.v) * self.n1.i - (self.p.v - self.n2.v) * self.n2.i)
