"""Poppet valve with pressure and flow forces."""

from typing import Self

import jax.numpy as jnp

from acausal import (
    Energy,
    Equations,
    Param,
    Requirements,
    Scalar,
    Var,
    eq,
    nonnegative,
    nonzero,
    positive,
    require,
)

from .._limit import limited
from ..translational import Flange
from ._valves import Resistance, turbulent_flow


class PoppetValve(Resistance):
    """A poppet lifted off its seat by the pressure at a.

    With the lift x = sense (s - seated), limited to 0 .. stroke: q = C_d width x sqrt(2 dp/rho) + seat sense v, v =
    ds/dt. The opening force on the rod is dp seat - 2 C_d C_v cos(jet) width x dp, the pressure force minus the steady
    flow force (Merritt, `Hydraulic Control Systems`, ch. 5). Square root as in `Orifice`. Add `Mass`, `Spring`,
    `Damper` and `HardStop` on the rod for a direct-acting relief or check valve. With `sense=-1` and `seated=stroke` an
    increasing s closes it, as in `HoldingValve`. The work of the flow force comes from the momentum of the liquid and
    counts as supplied.
    """

    seat: Param[Scalar, "m2", positive]  # area on which the pressure drop acts
    width: Param[Scalar, "m", positive]  # opening area per lift, pi d sin(half the cone angle)
    stroke: Param[Scalar, "m", positive]  # full lift
    density: Param[Scalar, "kg/m3", positive]  # rho
    seated: Param[Scalar, "m"] = 0.0  # position of the rod with the poppet on its seat
    sense: Param[Scalar, "1", nonzero] = 1.0  # 1 if increasing s opens the valve, -1 if it closes it
    jet: Param[Scalar, "rad"] = 1.2043  # angle between jet and axis, 69 degrees
    discharge_coefficient: Param[Scalar, "1", positive] = 0.65  # C_d
    velocity_coefficient: Param[Scalar, "1", nonnegative] = 0.98  # C_v; 0 without flow force
    transition_pressure: Param[Scalar, "Pa", positive] = 100.0  # p_t
    v: Var[Scalar, "m/s"] = 0.0  # speed of the rod
    rod: Flange = Flange()

    def requirements(self) -> Requirements:
        return (require(jnp.abs(self.sense) == 1.0, "sense must be 1 or -1"),)

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(
            speed=eq(self.v, d.rod.s),
            law=eq(self.q, self._metered() + self.sense * self.seat * self.v),
            force=eq(self.rod.f, self.sense * (self._flow_force() - self.seat * self.dp)),
        )

    def energy(self) -> Energy:
        return Energy(dissipated=self._loss(), supplied=-self.sense * self._flow_force() * self.v)

    def _loss(self) -> Scalar:
        return self.dp * self._metered()

    def _lift(self) -> Scalar:
        return self.sense * (self.rod.s - self.seated) / self.stroke

    def _opening(self) -> Scalar:
        return self.width * self.stroke * limited(self._lift(), 0.0, 1.0)

    def _metered(self) -> Scalar:
        conductance = self.discharge_coefficient * self._opening() * jnp.sqrt(2.0 / self.density)
        return turbulent_flow(self.dp, conductance, self.transition_pressure)

    def _flow_force(self) -> Scalar:
        coefficient = 2.0 * self.discharge_coefficient * self.velocity_coefficient * jnp.cos(self.jet)
        return coefficient * self._opening() * self.dp
