"""Incremental encoder."""

from typing import Self

import jax.numpy as jnp

from acausal import Component, Discrete, Equations, Events, Param, Scalar, Time, at, eq, positive

from ..blocks import Output
from ._interfaces import Flange


class Encoder(Component):
    """Angle and speed from counts N = floor(phi/step), step = 2 pi/counts, sampled at 0, period, 2 period, ...

    angle = step N in rad, less than one step behind phi at a sample; speed = step (N - N_before)/period in rad/s, with
    the resolution step/period and a delay of half a period. Both are held between samples. The counts per turn are four
    times the lines of an incremental encoder with two tracks. No torque, no inertia. Because the counts jump,
    derivatives of a run do not propagate through them. Not modelled: index pulse, line errors, frequency limit.
    """

    counts: Param[Scalar, "1", positive]  # counts per turn
    period: Param[Scalar, "s", positive]  # sample period
    t: Time[Scalar, "s"] = 0.0
    count: Discrete[Scalar, "1"] = 0.0  # at the last sample
    change: Discrete[Scalar, "1"] = 0.0  # of the count since the previous sample
    begun: Discrete[Scalar, "1"] = 0.0  # 1 after the first sample
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
