"""Nonlinear elements: diode, saturating inductor, ideal operational amplifier."""

from typing import Self

import jax.numpy as jnp

from acausal import (
    Component,
    Energy,
    Equations,
    Param,
    Requirements,
    Scalar,
    Var,
    eq,
    positive,
    prefer,
    require,
)

from ._interfaces import Pin, TwoPin


class Diode(TwoPin):
    """Shockley's law with a parallel resistance, i = Ids (exp(v / Vt) - 1) + v / R, forward from p to n.

    Above v = max_exponent Vt the exponential continues linearly with continuous slope (MSL `Diode`). Not modelled:
    series resistance, breakdown, capacitance, temperature.
    """

    Ids: Param[Scalar, "A", positive] = 1e-6  # saturation current
    Vt: Param[Scalar, "V", positive] = 0.04  # thermal voltage times the emission coefficient
    R: Param[Scalar, "ohm", positive] = 1e8  # parallel resistance
    max_exponent: Param[Scalar, "1", positive] = 15.0  # v / Vt up to which the law is exponential

    def equations(self, d: Self) -> Equations:
        x = self.v / self.Vt
        inside = jnp.minimum(x, self.max_exponent)
        exponential = jnp.exp(inside) * (1.0 + x - inside)
        return super().equations(d) | dict(shockley=eq(self.i, self.Ids * (exponential - 1.0) + self.v / self.R))

    def energy(self) -> Energy:
        return Energy(dissipated=self.v * self.i)


def _knee(share: Scalar) -> Scalar:
    """Solution x > 0 of x arctan(1/x) = share, for 0 < share < 1.

    Newton's method for z = 1/x. Because arctan(z) - share z is concave with one positive zero, iterates that start
    above it converge from above; the start is too large by at most 29 %. The traced steps are differentiable.
    """
    z = 0.5 * jnp.pi * jnp.sqrt(1.0 / share**2 - 1.0)
    for _ in range(6):
        z = z - (jnp.arctan(z) - share * z) / (1.0 / (1.0 + z**2) - share)
    return 1.0 / z


class SaturatingInductor(TwoPin):
    """A coil whose inductance falls from Lzer to Linf as the current grows, v = dPsi/dt (MSL `SaturatingInductor`).

    Psi = Linf i + (Lzer - Linf) Ipar arctan(i / Ipar), where Ipar is such that Psi / i = Lnom at i = Inom:
    (Lnom - Linf) / (Lzer - Linf) = Ipar / Inom arctan(Inom / Ipar). Not modelled: hysteresis, losses.
    """

    Lnom: Param[Scalar, "H", positive]  # Psi / i at the current Inom, between Linf and Lzer
    Inom: Param[Scalar, "A", positive]  # nominal current
    Lzer: Param[Scalar, "H", positive]  # inductance at small currents
    Linf: Param[Scalar, "H", positive]  # differential inductance at large currents
    i: Var[Scalar, "A", prefer] = 0.0  # current from p to n
    Psi: Var[Scalar, "Wb"] = 0.0  # flux linkage

    def requirements(self) -> Requirements:
        return (
            require(self.Linf < self.Lnom, "Linf must be smaller than Lnom"),
            require(self.Lnom < self.Lzer, "Lnom must be smaller than Lzer"),
        )

    def knee(self) -> Scalar:
        """Current Ipar in A, around which the coil saturates."""
        return self.Inom * _knee((self.Lnom - self.Linf) / (self.Lzer - self.Linf))

    def equations(self, d: Self) -> Equations:
        knee, saturating = self.knee(), self.Lzer - self.Linf
        # Not d.Psi: the flux would be the state, and the current the root of a nonlinear equation.
        inductance = self.Linf + saturating / (1.0 + (self.i / knee) ** 2)
        return super().equations(d) | dict(
            flux=eq(self.Psi, self.Linf * self.i + saturating * knee * jnp.arctan(self.i / knee)),
            induction=eq(inductance * d.i, self.v),
        )

    def energy(self) -> Energy:
        """The stored energy is the integral of i dPsi."""
        knee = self.knee()
        saturating = (self.Lzer - self.Linf) * knee**2 * jnp.log1p((self.i / knee) ** 2)
        return Energy(stored=0.5 * self.Linf * self.i**2 + 0.5 * saturating)


class IdealOpAmp(Component):
    """Operational amplifier of infinite gain: no voltage between its inputs, and no current into them.

    It needs feedback from `out` to `n`. The equations do not distinguish the inverting input, so they cannot show
    instability. The supply is not modelled (MSL `IdealOpAmp3Pin`). With a pole and a limited output, see `OpAmp`.
    """

    p: Pin = Pin()  # non-inverting input
    n: Pin = Pin()  # inverting input
    out: Pin = Pin()

    def equations(self, d: Self) -> Equations:
        return dict(no_voltage=eq(self.p.v, self.n.v), no_current_p=eq(self.p.i), no_current_n=eq(self.n.i))

    def energy(self) -> Energy:
        return Energy(supplied=-self.out.v * self.out.i)
