"""Heat transfer at surfaces."""

from typing import Self

from acausal import Component, Equations, Param, Scalar, Var, eq, nonnegative

from ..blocks import Input
from ._interfaces import HeatPort

STEFAN_BOLTZMANN = 5.670374419e-8  # W/(m2.K4), CODATA 2018


class Convection(Component):
    """Heat flow from a solid to a fluid, Q_flow = u (T_solid - T_fluid), with u in W/K (MSL `Convection`).

    u is area times heat transfer coefficient, not negative. If it is constant, use `ThermalConductor`.
    """

    Q_flow: Var[Scalar, "W"] = 0.0  # heat flow from solid to fluid
    u: Input = Input()
    solid: HeatPort = HeatPort()
    fluid: HeatPort = HeatPort()

    def equations(self, d: Self) -> Equations:
        return dict(
            flow_solid=eq(self.solid.Q_flow, self.Q_flow),
            flow_fluid=eq(self.fluid.Q_flow, -self.Q_flow),
            newton=eq(self.Q_flow, self.u.value * (self.solid.T - self.fluid.T)),
        )


class BodyRadiation(Component):
    """Radiation between two grey bodies, Q_flow = Gr sigma (T_a^4 - T_b^4) (MSL `BodyRadiation`).

    sigma is the Stefan-Boltzmann constant. For a small body a in a large room Gr is its area times emissivity; for two
    large parallel plates of area A it is A / (1/e_a + 1/e_b - 1).
    """

    Gr: Param[Scalar, "m2", nonnegative]  # net radiation conductance
    sigma: Param[Scalar, "W/(m2.K4)", nonnegative] = STEFAN_BOLTZMANN  # Stefan-Boltzmann constant
    Q_flow: Var[Scalar, "W"] = 0.0  # heat flow from a to b
    a: HeatPort = HeatPort()
    b: HeatPort = HeatPort()

    def equations(self, d: Self) -> Equations:
        return dict(
            flow_a=eq(self.a.Q_flow, self.Q_flow),
            flow_b=eq(self.b.Q_flow, -self.Q_flow),
            radiation=eq(self.Q_flow, self.Gr * self.sigma * (self.a.T**4 - self.b.T**4)),
        )
