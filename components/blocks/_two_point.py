"""On-off control."""

from collections.abc import Mapping
from typing import ClassVar

from acausal import Events, Param, Scalar, positive, when

from ._interfaces import Input
from ._logic import OnOff


class TwoPointController(OnOff):
    """y switches to 1 if u_m falls below u_s - bandwidth / 2, and to 0 if u_m exceeds u_s + bandwidth / 2.

    As MSL `Logical.OnOffController`; both changes are events. Within the band y keeps its value, initially `is_on`.
    """

    mode_names: ClassVar[Mapping[str, Mapping[float, str]]] = {"is_on": {0.0: "off", 1.0: "on"}}

    bandwidth: Param[Scalar, "", positive]  # hysteresis of u_m
    u_s: Input = Input()  # setpoint
    u_m: Input = Input()  # measured value

    def events(self) -> Events:
        missing, half, is_on = self.u_s.value - self.u_m.value, 0.5 * self.bandwidth, self.is_on > 0.5
        return dict(
            on=when(~is_on & (missing > half), is_on=1.0),
            off=when(is_on & (missing < -half), is_on=0.0),
        )
