"""Pulse-width modulation, averaged."""

from typing import Self

from acausal import Component, Equations, Param, Scalar, eq

from .._limit import limited
from ._interfaces import Input, Output


class PWMAverage(Component):
    """The mean of a pulse-width modulated voltage: y = supply duty in V, with the duty limited to duty_min .. 1.

    Averaged over one switching period: `supply` is on for the share `duty` of it and zero for the rest; with
    duty_min = -1, a full bridge that applies it in either direction. The average is what a drive responds to whose time
    constants are much longer than the switching period. Left out: the ripple of current and torque, dead time, losses
    of switching and conduction. That the duty reaches its limits is an event.

    A signal carries no power: use it with `SignalVoltage`, or take `electrical.AveragedBridge` where the current drawn
    from the supply matters.
    """

    duty_min: Param[Scalar, "1"] = 0.0  # 0 for one direction, -1 for both
    duty: Input = Input()
    supply: Input = Input()  # in V
    y: Output = Output()  # in V

    def equations(self, d: Self) -> Equations:
        duty = limited(self.duty.value, self.duty_min, 1.0)
        return dict(average=eq(self.y.value, self.supply.value * duty))
