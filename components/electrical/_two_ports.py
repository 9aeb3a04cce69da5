"""Transformers, gyrator, bridges and controlled sources."""

from collections.abc import Mapping
from typing import ClassVar, Self

from acausal import (
    Connections,
    Energy,
    Equations,
    Param,
    Requirements,
    Scalar,
    Var,
    connect,
    eq,
    nonnegative,
    nonzero,
    positive,
    prefer,
    require,
)

from ..blocks import PWM, Input
from ._interfaces import Pin, TwoPort


class Transformer(TwoPort):
    """Two coupled coils: v1 = L1 di1/dt + M di2/dt and v2 = M di1/dt + L2 di2/dt (MSL `Transformer`).

    Each of the two circuits needs a ground. Not modelled: saturation, losses. A coupling without leakage, M^2 = L1 L2,
    is refused because only one state would remain: use an `IdealTransformer` with an `Inductor`.
    """

    L1: Param[Scalar, "H", positive]  # inductance of the first coil
    L2: Param[Scalar, "H", positive]  # inductance of the second coil
    M: Param[Scalar, "H"]  # mutual inductance
    i1: Var[Scalar, "A", prefer] = 0.0  # current from p1 to n1
    i2: Var[Scalar, "A", prefer] = 0.0  # current from p2 to n2

    def requirements(self) -> Requirements:
        return (require(self.M**2 < self.L1 * self.L2, "M must be smaller in absolute value than sqrt(L1 L2)"),)

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(
            coil_1=eq(self.v1, self.L1 * d.i1 + self.M * d.i2),
            coil_2=eq(self.v2, self.M * d.i1 + self.L2 * d.i2),
        )

    def energy(self) -> Energy:
        coils = 0.5 * self.L1 * self.i1**2 + 0.5 * self.L2 * self.i2**2
        return Energy(stored=coils + self.M * self.i1 * self.i2)


class IdealTransformer(TwoPort):
    """v1 = n v2 and n i1 + i2 = 0, lossless at any frequency, including direct current (MSL `IdealTransformer`)."""

    n: Param[Scalar, "1", nonzero]  # turns of the first coil for one turn of the second

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(
            voltages=eq(self.v1, self.n * self.v2), currents=eq(self.n * self.i1 + self.i2)
        )


class Gyrator(TwoPort):
    """i1 = G v2 and i2 = -G v1, lossless (MSL `Gyrator` with G1 = G2)."""

    elsewhere: ClassVar[Mapping[str, str]] = {"G1": "G, in both directions", "G2": "G, in both directions"}

    G: Param[Scalar, "S", nonzero]  # gyration conductance

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(there=eq(self.i1, self.G * self.v2), back=eq(self.i2, -self.G * self.v1))


class AveragedBridge(TwoPort):
    """A lossless switched converter, averaged over its switching period: v2 = duty v1 and i1 = -duty i2.

    Port 1 is the direct-current supply, port 2 the load: a half bridge or buck converter for 0 <= duty <= 1, a full
    bridge for -1 <= duty <= 1. Power can flow in both directions. Not modelled: ripple, dead time, losses. The duty is
    not limited: see `blocks.Limiter`.
    """

    duty: Input = Input()

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(
            voltages=eq(self.v2, self.duty.value * self.v1),
            currents=eq(self.i1, -self.duty.value * self.i2),
        )


class HBridge(TwoPort):
    """A full bridge of ideal switches with pulse-width modulation: v2 = g v1 - 2 Ron i2' and i1 = -g i2.

    g is the sign of the duty for the first fraction |duty| of each period, and 0 for the rest, when the load is
    short-circuited; i2' = -i2 flows into the load through two switches. `HBridge(frequency=..., Ron=...)`. The duty is
    sampled at the beginning of each period; see `blocks.PWM`. Not modelled: dead time, switching losses. The average
    over a period is an `AveragedBridge`.
    """

    Ron: Param[Scalar, "ohm", nonnegative]  # resistance of a closed switch
    pwm: PWM
    duty: Input = Input()

    def __init__(
        self,
        *,
        frequency: Param[Scalar, "Hz"],  # switching frequency
        Ron: Param[Scalar, "ohm"] = 0.0,
    ) -> None:
        self.Ron, self.pwm = Ron, PWM.of_frequency(frequency)
        self.p1, self.n1, self.p2, self.n2, self.duty = Pin(), Pin(), Pin(), Pin(), Input()

    def connections(self) -> Connections:
        return (connect(self.duty, self.pwm.u),)

    def equations(self, d: Self) -> Equations:
        gate = self.pwm.y.value
        return super().equations(d) | dict(
            voltages=eq(self.v2, gate * self.v1 + 2.0 * self.Ron * self.i2),
            currents=eq(self.i1, -gate * self.i2),
        )

    def energy(self) -> Energy:
        return Energy(dissipated=2.0 * self.Ron * self.i2**2)


class Controlled(TwoPort, partial=True):
    """A source at port 2, controlled without power at port 1."""

    def energy(self) -> Energy:
        return Energy(supplied=-self.v2 * self.i2)


class VCV(Controlled):
    """Voltage-controlled voltage source, v2 = gain v1, i1 = 0."""

    gain: Param[Scalar, "1"]  # voltage gain

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(control=eq(self.i1), source=eq(self.v2, self.gain * self.v1))


class VCC(Controlled):
    """Voltage-controlled current source, i2 = G v1, i1 = 0."""

    elsewhere: ClassVar[Mapping[str, str]] = {"transConductance": "G"}

    G: Param[Scalar, "S"]  # transconductance

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(control=eq(self.i1), source=eq(self.i2, self.G * self.v1))


class CCV(Controlled):
    """Current-controlled voltage source, v2 = R i1, v1 = 0."""

    elsewhere: ClassVar[Mapping[str, str]] = {"transResistance": "R"}

    R: Param[Scalar, "ohm"]  # transresistance

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(control=eq(self.v1), source=eq(self.v2, self.R * self.i1))


class CCC(Controlled):
    """Current-controlled current source, i2 = gain i1, v1 = 0."""

    gain: Param[Scalar, "1"]  # current gain

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(control=eq(self.v1), source=eq(self.i2, self.gain * self.i1))
