"""A sensor that counts."""

from typing import Self

import jax.numpy as jnp

from acausal import Component, Discrete, Equations, Events, Param, Scalar, Time, at, eq, positive

from ..blocks import Output
from ._interfaces import Flange


class Encoder(Component):
    """Counts N = floor(phi/step) with step = 2 pi/counts, read at 0, period, 2 period, ...: angle and speed from them.

    angle = step N in rad, at most one step behind phi, and speed = step (N - N_before)/period in rad/s, which so comes
    in steps of step/period and half a period late; both are held between the readings. Counts are four times the lines
    of an incremental encoder with two tracks. No torque, no inertia. As the counts jump, derivatives of a run do not
    pass through them. Not modelled: index pulse, errors of the lines, largest frequency.
    """

    counts: Param[Scalar, "1", positive]  # per turn
    period: Param[Scalar, "s", positive]  # from reading to reading
    t: Time[Scalar, "s"] = 0.0
    count: Discrete[Scalar, "1"] = 0.0  # at the last reading
    change: Discrete[Scalar, "1"] = 0.0  # of the count, since the reading before
    begun: Discrete[Scalar, "1"] = 0.0  # 1 after the first reading
    flange: Flange = Flange()
    angle: Output = Output()
    speed: Output = Output()

    def _step(self) -> Scalar:
        return 2.0 * jnp.pi / self.counts

    def equations(self, d: Self) -> Equations:
        return dict(
            no_torque=eq(self.flange.tau),
            angle=eq(self.angle.value, self._step() * self.count),
            speed=eq(self.speed.value, self._step() * self.change / self.period),
        )

    def events(self) -> Events:
        count = jnp.floor(self.flange.phi / self._step())
        change = self.begun * (count - self.count)
        return dict(reading=at(0.0, every=self.period, count=count, change=change, begun=1.0))
