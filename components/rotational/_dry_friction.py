"""Dry friction with true sticking (as in MSL), in bearings and couplings. See `components/_stick_slip.py`."""

from collections.abc import Mapping
from typing import Any, ClassVar

from jax import Array

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
    Vector,
    eq,
    nonnegative,
    positive,
    prefer,
    require,
)

from .. import _stick_slip as stick_slip
from .._checks import sampled
from .._friction_laws import stribeck
from .._tables import linear
from ._interfaces import Flange


class DryFriction(Component, partial=True):
    """Friction between two parts that slide on each other with the relative speed w, or stick.

    A base class for custom friction laws, usually through `ShaftFriction` or `CouplingFriction`: define `sliding`, and
    `breakaway` if it differs from `sliding(0)`. Sliding: tau = sliding(|w|) sign(w). Stuck: a torque |tau| <= breakaway
    holds the parts together; beyond that they break away. Both transitions are events, so that no step contains a kink
    and sticking is not creep. The modes are -1 (sliding backward), 0 (stuck), 1 (sliding forward) and 2 (free, or not
    yet known: the initial mode).

    The friction law does not determine how rigidly joined stuck pairs share their load; their `creep` does. It must be
    well above 1e-16 / J and well below 1 / J, where J is the moment of inertia that they hold.
    """

    mode_names: ClassVar[Mapping[str, Mapping[float, str]]] = {"mode": stick_slip.MODES}

    creep: Param[Scalar, "1/(kg.m2)", nonnegative] = stick_slip.CREEP  # relative acceleration per torque while stuck
    rest: Param[Scalar, "rad/s", nonnegative] = stick_slip.REST  # relative speed that counts as rest
    w: Var[Scalar, "rad/s", prefer] = 0.0  # relative speed
    acceleration: Var[Scalar, "rad/s2"] = 0.0  # relative acceleration
    tau: Var[Scalar, "N.m"] = 0.0  # friction torque
    path: Var[Scalar, "N.m"] = 0.0  # path parameter: tau while stuck, otherwise the value of the acceleration
    mode: Discrete[Scalar, "1"] = stick_slip.FREE
    moving: Discrete[Scalar, "1"] = 0.0  # 1 once it slides fast enough to stick again

    def sliding(self, speed: Scalar) -> Scalar:
        """Absolute sliding torque at a positive speed; must continue smoothly a little below zero."""
        raise NotImplementedError

    def breakaway(self) -> Scalar:
        """Maximum torque while stuck, at least `sliding(0)`."""
        return self.sliding(0.0)

    def pressed(self) -> Array | bool:
        """Whether the parts are pressed together."""
        return True

    def equations(self, d: Any) -> Equations:
        held = stick_slip.acceleration(self.mode, self.path, self.w, self.creep)
        return dict(
            acceleration=eq(self.acceleration, d.w),
            held=eq(self.acceleration, held, check_units=False),
            friction=eq(self.tau, self._effort()),
        )

    def _effort(self) -> Scalar:
        return stick_slip.effort(self.mode, self.path, self.sliding(self._along()))

    def _along(self) -> Scalar:
        return stick_slip.along(self.mode, self.w)

    def events(self) -> Events:
        peak = self.breakaway()
        return stick_slip.changes(
            self.mode, self.moving, self.w, self.path,
            low=-peak, high=peak, rest=self.rest, creep=self.creep, pressed=self.pressed(),
        )  # fmt: skip

    def energy(self) -> Energy:
        return Energy(dissipated=self._effort() * self.w)


class ShaftFriction(DryFriction, partial=True):
    """Friction between a shaft and the ground, or a housing with `support=Flange()`."""

    flange: Flange = Flange()
    support: Flange | None = None

    def equations(self, d: Any) -> Equations:
        torque = dict(torque=eq(self.flange.tau, self.tau))
        if self.support is None:
            return super().equations(d) | torque | dict(speed=eq(self.w, d.flange.phi))
        return (
            super().equations(d)
            | torque
            | dict(
                speed=eq(self.w, d.flange.phi - d.support.phi),
                reaction=eq(self.support.tau, -self.tau),
            )
        )


class BearingFriction(ShaftFriction):
    """Friction from a table of torques over speeds, tau(|w|); break-away at peak tau(0) (MSL `BearingFriction`).

    Linear interpolation between the samples, and linear extrapolation beyond the last one.
    """

    elsewhere: ClassVar[Mapping[str, str]] = {"tau_pos": "speeds and torques"}

    speeds: Param[Vector, "rad/s"]  # increasing, from 0
    torques: Param[Vector, "N.m"]  # torques at these speeds
    peak: Param[Scalar, "1", positive] = 1.0  # ratio of static to sliding torque at rest, at least 1

    def requirements(self) -> Requirements:
        return (
            *sampled(self, "torques", "speeds"),
            require(self.speeds[0] == 0.0, "speeds must start at 0"),
            require(self.torques >= 0.0, "torques must be nonnegative"),
            require(self.peak >= 1.0, "peak must be at least 1"),
        )

    def sliding(self, speed: Scalar) -> Scalar:
        return linear(speed, self.speeds, self.torques)

    def breakaway(self) -> Scalar:
        return self.peak * self.torques[0]


class StribeckFriction(ShaftFriction):
    """Sliding torque Tc + (Ts - Tc) exp(-(w/ws)^2) + C |w|, break-away at Ts (Bo, Pavelescu 1982).

    `SmoothStribeckFriction` is the smooth counterpart, which creeps instead of sticking.
    """

    elsewhere: ClassVar[Mapping[str, str]] = {"w0": "a parameter of SmoothStribeckFriction"}

    Tc: Param[Scalar, "N.m", nonnegative]  # Coulomb (sliding) torque
    Ts: Param[Scalar, "N.m", nonnegative]  # break-away torque, at least Tc
    ws: Param[Scalar, "rad/s", positive]  # Stribeck speed, at which the excess over Tc has dropped to 1/e
    C: Param[Scalar, "N.m.s/rad", nonnegative] = 0.0  # viscous friction coefficient

    def requirements(self) -> Requirements:
        return (require(self.Tc <= self.Ts, "Tc must be at most Ts"),)

    def sliding(self, speed: Scalar) -> Scalar:
        return stribeck(speed, self.Tc, self.Ts, self.ws) + self.C * speed

    def breakaway(self) -> Scalar:
        return self.Ts


class CouplingFriction(DryFriction, partial=True):
    """Friction between two shafts: phi_rel = phi_b - phi_a, tau = tau_b = -tau_a."""

    phi_rel: Var[Scalar, "rad"] = 0.0  # relative angle
    a: Flange = Flange()
    b: Flange = Flange()

    def equations(self, d: Any) -> Equations:
        return super().equations(d) | dict(
            relative_angle=eq(self.phi_rel, self.b.phi - self.a.phi),
            speed=eq(self.w, d.phi_rel),
            torque_a=eq(self.a.tau, -self.tau),
            torque_b=eq(self.b.tau, self.tau),
        )
