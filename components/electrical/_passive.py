"""Ground and linear passive elements."""

from collections.abc import Mapping
from typing import ClassVar, Self

from acausal import Component, Energy, Equations, Param, Scalar, Var, eq, nonnegative, positive, prefer

from ._interfaces import Pin, TwoPin


class Ground(Component):
    """Reference potential, v = 0. Each electrical circuit needs one."""

    p: Pin = Pin()

    def equations(self, d: Self) -> Equations:
        return dict(reference=eq(self.p.v))


class Resistor(TwoPin):
    """Ohm's law, v = R i. Not modelled: temperature dependence. For R < 0, see `NegativeResistor`."""

    elsewhere: ClassVar[Mapping[str, str]] = {
        "alpha": "a parameter of HeatingResistor",
        "T_ref": "a parameter of HeatingResistor",
        "useHeatPort": "another class, HeatingResistor",
    }

    R: Param[Scalar, "ohm", nonnegative.otherwise("use NegativeResistor")]  # resistance

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(ohm=eq(self.v, self.R * self.i))

    def energy(self) -> Energy:
        return Energy(dissipated=self.R * self.i**2)


class NegativeResistor(TwoPin):
    """v = -R i: an active element that supplies the power R i^2, such as a converter that cancels damping.

    MSL `Resistor` with R < 0. Not modelled: the operating limits of a real converter.
    """

    R: Param[Scalar, "ohm", nonnegative]  # absolute value of the resistance

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(ohm=eq(self.v, -self.R * self.i))

    def energy(self) -> Energy:
        return Energy(supplied=self.R * self.i**2)


class Conductor(TwoPin):
    """Ohm's law, i = G v; with G = 0, an open circuit. Not modelled: temperature dependence."""

    G: Param[Scalar, "S", nonnegative.otherwise("use NegativeResistor")]  # conductance

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(ohm=eq(self.i, self.G * self.v))

    def energy(self) -> Energy:
        return Energy(dissipated=self.G * self.v**2)


class Inductor(TwoPin):
    """L di/dt = v. Not modelled: saturation, winding resistance, coupling to other coils."""

    L: Param[Scalar, "H", positive]  # inductance
    i: Var[Scalar, "A", prefer] = 0.0  # current from p to n

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(induction=eq(self.L * d.i, self.v))

    def energy(self) -> Energy:
        return Energy(stored=0.5 * self.L * self.i**2)


class Capacitor(TwoPin):
    """C dv/dt = i. Not modelled: leakage."""

    C: Param[Scalar, "F", positive]  # capacitance
    v: Var[Scalar, "V", prefer] = 0.0  # voltage from p to n

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(charge=eq(self.C * d.v, self.i))

    def energy(self) -> Energy:
        return Energy(stored=0.5 * self.C * self.v**2)
