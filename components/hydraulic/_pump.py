"""Pump or motor with constant loss coefficients."""

from typing import Any, Self

from acausal import Energy, Equations, Param, Scalar, Var, eq, nonnegative, positive, prefer

from .._data_sheet import DataSheet
from ..rotational import Flange
from ._interfaces import FluidPort, MixedPart


class DisplacementMachine(MixedPart, partial=True):
    """A pump or motor with the flow q from a to b, the pressure rise dp = p_b - p_a and the speed w = dphi/dt."""

    displacement: Param[Scalar, "m3/rad", positive]  # D, as in quantity(11.0, "cm3/rev")
    w: Var[Scalar, "rad/s", prefer] = 0.0  # speed
    dp: Var[Scalar, "Pa"] = 0.0  # pressure rise from a to b
    q: Var[Scalar, "m3/s"] = 0.0  # flow from a to b
    shaft: Flange = Flange()
    a: FluidPort = FluidPort()  # suction
    b: FluidPort = FluidPort()  # delivery

    def equations(self, d: Any) -> Equations:
        return dict(
            speed=eq(self.w, d.shaft.phi),
            rise=eq(self.dp, self.b.p - self.a.p),
            suction=eq(self.a.q, self.q),
            delivery=eq(self.b.q, -self.q),
        )


class Pump(DisplacementMachine):
    """Pump or motor of fixed displacement, with Wilson's losses (Merritt, `Hydraulic Control Systems`, ch. 4).

    With the pressure rise dp = p_b - p_a: q = D w - leakage dp from a to b, and J dw/dt = tau - D dp - friction w.
    With zero losses it is ideal. Not modelled: ripple, dry friction, compression in the pump, case drain.
    """

    J: Param[Scalar, "kg.m2", nonnegative] = 0.0  # moment of inertia
    leakage: Param[Scalar, "m3/(s.Pa)", nonnegative] = 0.0  # laminar leakage from delivery to suction
    friction: Param[Scalar, "N.m.s/rad", nonnegative] = 0.0  # viscous friction coefficient
    data_sheet: DataSheet | None = None  # source of the parameters; see `catalogues`

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(
            flow=eq(self.q, self.displacement * self.w - self.leakage * self.dp),
            newton=eq(self.J * d.w, self.shaft.tau - self.displacement * self.dp - self.friction * self.w),
        )

    def energy(self) -> Energy:
        return Energy(
            stored=0.5 * self.J * self.w**2,
            dissipated=self.leakage * self.dp**2 + self.friction * self.w**2,
        )
