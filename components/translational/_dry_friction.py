"""Dry friction with true sticking (as in MSL): guides and brake. See `components/_stick_slip.py`."""

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
from .._friction_laws import stribeck, tustin
from .._tables import linear
from ..blocks import Input
from ._interfaces import Flange


class DryFriction(Component, partial=True):
    """Friction of a rod that slides with the speed v, or sticks, on the ground or on a guide with `support=Flange()`.

    A base class for custom friction laws: define `sliding`, and `breakaway` if it differs from `sliding(0)`. Sliding:
    f = sliding(|v|) sign(v). Stuck: a force |f| <= breakaway holds the rod; beyond that it breaks away. Both
    transitions are events, so that no step contains a kink and sticking is not creep. The modes are -1 (sliding
    backward), 0 (stuck), 1 (sliding forward) and 2 (free, or not yet known: the initial mode).

    The friction law does not determine how rigidly joined stuck pairs share their load; their `creep` does. It must be
    well above 1e-16 / m and well below 1 / m, where m is the mass that they hold.
    """

    mode_names: ClassVar[Mapping[str, Mapping[float, str]]] = {"mode": stick_slip.MODES}

    creep: Param[Scalar, "1/kg", nonnegative] = stick_slip.CREEP  # relative acceleration per force while stuck
    rest: Param[Scalar, "m/s", nonnegative] = stick_slip.REST  # relative speed that counts as rest
    v: Var[Scalar, "m/s", prefer] = 0.0  # relative speed
    acceleration: Var[Scalar, "m/s2"] = 0.0  # relative acceleration
    f: Var[Scalar, "N"] = 0.0  # friction force
    path: Var[Scalar, "N"] = 0.0  # path parameter: f while stuck, otherwise the value of the acceleration
    mode: Discrete[Scalar, "1"] = stick_slip.FREE
    moving: Discrete[Scalar, "1"] = 0.0  # 1 once it slides fast enough to stick again
    flange: Flange = Flange()
    support: Flange | None = None

    def sliding(self, speed: Scalar) -> Scalar:
        """Absolute sliding force at a positive speed; must continue smoothly a little below zero."""
        raise NotImplementedError

    def breakaway(self) -> Scalar:
        """Maximum force while stuck, at least `sliding(0)`."""
        return self.sliding(0.0)

    def pressed(self) -> Array | bool:
        """Whether the parts are pressed together."""
        return True

    def equations(self, d: Any) -> Equations:
        held = stick_slip.acceleration(self.mode, self.path, self.v, self.creep)
        laws = dict(
            acceleration=eq(self.acceleration, d.v),
            held=eq(self.acceleration, held, check_units=False),
            friction=eq(self.f, self._effort()),
            force=eq(self.flange.f, self.f),
        )
        if self.support is None:
            return laws | dict(speed=eq(self.v, d.flange.s))
        return laws | dict(
            speed=eq(self.v, d.flange.s - d.support.s),
            reaction=eq(self.support.f, -self.f),
        )

    def _effort(self) -> Scalar:
        return stick_slip.effort(self.mode, self.path, self.sliding(self._along()))

    def _along(self) -> Scalar:
        return stick_slip.along(self.mode, self.v)

    def events(self) -> Events:
        peak = self.breakaway()
        return stick_slip.changes(
            self.mode, self.moving, self.v, self.path,
            low=-peak, high=peak, rest=self.rest, creep=self.creep, pressed=self.pressed(),
        )  # fmt: skip

    def energy(self) -> Energy:
        return Energy(dissipated=self._effort() * self.v)


class SupportFriction(DryFriction):
    """Friction from a table of forces over speeds, f(|v|); break-away at peak f(0) (MSL `SupportFriction`).

    Linear interpolation between the samples, and linear extrapolation beyond the last one.
    """

    elsewhere: ClassVar[Mapping[str, str]] = {"f_pos": "speeds and forces"}

    speeds: Param[Vector, "m/s"]  # increasing, from 0
    forces: Param[Vector, "N"]  # forces at these speeds
    peak: Param[Scalar, "1", positive] = 1.0  # ratio of static to sliding force at rest, at least 1

    def requirements(self) -> Requirements:
        return (
            *sampled(self, "forces", "speeds"),
            require(self.speeds[0] == 0.0, "speeds must start at 0"),
            require(self.forces >= 0.0, "forces must be nonnegative"),
            require(self.peak >= 1.0, "peak must be at least 1"),
        )

    def sliding(self, speed: Scalar) -> Scalar:
        return linear(speed, self.speeds, self.forces)

    def breakaway(self) -> Scalar:
        return self.peak * self.forces[0]


class StribeckFriction(DryFriction):
    """Sliding force Fc + (Fs - Fc) exp(-(v/vs)^2) + C |v|, break-away at Fs (Bo, Pavelescu 1982).

    With `support=Flange()` it acts between two bodies, such as a block and the belt that carries it.
    `SmoothStribeckFriction` is the smooth counterpart, which creeps instead of sticking.
    """

    elsewhere: ClassVar[Mapping[str, str]] = {"v0": "a parameter of SmoothStribeckFriction"}

    Fc: Param[Scalar, "N", nonnegative]  # Coulomb (sliding) force
    Fs: Param[Scalar, "N", nonnegative]  # break-away force, at least Fc
    vs: Param[Scalar, "m/s", positive]  # Stribeck speed, at which the excess over Fc has dropped to 1/e
    C: Param[Scalar, "N.s/m", nonnegative] = 0.0  # viscous friction coefficient

    def requirements(self) -> Requirements:
        return (require(self.Fc <= self.Fs, "Fc must be at most Fs"),)

    def sliding(self, speed: Scalar) -> Scalar:
        return stribeck(speed, self.Fc, self.Fs, self.vs) + self.C * speed

    def breakaway(self) -> Scalar:
        return self.Fs


class TustinFriction(DryFriction):
    """Sliding force F_prop |v| + F_Coulomb + F_Stribeck exp(-fexp |v|), break-away at F_Coulomb + F_Stribeck.

    The law of Tustin (1947) and of MSL `MassWithStopAndFriction`. The peak decays over a speed of 1/fexp. If this speed
    is not well above the tolerance of the speed, integration errors make the part stick and break away repeatedly. Then
    give the speed of the mass a small nominal value, as in `nominal={"mass.v": 1e-6}`.
    """

    F_prop: Param[Scalar, "N.s/m", nonnegative]  # viscous friction coefficient
    F_Coulomb: Param[Scalar, "N", nonnegative]  # constant part
    F_Stribeck: Param[Scalar, "N", nonnegative]  # additional force at rest
    fexp: Param[Scalar, "s/m", nonnegative]  # decay constant of F_Stribeck over the speed

    def sliding(self, speed: Scalar) -> Scalar:
        return tustin(speed, self.F_prop, self.F_Coulomb, self.F_Stribeck, self.fexp, self.moving)


class Brake(DryFriction):
    """A brake pressed on by u fn_max: it slides at mu cgeo u fn_max and holds `peak` times that; u <= 0 releases it.

    As MSL `Brake`, on the ground or on a guide with `support=Flange()`.
    """

    elsewhere: ClassVar[Mapping[str, str]] = {"mue_pos": "mu, the same at all speeds", "f_normalized": "u"}

    mu: Param[Scalar, "1", nonnegative]  # sliding friction coefficient
    fn_max: Param[Scalar, "N", nonnegative]  # normal force at u = 1
    cgeo: Param[Scalar, "1", nonnegative] = 1.0  # number of friction surfaces
    peak: Param[Scalar, "1", positive] = 1.0  # ratio of static to sliding friction, at least 1
    u: Input = Input()

    def requirements(self) -> Requirements:
        return (require(self.peak >= 1.0, "peak must be at least 1"),)

    def pressed(self) -> Array | bool:
        return self.u.value > 0.0

    def sliding(self, speed: Scalar) -> Scalar:
        del speed
        return self.mu * self.cgeo * self.fn_max * self.u.value

    def breakaway(self) -> Scalar:
        return self.peak * self.sliding(0.0)

    def events(self) -> Events:
        return super().events() | stick_slip.lets_go(self.mode, self.u.value <= 0.0)
