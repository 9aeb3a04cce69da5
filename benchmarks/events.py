"""What events cost: those that never happen, and each one that does."""

from pathlib import Path
from typing import Any, Self

import jax

from acausal import Component, Discrete, Equations, Events, Param, Scalar, Time, Var, eq, simulate, when
from studies.actuators import ElectromechanicalActuator, ema_maxon

from ._effort import Effort
from ._rows import Row, compared
from ._timing import fastest

LIMIT = 1.3
T1 = 0.08
FEW, MANY = 1_000, 10_000


class Watched(Component):
    """An actuator with three conditions that are never met: on time, on a state and on a force."""

    t: Time[Scalar, "s"] = 0.0
    alarms: Discrete[Scalar, "1"] = 0.0
    actuator: ElectromechanicalActuator

    def events(self) -> Events:
        rod = self.actuator.slave.rod
        return dict(
            late=when(self.t > 1e3, alarms=1.0),
            far=when(rod.s > 1.0, alarms=2.0),
            strained=when(rod.f > 1e9, alarms=3.0),
        )


class Ball(Component):
    """A ball that rebounds without loss, at equal intervals of 2 sqrt(2 h / g)."""

    g: Param[Scalar, "m/s2"] = 9.81
    h: Var[Scalar, "m"] = 1.0
    v: Var[Scalar, "m/s"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(speed=eq(d.h, self.v), fall=eq(d.v, -self.g))

    def events(self) -> Events:
        return dict(impact=when(self.h < 0.0, v=-self.v))


def run(effort: Effort, out: Path | None = None) -> list[Row]:
    """The same run with and without conditions to watch; runs with more and fewer impacts."""
    bare = ema_maxon()
    watched = Watched(actuator=bare)
    runs = {
        "bare": jax.jit(lambda: simulate(bare, T1, save="end").final.slave.rod.s),
        "watched": jax.jit(lambda: simulate(watched, T1, save="end").final.actuator.slave.rod.s),
        "few": _bouncing(FEW),
        "many": _bouncing(MANY),
    }
    times = fastest({name: lambda f=f: f() for name, f in runs.items()}, effort.repeats)
    per_event = {name: times[name] / n * 1e6 for name, n in (("few", FEW), ("many", MANY))}
    return [
        compared("events: never met", times["watched"] * 1e3, "ms", times["bare"] * 1e3, "without them", LIMIT),
        compared(f"events: each of {MANY}", per_event["many"], "us", per_event["few"], f"each of {FEW}", LIMIT),
    ]


def _bouncing(n: int) -> Any:
    """A run with n impacts."""
    interval = 2.0 * (2.0 / 9.81) ** 0.5
    return jax.jit(lambda: simulate(Ball(), n * interval, save="end", max_steps=16 * MANY).final.h)
