"""Rigid stops of a shaft, and backlash between two shafts."""

from collections.abc import Mapping
from typing import ClassVar, Self

import jax.numpy as jnp

from acausal import (
    Component,
    Discrete,
    Energy,
    Equations,
    Events,
    Param,
    Requirements,
    Scalar,
    Var,
    eq,
    nonnegative,
    prefer,
    require,
    unbounded,
)

from .. import _impact
from .._limit import absolute, limited
from ._interfaces import Compliant, Flange


class HardStop(Component):
    """Rigid stops on the ground that keep a shaft within phi_min <= phi <= phi_max, with Newton's law of impact.

    At a stop the speed changes from w to -restitution w. If the rebound is no faster than `rest`, the shaft rests at
    the stop, held by the contact torque, until it is pulled away. This ends an infinite series of ever smaller rebounds
    after a finite number. Impacts and lift-off are events. The shaft must have an inertia. The impulse changes the
    speeds of the whole model by its inertias, also through planetary gears with several degrees of freedom. Other
    contacts that are closed or struck at the same instant share it, and friction that sticks lets go: see
    `acausal.impact`.

    If a stop and dry friction hold the shaft together, the stop carries the load because it does not creep. If two
    stops hold it, give one of them a `creep` of 1e-10 / (kg.m2).
    """

    mode_names: ClassVar[Mapping[str, Mapping[float, str]]] = {"mode": _impact.MODES}

    phi_min: Param[Scalar, "rad", unbounded] = -jnp.inf  # angle of the lower stop
    phi_max: Param[Scalar, "rad", unbounded] = jnp.inf  # angle of the upper stop
    restitution: Param[Scalar, "1", nonnegative] = 0.0  # ratio of the speeds after and before an impact, at most 1
    rest: Param[Scalar, "rad/s", nonnegative] = 1e-3  # rebound speed up to which the shaft comes to rest
    creep: Param[Scalar, "1/(kg.m2)", nonnegative] = 0.0  # acceleration per torque while at rest
    w: Var[Scalar, "rad/s", prefer] = 0.0  # speed
    acceleration: Var[Scalar, "rad/s2"] = 0.0
    tau: Var[Scalar, "N.m"] = 0.0  # contact torque into the stop; negative at the lower stop
    path: Var[Scalar, "N.m"] = 0.0  # tau while at rest, otherwise the value of the acceleration
    mode: Discrete[Scalar, "1"] = 0.0  # -1 resting at the lower stop, 0 free, 1 resting at the upper stop
    push_low: Discrete[Scalar, "N.m"] = 0.0  # torque of an impact at the lower stop; zero except at an impact
    push_high: Discrete[Scalar, "N.m"] = 0.0  # the same at the upper stop
    flange: Flange = Flange()

    def requirements(self) -> Requirements:
        return (
            require(self.phi_min < self.phi_max, "phi_min must be smaller than phi_max"),
            require(self.restitution <= 1.0, "restitution must be at most 1"),
        )

    def equations(self, d: Self) -> Equations:
        held = _impact.acceleration(
            self.mode, self.path, self.creep, place=self.flange.phi, speed=self.w, low=self.phi_min, high=self.phi_max
        )  # fmt: skip
        return dict(
            speed=eq(self.w, d.flange.phi),
            acceleration=eq(self.acceleration, d.w),
            held=eq(self.acceleration, held, check_units=False),
            contact=eq(self.tau, _impact.effort(self.mode, self.path, self.push_high - self.push_low)),
            torque=eq(self.flange.tau, self.tau),
        )

    def events(self) -> Events:
        return _impact.stops(
            self.mode, self.flange.phi, self.w, self.acceleration, self.path, self.phi_min, self.phi_max,
            e=self.restitution, slow=self.rest,
        )  # fmt: skip

    def energy(self) -> Energy:
        """Supplies the work that lifts a load from beyond a stop; impact losses are recorded with the events."""
        return Energy(supplied=-self.tau * self.w)


class ElastoBacklash(Compliant):
    """Backlash between elastic stops with damping (MSL `ElastoBacklash`).

    tau = c x + d w_rel with the deflection x = phi_rel - phi_rel0 -+ play/2 beyond the play, and x = 0 within it. The
    damping torque is limited to |c x|, so that the torque is continuous at contact and the stops do not pull. Contact
    and reaching this limit are events.
    """

    c: Param[Scalar, "N.m/rad", nonnegative]  # stiffness
    d: Param[Scalar, "N.m.s/rad", nonnegative]  # damping coefficient
    play: Param[Scalar, "rad", nonnegative]  # total play
    phi_rel0: Param[Scalar, "rad"] = 0.0  # relative angle in the middle of the play
    w_rel: Var[Scalar, "rad/s"] = 0.0  # relative speed

    def _beyond(self) -> Scalar:
        x, half = self.phi_rel - self.phi_rel0, 0.5 * self.play
        return x - limited(x, -half, half)

    def _most(self) -> Scalar:
        return absolute(self.c * self._beyond())

    def _damping(self) -> Scalar:
        most = self._most()
        return limited(self.d * self.w_rel, -most, most)

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(
            relative_speed=eq(self.w_rel, d.phi_rel),
            law=eq(self.tau, self.c * self._beyond() + self._damping()),
        )

    def energy(self) -> Energy:
        return Energy(stored=0.5 * self.c * self._beyond() ** 2, dissipated=self._damping() * self.w_rel)
