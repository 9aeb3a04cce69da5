"""Directional valve with open centre, for mobile machines."""

from typing import Any, Self

from acausal import Equations, Param, Scalar, Var, eq, positive

from .._limit import absolute, positive_part
from ._interfaces import FluidPort
from ._spool_valves import FourEdges


class SixWayValve(FourEdges):
    """6/3 valve with an open centre: the edges of a `FourWayValve`, and a bypass from c to d that closes as they open.

    The bypass flow is K_c x sqrt(dp) with x = 1 - |u|/closed, at least 0, and K_c = bypass_flow/sqrt(rated_drop). In
    the middle position, the pump flow passes at low pressure to the next valve or to the tank. See `Spool`.
    """

    bypass_flow: Param[Scalar, "m3/s", positive]  # flow through the open bypass at rated_drop
    closed: Param[Scalar, "1", positive] = 0.6  # |u| above which the bypass is closed
    q_cd: Var[Scalar, "m3/s"] = 0.0  # flow from c to d
    c: FluidPort = FluidPort()
    d: FluidPort = FluidPort()

    def equations(self, d: Self) -> Equations:
        share = self.bypass_flow / self.rated_flow * self._bypass()
        return super().equations(d) | dict(
            edge_cd=eq(self.q_cd, self._flow(self.c.p - self.d.p, share)),
            flow_c=eq(self.c.q, self.q_cd),
            flow_d=eq(self.d.q, -self.q_cd),
        )

    def _paths(self) -> dict[str, tuple[Any, Any]]:
        return super()._paths() | dict(cd=(self.q_cd, self.c.p - self.d.p))

    def _bypass(self) -> Scalar:
        return positive_part(1.0 - absolute(self.u.value / self.closed))
