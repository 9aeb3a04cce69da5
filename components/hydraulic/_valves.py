"""Flow resistances and smooth valves."""

from typing import Any, Self

import jax.numpy as jnp

from acausal import Energy, Equations, Param, Scalar, eq, nonnegative, positive

from .._limit import limited
from ..blocks import Input
from ._interfaces import TwoPort


class Resistance(TwoPort, partial=True):
    """An element that dissipates dp q; with `heat=HeatPort()` this loss leaves as heat.

    If it has a liquid, the viscosity is then that at the temperature of the heat port; density and bulk modulus stay
    those at the temperature stored in the liquid.
    """

    def energy(self) -> Energy:
        return Energy(dissipated=self._loss())

    def _loss(self) -> Scalar:
        return self.dp * self.q


class LaminarResistance(Resistance):
    """dp = resistance q."""

    resistance: Param[Scalar, "Pa.s/m3", nonnegative]  # pressure drop per flow

    @classmethod
    def from_pipe(cls, *, diameter: Scalar, length: Scalar, viscosity: Scalar) -> "LaminarResistance":
        """A round pipe by Hagen and Poiseuille, 128 mu L / (pi d^4), with the dynamic viscosity in Pa.s."""
        return cls(resistance=128.0 * viscosity * length / (jnp.pi * diameter**4))

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(law=eq(self.dp, self.resistance * self.q))


def turbulent_flow(dp: Scalar, conductance: Scalar, transition_pressure: Scalar) -> Scalar:
    """Turbulent flow conductance sqrt(|dp|) sign(dp), smoothed at zero: conductance dp / (dp^2 + p_t^2)^(1/4).

    Within about p_t the flow is laminar, with the slope conductance / sqrt(p_t); at 10 p_t it is 0.25 % too low.
    """
    return conductance * dp / (dp**2 + transition_pressure**2) ** 0.25


class Orifice(Resistance):
    """A sharp-edged orifice, q = C_d A sqrt(2 dp / rho) (Merritt, `Hydraulic Control Systems`, ch. 3).

    Around dp = 0 a laminar transition of width `transition_pressure` replaces the square root. A wider transition makes
    the equations less stiff near equal pressures, but slows the end of a discharge too much.
    """

    area: Param[Scalar, "m2", nonnegative]  # A
    density: Param[Scalar, "kg/m3", positive]  # rho
    discharge_coefficient: Param[Scalar, "1", positive] = 0.61  # C_d
    transition_pressure: Param[Scalar, "Pa", positive] = 100.0  # p_t

    def equations(self, d: Self) -> Equations:
        conductance = self.discharge_coefficient * self.area * jnp.sqrt(2.0 / self.density)
        return super().equations(d) | dict(
            law=eq(self.q, turbulent_flow(self.dp, conductance, self.transition_pressure))
        )


class OnOffValve(Resistance):
    """An orifice with the area `area` x^2 (3 - 2 x), where x is the signal u limited to 0 (closed) .. 1 (open).

    The cubic makes opening and closing smooth. Square root as in `Orifice`. Not modelled: leakage when closed, flow
    forces, delay of the coil.
    """

    area: Param[Scalar, "m2", nonnegative]  # area when open
    density: Param[Scalar, "kg/m3", positive]  # rho
    discharge_coefficient: Param[Scalar, "1", positive] = 0.61  # C_d
    transition_pressure: Param[Scalar, "Pa", positive] = 100.0  # p_t
    u: Input = Input()

    def equations(self, d: Self) -> Equations:
        x = limited(self.u.value, 0.0, 1.0)
        area = self.area * x**2 * (1.0 + 2.0 * (1.0 - x))
        conductance = self.discharge_coefficient * area * jnp.sqrt(2.0 / self.density)
        return super().equations(d) | dict(
            law=eq(self.q, turbulent_flow(self.dp, conductance, self.transition_pressure))
        )


class SpringLoadedValve(Resistance, partial=True):
    """Closed up to the cracking pressure, then opening in proportion: q = conductance (dp - cracking_pressure).

    The corner is smoothed: q = conductance [S(dp) - S(0) + leakage dp], with
    S(dp) = p_t ln(1 + exp((dp - cracking_pressure) / p_t)). The smoothing adds 0.69 p_t conductance to the flow at the
    corner, and at most S(0) conductance to the backward leakage. Without leakage, the pressure drop of a closed valve
    as the only path of a flow is undetermined. Not modelled: mass of the poppet, hysteresis, full opening.
    """

    conductance: Param[Scalar, "m3/(s.Pa)", nonnegative]  # flow per pressure above the cracking pressure
    cracking_pressure: Param[Scalar, "Pa", nonnegative]  # dp at which the valve begins to open
    transition_pressure: Param[Scalar, "Pa", positive]  # p_t
    leakage: Param[Scalar, "1", nonnegative]  # conductance of the closed valve, as a fraction of `conductance`

    def equations(self, d: Any) -> Equations:
        # Subtracting S(0) makes the flow zero at zero pressure drop; otherwise the valve would be a source of energy.
        opening = self._rounded(self.dp) - self._rounded(0.0)
        return super().equations(d) | dict(law=eq(self.q, self.conductance * (opening + self.leakage * self.dp)))

    def _rounded(self, dp: Scalar) -> Scalar:
        return self.transition_pressure * jnp.logaddexp((dp - self.cracking_pressure) / self.transition_pressure, 0.0)


class ReliefValve(SpringLoadedValve):
    """A pressure-relief valve: opens from a to b above its cracking pressure. See `SpringLoadedValve` for the law."""

    transition_pressure: Param[Scalar, "Pa", positive] = 1e4  # p_t
    leakage: Param[Scalar, "1", nonnegative] = 1e-6  # conductance of the closed valve, as a fraction of `conductance`


class CheckValve(SpringLoadedValve):
    """A check valve: passes flow from a to b only. See `SpringLoadedValve` for the law and its leakage."""

    cracking_pressure: Param[Scalar, "Pa", nonnegative] = 2e4  # dp at which the valve begins to open
    transition_pressure: Param[Scalar, "Pa", positive] = 1e3  # p_t
    leakage: Param[Scalar, "1", nonnegative] = 0.0  # conductance of the closed valve, as a fraction of `conductance`
