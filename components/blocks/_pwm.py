"""Averaged pulse-width modulation."""

from typing import Self

from acausal import Component, Equations, Param, Scalar, eq

from .._limit import limited
from ._interfaces import Input, Output


class PWMAverage(Component):
    """Mean of a pulse-width modulated voltage: y = supply duty in V, with the duty limited to duty_min .. 1.

    `supply` is on for the fraction `duty` of a switching period and zero for the rest; with duty_min = -1, a full
    bridge applies it in either direction. A drive with time constants much longer than the switching period responds to
    this mean. Not modelled: ripple of current and torque, dead time, switching and conduction losses. Reaching a limit
    of the duty is an event.

    A signal carries no power: use it with `SignalVoltage`. If the current drawn from the supply matters, use
    `electrical.AveragedBridge` instead.
    """

    duty_min: Param[Scalar, "1"] = 0.0  # 0 for one direction, -1 for both
    duty: Input = Input()
    supply: Input = Input()  # in V
    y: Output = Output()  # in V

    def equations(self, d: Self) -> Equations:
        duty = limited(self.duty.value, self.duty_min, 1.0)
        return dict(average=eq(self.y.value, self.supply.value * duty))
