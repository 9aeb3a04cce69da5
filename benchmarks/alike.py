"""Many components alike: the time to the first result, beside that of a few."""

import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple, Self

import jax

from acausal import (
    Array,
    Component,
    Connections,
    Equations,
    Param,
    Scalar,
    Var,
    connect,
    eq,
    simulate,
    stack,
    structure,
)
from components.rotational import ConstantTorque, IdealGear, Inertia

from ._effort import Effort
from ._rows import Row, compared

FEW = 5
LIMIT = 1.5


class Pair(Component):
    """Two inertias coupled by a gear, so that they share one degree of freedom; its equations are differentiated."""

    drive: ConstantTorque
    first: Inertia
    gear: IdealGear
    second: Inertia

    def connections(self) -> Connections:
        return (
            connect(self.drive.flange, self.first.a),
            connect(self.first.b, self.gear.a),
            connect(self.gear.b, self.second.a),
        )


class Pendulum(Component):
    """A point mass on a rod in Cartesian coordinates, which has no states that are good in every position."""

    length: Param[Scalar, "m"]
    x: Var[Scalar, "m"] = 0.0
    y: Var[Scalar, "m"] = 0.0
    u: Var[Scalar, "m/s"] = 0.0
    v: Var[Scalar, "m/s"] = 0.0
    pull: Var[Scalar, "1/s2"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(
            across=eq(self.u, d.x),
            upward=eq(self.v, d.y),
            horizontal=eq(d.u, -self.pull * self.x),
            vertical=eq(d.v, -self.pull * self.y - 9.81, check_units=False),
            rod=eq(self.x**2 + self.y**2, self.length**2),
        )


class Together(Component):
    """Components side by side, without connections."""

    parts: Array[Pair] | Array[Pendulum] | tuple[Pair, ...] | tuple[Pendulum, ...]


def run(effort: Effort, out: Path | None = None) -> list[Row]:
    """Arrays and tuples of both, `effort.alike` against a few of them."""
    del out
    makers: dict[str, Callable[[int], Any]] = {"gear pairs": _pair, "pendulums": _pendulum}
    ways: dict[str, Callable[[Sequence[Any]], Any]] = {"array": stack, "single parts": tuple}
    rows = []
    for what, make in makers.items():
        for way, gather in ways.items():
            _measured(Together(parts=gather([make(0)])))  # what is compiled once for all models
            few, many = (_measured(Together(parts=gather([make(i) for i in range(n)]))) for n in (FEW, effort.alike))
            name, against = f"{effort.alike} {what}, {way}", f"{FEW} of them"
            rows += [
                compared(f"{name}: structure", many.structure, "s", few.structure, against),
                compared(f"{name}: compile", many.compile, "s", few.compile, against, LIMIT),
            ]
    return rows


class Times(NamedTuple):
    """Seconds of the structural passes, and of tracing and compiling."""

    structure: float
    compile: float


def _pair(number: int) -> Pair:
    return Pair(
        drive=ConstantTorque(torque=1.0), first=Inertia(J=1.0), gear=IdealGear(ratio=2.0 + 1e-3 * number),
        second=Inertia(J=2.0),
    )  # fmt: skip


def _pendulum(number: int) -> Pendulum:
    length = 1.0 + 1e-3 * number
    return Pendulum(length=length, x=length, y=0.0)


def _measured(model: Component) -> Times:
    passes = _seconds(lambda: structure(model))
    first, again = (_seconds(lambda: simulate(model, 1e-2, save="end", max_steps=200).t1) for _ in range(2))
    return Times(passes, first - again)


def _seconds(function: Callable[[], Any]) -> float:
    start = time.perf_counter()
    jax.block_until_ready(function())
    return time.perf_counter() - start
