"""A valve that its flow moves: pressure and flow forces on a poppet."""

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
from ._heating import lost
from ._valves import Resistance, turbulent_flow


class PoppetValve(Resistance):
    """A poppet on its seat, lifted by the pressure at a: with the lift x = sense (s - seated), within 0 .. stroke,

    q = C_d width x sqrt(2 dp/rho) + seat sense v, v = ds/dt, and it pushes its rod open with dp seat - 2 C_d C_v
    cos(jet) width x dp, the pressure less the steady flow force, which closes (Merritt, `Hydraulic Control Systems`,
    ch. 5). Square root as in `Orifice`. With `Mass`, `Spring`, `Damper` and `HardStop` on the rod it is a direct-acting
    relief or check valve; with `sense=-1` and `seated=stroke` one that growing s closes, as in `HoldingValve`.
    What the flow force does to the rod, the liquid's momentum pays: it is booked as supplied.
    """

    seat: Param[Scalar, "m2", positive]  # area on which the pressure drop acts
    width: Param[Scalar, "m", positive]  # area of the opening per lift, pi d sin(angle of the cone)
    stroke: Param[Scalar, "m", positive]  # full lift
    density: Param[Scalar, "kg/m3", positive]  # rho
    seated: Param[Scalar, "m"] = 0.0  # position of the rod with the poppet on its seat
    sense: Param[Scalar, "1", nonzero] = 1.0  # 1 where growing s opens it, -1 where it closes it
    jet: Param[Scalar, "rad"] = 1.2043  # angle of the jet against the axis, 69 degrees
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
        return Energy(dissipated=lost(self.heat, self._loss()), supplied=-self.sense * self._flow_force() * self.v)

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
