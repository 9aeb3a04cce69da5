"""The cost of events: of those that never happen, and of each that does."""

from pathlib import Path
from typing import Any, Self

import jax

from acausal import Component, Discrete, Equations, Events, Param, Scalar, Time, Var, eq, simulate, when
from studies.actuators import ElectromechanicalActuator, ema_maxon

from ._effort import Effort
from ._rows import Row, compared
from ._timing import fastest
from .chain import ChainOfArrays, chain_of_arrays

LIMIT = 1.3
T1 = 0.08
FEW, MANY = 1_000, 10_000
LENGTH = 12  # of the chain


class Watched(Component, partial=True):
    """A model with three conditions that are never met: on time, on a state and on a force or torque."""

    t: Time[Scalar, "s"] = 0.0
    alarms: Discrete[Scalar, "1"] = 0.0

    def seen(self) -> tuple[Scalar, Scalar]:
        """The state and the force."""
        raise NotImplementedError

    def events(self) -> Events:
        state, force = self.seen()
        return dict(
            late=when(self.t > 1e3, alarms=1.0),
            far=when(state > 1e6, alarms=2.0),
            strained=when(force > 1e9, alarms=3.0),
        )


class WatchedActuator(Watched):
    """An actuator, whose rod is watched."""

    actuator: ElectromechanicalActuator

    def seen(self) -> tuple[Scalar, Scalar]:
        return self.actuator.slave.rod.s, self.actuator.slave.rod.f


class WatchedChain(Watched):
    """A chain of inertias, whose first ones are watched."""

    chain: ChainOfArrays

    def seen(self) -> tuple[Scalar, Scalar]:
        return self.chain.masses[0].w, self.chain.springs[0].tau


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
    watched = WatchedActuator(actuator=bare)
    chain = chain_of_arrays(LENGTH, speed=1.0)
    watched_chain = WatchedChain(chain=chain)
    runs = {
        "bare": jax.jit(lambda: simulate(bare, T1, save="end").final.slave.rod.s),
        "watched": jax.jit(lambda: simulate(watched, T1, save="end").final.actuator.slave.rod.s),
        "chain": jax.jit(lambda: simulate(chain, 10.0, save="end").final.masses[0].w),
        "watched chain": jax.jit(lambda: simulate(watched_chain, 10.0, save="end").final.chain.masses[0].w),
        "few": _bouncing(FEW),
        "many": _bouncing(MANY),
    }
    times = fastest({name: lambda f=f: f() for name, f in runs.items()}, effort.repeats)
    per_event = {name: times[name] / n * 1e6 for name, n in (("few", FEW), ("many", MANY))}
    return [
        _never_met("actuator of 5 states", times["watched"], times["bare"]),
        _never_met(f"chain of {2 * LENGTH} states", times["watched chain"], times["chain"]),
        compared(f"events: each of {MANY}", per_event["many"], "us", per_event["few"], f"each of {FEW}", LIMIT),
    ]


def _never_met(name: str, watched: float, bare: float) -> Row:
    return compared(f"events: never met, {name}", watched * 1e3, "ms", bare * 1e3, "without them", LIMIT)


def _bouncing(n: int) -> Any:
    """A run with n impacts."""
    interval = 2.0 * (2.0 / 9.81) ** 0.5
    return jax.jit(lambda: simulate(Ball(), n * interval, save="end", max_steps=16 * MANY).final.h)
