"""On-off control."""

from collections.abc import Mapping
from typing import ClassVar, Self

import jax.numpy as jnp

from acausal import Component, Discrete, Equations, Events, Param, Scalar, eq, positive, when

from ._interfaces import Input, Output


class TwoPointController(Component):
    """y switches to 1 if u_m falls below u_s - bandwidth / 2, and to 0 if u_m exceeds u_s + bandwidth / 2.

    As MSL `Logical.OnOffController`; both changes are events. Within the band y keeps its value, initially `is_on`.
    """

    mode_names: ClassVar[Mapping[str, Mapping[float, str]]] = {"is_on": {0.0: "off", 1.0: "on"}}

    bandwidth: Param[Scalar, "", positive]  # hysteresis of u_m
    is_on: Discrete[Scalar, "1"] = 0.0
    u_s: Input = Input()  # setpoint
    u_m: Input = Input()  # measured value
    y: Output = Output()

    def equations(self, d: Self) -> Equations:
        return dict(output=eq(self.y.value, self.is_on))

    def events(self) -> Events:
        missing, half, is_on = self.u_s.value - self.u_m.value, 0.5 * self.bandwidth, self.is_on > 0.5
        return dict(
            on=when(jnp.logical_not(is_on) & (missing > half), is_on=1.0),
            off=when(is_on & (missing < -half), is_on=0.0),
        )
