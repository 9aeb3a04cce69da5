"""Dry friction of plates pressed together or released by a signal: brakes, clutch, freewheel."""

from collections.abc import Mapping
from typing import Any, ClassVar

import jax.numpy as jnp
from jax import Array

from acausal import Events, Param, Requirements, Scalar, nonnegative, positive, refuse, require

from .. import _stick_slip as stick_slip
from .._limit import positive_part
from ..blocks import Input
from ._dry_friction import CouplingFriction, DryFriction, ShaftFriction


class Pressed(DryFriction, partial=True):
    """Plates pressed together by u fn_max: they slide at mu cgeo u fn_max and hold `peak` times that; u <= 0 opens."""

    elsewhere: ClassVar[Mapping[str, str]] = {"mue_pos": "mu, the same at all speeds", "f_normalized": "u"}

    mu: Param[Scalar, "1", nonnegative]  # sliding friction coefficient
    fn_max: Param[Scalar, "N", nonnegative]  # normal force at u = 1
    cgeo: Param[Scalar, "m", nonnegative] = 1.0  # number of friction surfaces times their mean radius
    peak: Param[Scalar, "1", positive] = 1.0  # ratio of static to sliding friction, at least 1
    u: Input = Input()

    def requirements(self) -> Requirements:
        return (require(self.peak >= 1.0, "peak must be at least 1"),)

    def pressed(self) -> Array | bool:
        return self.u.value > 0.0

    def normal(self) -> Scalar:
        """Normal force as a fraction of fn_max."""
        return self.u.value

    def sliding(self, speed: Scalar) -> Scalar:
        del speed
        return self.mu * self.cgeo * self.fn_max * self.normal()

    def breakaway(self) -> Scalar:
        return self.peak * self.sliding(0.0)

    def events(self) -> Events:
        return super().events() | stick_slip.lets_go(self.mode, self.u.value <= 0.0)


class Brake(Pressed, ShaftFriction):
    """A brake between a shaft and the ground, or a housing with `support=Flange()` (MSL `Brake`). See `Pressed`."""


class SpringAppliedBrake(ShaftFriction):
    """A brake closed by springs and released by a signal, as on hoists: sliding torque (1 - u), open at u >= 1.

    At rest it holds `peak` times the sliding torque. A magnet or a cylinder lifts the plates against the springs, so
    that without voltage or pressure the brake is closed (VDI 2241). For a hydraulic release, u is the pressure over the
    one that opens the brake, from a `PressureSensor` and a `Gain`. For the delay of a magnet, put a `FirstOrder` in
    between. A signal below 0 counts as 0, because a release never adds to the springs. The brake reacts on the ground,
    or on a housing with `support=Flange()`.
    """

    torque: Param[Scalar, "N.m", nonnegative]  # sliding torque of the closed brake
    peak: Param[Scalar, "1", positive] = 1.0  # ratio of static to sliding friction, at least 1
    u: Input = Input()  # release: 0 closed, 1 open

    def requirements(self) -> Requirements:
        return (require(self.peak >= 1.0, "peak must be at least 1"),)

    def pressed(self) -> Array | bool:
        return self.u.value < 1.0

    def sliding(self, speed: Scalar) -> Scalar:
        del speed
        return self.torque * (1.0 - positive_part(self.u.value))

    def breakaway(self) -> Scalar:
        return self.peak * self.sliding(0.0)

    def events(self) -> Events:
        return super().events() | stick_slip.lets_go(self.mode, self.u.value >= 1.0)


class Clutch(Pressed, CouplingFriction):
    """A friction clutch between two shafts (MSL `Clutch`). See `Pressed` for the law."""


class OneWayClutch(Pressed, CouplingFriction):
    """A freewheel with a friction clutch in parallel (MSL `OneWayClutch`): b can overrun a, w >= 0, but not vice versa.

    While stuck, it holds any negative torque, and a positive torque up to the static level, which is zero for a
    freewheel that is not pressed. It never opens. If it would have to stop a reverse motion instantly, at the start or
    after an impact, the run ends with an error, because it cannot share an impulse.
    """

    def pressed(self) -> Array | bool:
        return True

    def normal(self) -> Scalar:
        return positive_part(self.u.value)

    def events(self) -> Events:
        locked = ("backward", "tear", "release")
        events = {name: event for name, event in super().events().items() if name not in locked}
        against = self.w < -stick_slip.NOISE * jnp.maximum(self.rest, stick_slip.REST)
        return {name: _never_backward(event) for name, event in events.items()} | dict(
            against=refuse(against, "a freewheel turns in reverse. Start it with w_b >= w_a.")
        )


def _never_backward(event: Any) -> Any:
    changes = {name: jnp.maximum(value, 0.0) if name == "mode" else value for name, value in event.changes.items()}
    return event._replace(changes=changes)
