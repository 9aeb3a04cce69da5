"""Iron losses of a rotor."""

from typing import Self

import jax.numpy as jnp

from acausal import Energy, Equations, Param, Scalar, eq, nonnegative, positive

from ..thermal import HeatPort
from ._interfaces import ToGround


class IronLoss(ToGround):
    """Drag of an iron core that turns in a constant field, tau = T_h tanh(w/w_0) + k_e w: hysteresis, eddy currents.

    Hysteresis dissipates a fixed energy per turn, eddy currents a power proportional to the square of the frequency
    (Steinmetz; Bertotti, IEEE Trans. Magn. 24, 1988, without the excess term). Two no-load currents of a data sheet
    give both terms, with bearing and brush friction. Below w_0 the hysteresis torque fades out: the core creeps where a
    real one is held. With `heat=HeatPort()` the loss leaves as heat. Not modelled: cogging, fields of the currents.
    """

    T_h: Param[Scalar, "N.m", nonnegative] = 0.0  # hysteresis torque
    k_e: Param[Scalar, "N.m.s/rad", nonnegative] = 0.0  # eddy-current drag per speed
    w_0: Param[Scalar, "rad/s", positive] = 1.0  # width of the transition through rest
    heat: HeatPort | None = None

    def _drag(self) -> Scalar:
        return self.T_h * jnp.tanh(self.w / self.w_0) + self.k_e * self.w

    def equations(self, d: Self) -> Equations:
        heat = {} if self.heat is None else dict(loss=eq(self.heat.Q_flow, -self._drag() * self.w))
        return super().equations(d) | heat | dict(drag=eq(self.flange.tau, self._drag()))

    def energy(self) -> Energy:
        return Energy(dissipated=self._drag() * self.w if self.heat is None else 0.0)
