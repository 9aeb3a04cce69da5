"""Rigid stops, and a mass that moves between them."""

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
    positive,
    prefer,
    require,
    unbounded,
)

from .. import _impact
from .. import _stick_slip as stick_slip
from .._friction_laws import tustin
from ._interfaces import Flange


class HardStop(Component):
    """Rigid stops on the ground that keep a rod within s_min <= s <= s_max, with Newton's law of impact.

    At a stop the speed changes from v to -restitution v. If the rebound is no faster than `rest`, the rod rests at the
    stop, held by the contact force f, until it is pulled away. This ends the infinitely many jumps of a ball after a
    finite number. The stops only push. Impacts and lift-off are events. The rod must have a mass. The impulse changes
    the speeds of the whole model by its inertias, also through levers and gears with several degrees of freedom. Other
    contacts that are closed or struck at the same instant share it, and friction that sticks lets go: see
    `acausal.impact`.

    A start beyond a stop is not refused. A rod that is pressed outwards there returns slowly, with many events.

    If a stop and dry friction hold the rod together, the stop carries the load because it does not creep. If two stops
    hold it, give one of them a `creep` of 1e-10 / kg.
    """

    mode_names: ClassVar[Mapping[str, Mapping[float, str]]] = {"mode": _impact.MODES}

    s_min: Param[Scalar, "m", unbounded] = -jnp.inf  # position of the lower stop
    s_max: Param[Scalar, "m", unbounded] = jnp.inf  # position of the upper stop
    restitution: Param[Scalar, "1", nonnegative] = 0.0  # ratio of the speeds after and before an impact, at most 1
    rest: Param[Scalar, "m/s", nonnegative] = 1e-3  # rebound speed up to which the rod comes to rest
    creep: Param[Scalar, "1/kg", nonnegative] = 0.0  # acceleration per force while at rest
    v: Var[Scalar, "m/s", prefer] = 0.0  # speed
    acceleration: Var[Scalar, "m/s2"] = 0.0
    f: Var[Scalar, "N"] = 0.0  # contact force into the stop; negative at the lower stop
    path: Var[Scalar, "N"] = 0.0  # f while at rest, otherwise the value of the acceleration
    mode: Discrete[Scalar, "1"] = 0.0  # -1 resting at the lower stop, 0 free, 1 resting at the upper stop
    push_low: Discrete[Scalar, "N"] = 0.0  # force of an impact at the lower stop; zero except at an impact
    push_high: Discrete[Scalar, "N"] = 0.0  # the same at the upper stop
    flange: Flange = Flange()

    def requirements(self) -> Requirements:
        return (
            require(self.s_min < self.s_max, "s_min must be smaller than s_max"),
            require(self.restitution <= 1.0, "restitution must be at most 1"),
        )

    def equations(self, d: Self) -> Equations:
        held = _impact.acceleration(
            self.mode, self.path, self.creep, place=self.flange.s, speed=self.v, low=self.s_min, high=self.s_max
        )  # fmt: skip
        return dict(
            speed=eq(self.v, d.flange.s),
            acceleration=eq(self.acceleration, d.v),
            held=eq(self.acceleration, held, check_units=False),
            contact=eq(self.f, _impact.effort(self.mode, self.path, self.push_high - self.push_low)),
            force=eq(self.flange.f, self.f),
        )

    def events(self) -> Events:
        return _impact.stops(
            self.mode, self.flange.s, self.v, self.acceleration, self.path, self.s_min, self.s_max,
            e=self.restitution, slow=self.rest,
        )  # fmt: skip

    def energy(self) -> Energy:
        """Supplies the work that lifts a load from beyond a stop; impact losses are recorded with the events."""
        return Energy(supplied=-self.f * self.v)


class MassWithStopAndFriction(Component):
    """A sliding mass of length L with friction, between rigid stops (MSL `MassWithStopAndFriction`).

    m dv/dt = f_a + f_b - f - contact, with s_a = s - L/2 >= s_min and s_b = s + L/2 <= s_max. The friction f is
    F_prop v + sign(v) [F_Coulomb + F_Stribeck exp(-fexp |v|)] while sliding, and at most F_Coulomb + F_Stribeck while
    stuck. For the law of the stops see `HardStop`; MSL has a restitution of 0, which is the default here.
    """

    mode_names: ClassVar[Mapping[str, Mapping[float, str]]] = {"mode": stick_slip.MODES, "stopped": _impact.MODES}

    m: Param[Scalar, "kg", positive]  # mass
    s_min: Param[Scalar, "m", unbounded]  # position of the lower stop
    s_max: Param[Scalar, "m", unbounded]  # position of the upper stop, beyond s_min + L
    L: Param[Scalar, "m", nonnegative] = 0.0  # length from a to b
    F_prop: Param[Scalar, "N.s/m", nonnegative] = 0.0  # viscous friction coefficient
    F_Coulomb: Param[Scalar, "N", nonnegative] = 0.0  # constant part of the friction
    F_Stribeck: Param[Scalar, "N", nonnegative] = 0.0  # additional friction at rest
    fexp: Param[Scalar, "s/m", nonnegative] = 0.0  # decay constant of F_Stribeck over the speed
    restitution: Param[Scalar, "1", nonnegative] = 0.0  # ratio of the speeds after and before an impact, at most 1
    rest_at_stop: Param[Scalar, "m/s", nonnegative] = 1e-3  # rebound speed up to which the mass comes to rest
    creep: Param[Scalar, "1/kg", nonnegative] = stick_slip.CREEP  # acceleration per force while stuck
    rest: Param[Scalar, "m/s", nonnegative] = stick_slip.REST  # speed that counts as rest
    s: Var[Scalar, "m", prefer] = 0.0  # position of the centre
    v: Var[Scalar, "m/s", prefer] = 0.0  # speed
    acceleration: Var[Scalar, "m/s2"] = 0.0
    f: Var[Scalar, "N"] = 0.0  # friction force
    contact: Var[Scalar, "N"] = 0.0  # contact force into the stops; negative at the lower stop
    path: Var[Scalar, "N"] = 0.0  # path parameter: f while stuck, otherwise the value of the acceleration
    path_at_stop: Var[Scalar, "N"] = 0.0  # path parameter: contact while at a stop, otherwise the acceleration
    mode: Discrete[Scalar, "1"] = stick_slip.FREE  # mode of the friction, see `DryFriction`
    moving: Discrete[Scalar, "1"] = 0.0  # 1 once it slides fast enough to stick again
    stopped: Discrete[Scalar, "1"] = 0.0  # -1 resting at the lower stop, 0 free, 1 resting at the upper stop
    push_low: Discrete[Scalar, "N"] = 0.0  # force of an impact at the lower stop; zero except at an impact
    push_high: Discrete[Scalar, "N"] = 0.0  # the same at the upper stop
    a: Flange = Flange()
    b: Flange = Flange()

    def requirements(self) -> Requirements:
        return (
            require(self.s_min + self.L < self.s_max, "s_max must be above s_min + L"),
            require(self.restitution <= 1.0, "restitution must be at most 1"),
        )

    def equations(self, d: Self) -> Equations:
        stuck = stick_slip.acceleration(self.mode, self.path, self.v, self.creep)
        return dict(
            back=eq(self.a.s, self.s - 0.5 * self.L),
            front=eq(self.b.s, self.s + 0.5 * self.L),
            speed=eq(self.v, d.s),
            acceleration=eq(self.acceleration, d.v),
            newton=eq(self.m * self.acceleration, self.a.f + self.b.f - self.f - self.contact),
            stuck=eq(self.acceleration, stuck, check_units=False),
            friction=eq(self.f, self._friction()),
            stopped=eq(self.acceleration, self._stopped(), check_units=False),
            contact=eq(self.contact, _impact.effort(self.stopped, self.path_at_stop, self.push_high - self.push_low)),
        )

    def _stopped(self) -> Scalar:
        half = 0.5 * self.L
        low, high = self.s_min + half, self.s_max - half
        return _impact.acceleration(
            self.stopped, self.path_at_stop, 0.0, place=self.s, speed=self.v, low=low, high=high
        )

    def _sliding(self, speed: Scalar) -> Scalar:
        return tustin(speed, self.F_prop, self.F_Coulomb, self.F_Stribeck, self.fexp, self.moving)

    def _friction(self) -> Scalar:
        return stick_slip.effort(self.mode, self.path, self._sliding(stick_slip.along(self.mode, self.v)))

    def events(self) -> Events:
        peak, half = self.F_Coulomb + self.F_Stribeck, 0.5 * self.L
        return stick_slip.changes(
            self.mode, self.moving, self.v, self.path, low=-peak, high=peak, rest=self.rest, creep=self.creep
        ) | _impact.stops(
            self.stopped, self.s, self.v, self.acceleration, self.path_at_stop, self.s_min + half, self.s_max - half,
            e=self.restitution, slow=self.rest_at_stop, mode_name="stopped",
        )  # fmt: skip

    def energy(self) -> Energy:
        """Dissipation by friction, and the work of the stops as in `HardStop`."""
        kinetic = 0.5 * self.m * self.v**2
        return Energy(stored=kinetic, dissipated=self._friction() * self.v, supplied=-self.contact * self.v)
