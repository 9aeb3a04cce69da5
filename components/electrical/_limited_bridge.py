"""A bridge that keeps the current of its load below a limit."""

from typing import Self

from acausal import Energy, Equations, Param, Scalar, Var, eq, nonnegative, positive

from .._limit import limited
from ..blocks import Input
from ._interfaces import TwoPort


class CurrentLimitedBridge(TwoPort):
    """An averaged full bridge with current limit: v2 = m v1 - 2 Ron i and i1 = m i, with the load's current i = -i2.

    Port 1 is the direct-current supply, port 2 the load. The duty m is the wanted one within -1 .. 1 and, beyond that,
    within (-i_max - i)/band .. (i_max - i)/band: from i_max - band on it is taken back, at i_max the load is
    short-circuited, and above it is braked. So a driven load draws between i_max - band and i_max at the limit. A
    chopper with hysteresis limits so on average, with the band as its width. Ron is that of each of two closed
    switches. Left out: ripple, dead time, losses of switching. Without a limit: `AveragedBridge`; switched: `HBridge`.
    """

    i_max: Param[Scalar, "A", positive]  # limit of the load's current
    band: Param[Scalar, "A", positive]  # width over which the duty is taken back, some per cent of i_max
    Ron: Param[Scalar, "ohm", nonnegative] = 0.0  # resistance of a closed switch
    m: Var[Scalar, "1"] = 0.0  # duty within the limits
    duty: Input = Input()

    def equations(self, d: Self) -> Equations:
        wanted = limited(self.duty.value, -1.0, 1.0)
        low, high = (-self.i_max + self.i2) / self.band, (self.i_max + self.i2) / self.band
        return super().equations(d) | dict(
            limits=eq(self.m, limited(wanted, low, high)),
            voltages=eq(self.v2, self.m * self.v1 + 2.0 * self.Ron * self.i2),
            currents=eq(self.i1, -self.m * self.i2),
        )

    def energy(self) -> Energy:
        return Energy(dissipated=2.0 * self.Ron * self.i2**2)
