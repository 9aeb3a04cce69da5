"""Bridges with current control and with a current limit."""

from typing import Self

from acausal import Energy, Equations, Param, Scalar, Var, eq, nonnegative, positive, prefer

from .._limit import limited
from ..blocks import Input
from ._interfaces import TwoPort


class CurrentControlledBridge(TwoPort):
    """An averaged full bridge with PI control of the load current i = -i2, with limited duty and anti-windup.

    With the current setpoint u limited to +-i_max and e = u - i: the duty is m = (k e + x)/V limited to +-m_max. The
    integral Ti dx/dt = k e + V (m - m_unlimited)/Ni has back-calculation as anti-windup (Astrom, Hagglund, `PID
    Controllers`, ch. 3). v2 = m v1 + 2 Ron i2 and i1 = -m i2, as in `AveragedBridge`. V is the supply voltage assumed
    by the controller; the loop gain is proportional to v1/V. `for_load` cancels the pole of the load (modulus optimum;
    Schroeder, `Elektrische Antriebe - Regelung`). Not modelled: sampling, dead time, ripple, switching losses.
    """

    k: Param[Scalar, "ohm", positive]  # gain, voltage per current error
    Ti: Param[Scalar, "s", positive]  # integral time
    V: Param[Scalar, "V", positive]  # nominal supply voltage
    i_max: Param[Scalar, "A", positive]  # limit of the current setpoint
    m_max: Param[Scalar, "1", positive] = 1.0  # maximum duty
    Ni: Param[Scalar, "1", positive] = 0.9  # Ni Ti is the time constant of the back-calculation
    Ron: Param[Scalar, "ohm", nonnegative] = 0.0  # resistance of a closed switch
    x: Var[Scalar, "V", prefer] = 0.0  # integral part
    error: Var[Scalar, "A"] = 0.0  # e, current error
    unlimited: Var[Scalar, "1"] = 0.0  # duty before its limits
    m: Var[Scalar, "1"] = 0.0  # duty
    u: Input = Input()

    @classmethod
    def for_load(
        cls, *, R: Scalar, L: Scalar, bandwidth: Scalar, V: Scalar, i_max: Scalar, Ron: Scalar = 0.0
    ) -> "CurrentControlledBridge":
        """A controller for a load of R in ohm and L in H: k = w L, Ti = L/(R + 2 Ron), so that di/dt = w (u - i).

        Choose the bandwidth w in rad/s well below the switching frequency, a tenth or less.
        """
        return cls(k=bandwidth * L, Ti=L / (R + 2.0 * Ron), V=V, i_max=i_max, Ron=Ron)

    def equations(self, d: Self) -> Equations:
        excess = self.V * (self.m - self.unlimited)
        return super().equations(d) | dict(
            compared=eq(self.error, limited(self.u.value, -self.i_max, self.i_max) + self.i2),
            integral=eq(self.Ti * d.x, self.k * self.error + excess / self.Ni),
            control=eq(self.V * self.unlimited, self.k * self.error + self.x),
            limits=eq(self.m, limited(self.unlimited, -self.m_max, self.m_max)),
            voltages=eq(self.v2, self.m * self.v1 + 2.0 * self.Ron * self.i2),
            currents=eq(self.i1, -self.m * self.i2),
        )

    def energy(self) -> Energy:
        return Energy(dissipated=2.0 * self.Ron * self.i2**2)


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
