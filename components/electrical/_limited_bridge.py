"""Bridge with current limit."""

from typing import Self

from acausal import Energy, Equations, Param, Scalar, Var, eq, nonnegative, positive

from .._limit import limited
from ..blocks import Input
from ._interfaces import TwoPort


class CurrentLimitedBridge(TwoPort):
    """An averaged full bridge with current limit: v2 = m v1 - 2 Ron i and i1 = m i, with the load current i = -i2.

    Port 1 is the direct-current supply, port 2 the load. The duty m is the input, limited to -1 .. 1 and then to
    (-i_max - i)/band .. (i_max - i)/band: above i_max - band it is reduced, at i_max the load is short-circuited, and
    above i_max it is braked. At the limit, a driven load thus draws between i_max - band and i_max, as on average with
    a hysteresis chopper of this band. Ron is the resistance of each of two closed switches. Not modelled: ripple, dead
    time, switching losses. Without a limit, see `AveragedBridge`; for switching, see `HBridge`.
    """

    i_max: Param[Scalar, "A", positive]  # limit of the load current
    band: Param[Scalar, "A", positive]  # current range over which the duty is reduced, a few per cent of i_max
    Ron: Param[Scalar, "ohm", nonnegative] = 0.0  # resistance of a closed switch
    m: Var[Scalar, "1"] = 0.0  # limited duty
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
