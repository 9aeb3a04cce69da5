"""Three-phase bridges in phase coordinates: modulator, inverter, diode rectifier; brake choppers."""

from typing import Any, Self

import jax.numpy as jnp

from acausal import (
    Component,
    Connections,
    Discrete,
    Energy,
    Equations,
    Events,
    Param,
    Requirements,
    Scalar,
    connect,
    eq,
    positive,
    require,
    when,
)

from .._limit import limited
from ..blocks import Input, Output
from ..thermal import HeatPort
from ._half_bridges import Leg
from ._interfaces import Pin, TwoPin
from ._switches import IdealDiode
from ._three_phase import PhasePins, PhasePort


class PhaseModulator(Component):
    """Duties of three half bridges for phase voltages u = v/v_dc: d = 1/2 + u + z.

    With `space_vector`, the common offset z = -(max u + min u)/2 centres the three pulses as space-vector modulation
    does, and sines are not distorted up to a peak u of 1/sqrt(3) instead of 1/2 (Holmes, Lipo, `Pulse Width Modulation
    for Power Converters`, ch. 6). Large u lead to six-step operation.
    """

    space_vector: bool = True
    u_a: Input = Input()
    u_b: Input = Input()
    u_c: Input = Input()
    d_a: Output = Output()
    d_b: Output = Output()
    d_c: Output = Output()

    def equations(self, d: Self) -> Equations:
        a, b, c = self.u_a.value, self.u_b.value, self.u_c.value
        most, least = jnp.maximum(jnp.maximum(a, b), c), jnp.minimum(jnp.minimum(a, b), c)
        z = -0.5 * (most + least) if self.space_vector else 0.0
        return dict(
            duty_a=eq(self.d_a.value, 0.5 + a + z),
            duty_b=eq(self.d_b.value, 0.5 + b + z),
            duty_c=eq(self.d_c.value, 0.5 + c + z),
        )


class PhaseInverter(Component):
    """A three-phase inverter in phase coordinates: a modulator and three legs between p and n.

    `PhaseInverter(leg=HalfBridge(frequency=...))` switches, and `PhaseInverter(leg=AveragedHalfBridge(frequency=...))`
    is its average, with the same losses and dead time. See `PhaseModulator` for the inputs. If the leg has a heat port,
    the losses of the three legs leave through `heat`. In rotor coordinates, see `Inverter`.
    """

    modulator: PhaseModulator
    leg_a: Leg
    leg_b: Leg
    leg_c: Leg
    pins: PhasePins
    p: Pin
    n: Pin
    phases: PhasePort
    u_a: Input  # phase voltage divided by the direct voltage
    u_b: Input
    u_c: Input
    heat: HeatPort | None = None

    def __init__(
        self,
        *,
        leg: Leg,  # `HalfBridge` or `AveragedHalfBridge`
        space_vector: bool = True,  # see `PhaseModulator`
    ) -> None:
        self.modulator, self.pins = PhaseModulator(space_vector=space_vector), PhasePins()
        self.leg_a = self.leg_b = self.leg_c = leg
        self.p, self.n, self.phases = Pin(), Pin(), PhasePort()
        self.u_a, self.u_b, self.u_c = Input(), Input(), Input()
        self.heat = None if leg.heat is None else HeatPort()

    def connections(self) -> Connections:
        m, pins, a, b, c = self.modulator, self.pins, self.leg_a, self.leg_b, self.leg_c
        wires = (
            connect(self.phases, pins.phases),
            connect(self.p, a.p, b.p, c.p),
            connect(self.n, a.n, b.n, c.n),
            *(connect(pin, leg.out) for pin, leg in ((pins.a, a), (pins.b, b), (pins.c, c))),
            *(connect(u, inner) for u, inner in ((self.u_a, m.u_a), (self.u_b, m.u_b), (self.u_c, m.u_c))),
            *(connect(duty, leg.duty) for duty, leg in ((m.d_a, a), (m.d_b, b), (m.d_c, c))),
        )
        if self.heat is None or a.heat is None or b.heat is None or c.heat is None:
            return wires
        return (*wires, connect(self.heat, a.heat, b.heat, c.heat))


class DiodeBridge(Component):
    """A three-phase rectifier of six diodes, from the phases to p and n (MSL `DiodeBridge2mPulse`).

    Without source impedance and with a steady current, the mean voltage is 3 sqrt(3)/pi times the peak of the phase
    voltage, 3 sqrt(2)/pi of the line-to-line voltage. An inductance L of the source lowers it by 6 f L i, because the
    currents of two diodes overlap during commutation (Mohan et al., `Power Electronics`, ch. 5). A source without
    inductance needs a load with one.
    """

    pins: PhasePins
    upper_a: IdealDiode
    upper_b: IdealDiode
    upper_c: IdealDiode
    lower_a: IdealDiode
    lower_b: IdealDiode
    lower_c: IdealDiode
    phases: PhasePort
    p: Pin
    n: Pin

    def __init__(self, *, diode: IdealDiode | None = None) -> None:
        self.pins, self.phases, self.p, self.n = PhasePins(), PhasePort(), Pin(), Pin()
        self.upper_a = self.upper_b = self.upper_c = IdealDiode() if diode is None else diode
        self.lower_a = self.lower_b = self.lower_c = self.upper_a

    def connections(self) -> Connections:
        pins = self.pins
        return (
            connect(self.phases, pins.phases),
            connect(self.p, self.upper_a.n, self.upper_b.n, self.upper_c.n),
            connect(self.n, self.lower_a.p, self.lower_b.p, self.lower_c.p),
            connect(pins.a, self.upper_a.p, self.lower_a.n),
            connect(pins.b, self.upper_b.p, self.lower_b.n),
            connect(pins.c, self.upper_c.p, self.lower_c.n),
        )


class Chopper(TwoPin, partial=True):
    """A resistor across a direct-voltage link that absorbs the energy of braking, for a share g of the time."""

    R: Param[Scalar, "ohm", positive]  # brake resistor
    v_on: Param[Scalar, "V"]  # voltage at which it is on
    v_off: Param[Scalar, "V"]  # voltage at which it is off
    heat: HeatPort | None = None  # with `heat=HeatPort()` the loss leaves as heat

    def requirements(self) -> Requirements:
        return (require(self.v_off < self.v_on, "v_off must be smaller than v_on"),)

    def share(self) -> Scalar:
        """Share of the time during which it is on."""
        raise NotImplementedError

    def equations(self, d: Any) -> Equations:
        heat = {} if self.heat is None else dict(loss=eq(self.heat.Q_flow, -self.v * self.i))
        return super().equations(d) | heat | dict(ohm=eq(self.R * self.i, self.share() * self.v))

    def energy(self) -> Energy:
        return Energy(dissipated=self.v * self.i if self.heat is None else 0.0)


class BrakeChopper(Chopper):
    """A brake resistor that is switched on if the voltage exceeds v_on, and off if it falls below v_off, by events."""

    on: Discrete[Scalar, "1"] = 0.0

    def share(self) -> Scalar:
        return self.on

    def events(self) -> Events:
        on = self.on > 0.5
        return dict(start=when(~on & (self.v > self.v_on), on=1.0), stop=when(on & (self.v < self.v_off), on=0.0))


class AveragedBrakeChopper(Chopper):
    """A brake resistor, averaged over its switching: it is on for the share (v - v_off)/(v_on - v_off) of the time.

    The share is limited to 0 .. 1. For its switched counterpart see `BrakeChopper`.
    """

    def share(self) -> Scalar:
        return limited((self.v - self.v_off) / (self.v_on - self.v_off), 0.0, 1.0)
