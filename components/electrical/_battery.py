"""Battery and cable."""

from typing import Any, Self

import jax.numpy as jnp

from acausal import (
    Energy,
    Equations,
    Param,
    Requirements,
    Scalar,
    Var,
    Vector,
    eq,
    magnitude,
    nonnegative,
    positive,
    prefer,
    require,
    shape,
)

from .._checks import numbers, sampled
from .._tables import monotone_cubic, monotone_cubic_integral
from ..thermal import HeatPort
from ._interfaces import Pin, TwoPin


class Battery(TwoPin):
    """Open-circuit voltage, resistance and RC pairs in series: v = ocv(soc) + R0 i + sum of v_rc.

    Q d(soc)/dt = i and, for each pair, C dv_rc/dt = i - v_rc/R. A positive i charges the battery. Thevenin model
    (Plett, `Battery Management Systems`, vol. 1, ch. 2). The open-circuit voltage is a monotone cubic through samples
    over the state of charge (Fritsch, Butland 1984; linear for two samples), extrapolated linearly: an empty or full
    battery does not stop a run. With `heat=HeatPort()` the losses leave as heat. Not modelled: hysteresis, ageing,
    parameters that depend on charge, current or temperature.
    """

    pairs: int  # number of RC pairs
    Q: Param[Scalar, "C", positive]  # capacity; 1 A.h is 3600 C
    charges: Param[Vector, "1"]  # states of charge of the samples, increasing
    voltages: Param[Vector, "V"]  # open-circuit voltages at these states of charge
    R0: Param[Scalar, "ohm", nonnegative]  # series resistance
    R: Param[Vector, "ohm", positive]  # resistances of the RC pairs
    C: Param[Vector, "F", positive]  # capacitances of the RC pairs
    soc: Var[Scalar, "1", prefer] = 1.0  # state of charge
    v_rc: Var[Vector, "V", prefer, shape("pairs")]  # voltages of the RC pairs
    heat: HeatPort | None = None

    def __init__(
        self,
        *,
        Q: Param[Scalar, "C"],
        charges: Param[Vector, "1"],
        voltages: Param[Vector, "V"],
        R0: Param[Scalar, "ohm"],
        R: Any = (),  # one number for each RC pair
        C: Any = (),
        soc: Any = None,
        v_rc: Any = None,
        heat: HeatPort | None = None,
    ) -> None:
        self.Q, self.charges, self.voltages, self.R0 = Q, charges, voltages, R0
        self.R = numbers(self, "R", magnitude(R, "ohm", "Battery.R"))
        self.C = numbers(self, "C", magnitude(C, "F", "Battery.C"))
        self.pairs = self.R.shape[0]
        self.soc, self.v_rc, self.heat = soc, v_rc, heat
        self.p, self.n = Pin(), Pin()

    def requirements(self) -> Requirements:
        if jnp.shape(self.C) != jnp.shape(self.R) or jnp.ndim(self.R) != 1:
            return (require(False, "C must have one number for each of R"),)
        return sampled(self, "voltages", "charges")

    def start_requirements(self) -> Requirements:
        return (require((self.soc >= 0.0) & (self.soc <= 1.0), "soc must start between 0 and 1"),)

    def _loss(self) -> Scalar:
        return self.R0 * self.i**2 + jnp.sum(self.v_rc**2 / self.R)

    def equations(self, d: Self) -> Equations:
        ocv = monotone_cubic(self.soc, self.charges, self.voltages)
        heat = {} if self.heat is None else dict(heat=eq(self.heat.Q_flow, -self._loss()))
        return (
            super().equations(d)
            | heat
            | dict(
                terminals=eq(self.v, ocv + self.R0 * self.i + jnp.sum(self.v_rc)),
                charge=eq(self.Q * d.soc, self.i),
                relaxation=eq(self.C * d.v_rc, self.i - self.v_rc / self.R),
            )
        )

    def energy(self) -> Energy:
        chemical = self.Q * monotone_cubic_integral(self.soc, self.charges, self.voltages)
        lost = 0.0 if self.heat is not None else self._loss()
        return Energy(stored=chemical + jnp.sum(0.5 * self.C * self.v_rc**2), dissipated=lost)


class Cable(TwoPin):
    """A conductor and its return, lumped into one conductor: v = R i + L di/dt, R = 2 rho length/area.

    rho = resistivity (1 + alpha (temperature - T_ref)), L = inductance per length of the pair times length. The
    defaults are copper at 20 C (IEC 60228) and a spacing of the pair of about the conductor diameter. Not modelled:
    heating, capacitance, skin effect.
    """

    length: Param[Scalar, "m", positive]  # length from end to end, one way
    area: Param[Scalar, "m2", positive]  # cross section of one conductor
    resistivity: Param[Scalar, "ohm.m", positive] = 1.7241e-8  # resistivity at T_ref
    alpha: Param[Scalar, "1/K"] = 3.93e-3  # temperature coefficient at T_ref
    temperature: Param[Scalar, "K", positive] = 293.15
    T_ref: Param[Scalar, "K", positive] = 293.15  # reference temperature of resistivity and alpha
    inductance: Param[Scalar, "H/m", positive] = 0.7e-6  # inductance of the pair per length
    i: Var[Scalar, "A", prefer] = 0.0  # current from p to n

    def requirements(self) -> Requirements:
        return (require(self._warm() >= 0.0, "alpha must give a nonnegative resistance at the temperature"),)

    def _warm(self) -> Scalar:
        return 1.0 + self.alpha * (self.temperature - self.T_ref)

    @property
    def R(self) -> Scalar:
        """Resistance of both conductors in ohm."""
        return 2.0 * self.resistivity * self._warm() * self.length / self.area

    def equations(self, d: Self) -> Equations:
        drop = self.R * self.i + self.inductance * self.length * d.i
        return super().equations(d) | dict(ohm=eq(self.v, drop))

    def energy(self) -> Energy:
        return Energy(stored=0.5 * self.inductance * self.length * self.i**2, dissipated=self.R * self.i**2)
