"""A driver who follows a speed, and a drive cycle to follow."""

from typing import Self

from acausal import Equations, Param, Scalar, eq, unbounded

from .._limit import positive_part
from ..blocks import LimitedController, Output, TimeSeries

# Speed in km/h over time in s: UNECE Regulations 83 and 101, part two of the operating cycle, with constant speed while
# the gear is changed.
EUDC = {
    0: 0, 20: 0, 25: 15, 27: 15, 36: 35, 38: 35, 46: 50, 48: 50, 61: 70, 111: 70, 119: 50, 188: 50, 201: 70, 251: 70,
    286: 100, 316: 100, 336: 120, 346: 120, 362: 80, 370: 50, 380: 0, 400: 0,
}  # fmt: skip


class Driver(LimitedController):
    """A driver who follows a speed: PI control, divided into traction and brake.

    y = k (wp u_s - u_m + x), limited to -1 .. 1, with the setpoint u_s and the speed u_m in m/s and the anti-windup of
    `LimitedController`; traction = y and brake = 0 if y > 0, otherwise traction = 0 and brake = -y (longitudinal driver
    of MathWorks Powertrain Blockset; Guzzella, Sciarretta, `Vehicle Propulsion Systems`, forward models). Connect the
    outputs through a `Gain` with the greatest torque or force of motor and brake. The road load over the greatest force
    is a suitable feed-forward. Not modelled: reaction time, preview.
    """

    y_max: Param[Scalar, "", unbounded] = 1.0  # upper limit of y: full traction
    y_min: Param[Scalar, "", unbounded] = -1.0  # lower limit of y: full brake
    traction: Output = Output()  # command from 0 to 1
    brake: Output = Output()  # command from 0 to 1

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(
            law=eq(self.y_unlimited, self._wanted()),
            traction=eq(self.traction.value, positive_part(self.y.value)),
            brake=eq(self.brake.value, positive_part(-self.y.value)),
        )


def eudc() -> TimeSeries:
    """The extra-urban drive cycle of UNECE Regulations 83 and 101: speed in m/s over 400 s and 6.955 km.

    For another cycle, give its table to a `blocks.TimeSeries` with `smooth=False`.
    """
    return TimeSeries(times=[float(t) for t in EUDC], values=[v / 3.6 for v in EUDC.values()], smooth=False)
