"""The results of runs with events do not depend on the constants by which events are found and told apart."""

import ast
import functools as ft
import importlib
import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Any, Self

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from acausal import (
    Component,
    Connections,
    Discrete,
    Equations,
    Events,
    Param,
    Scalar,
    Var,
    at,
    connect,
    eq,
    ifelse,
    segment,
    simulate,
    when,
)
from acausal._integrate import run as compiled
from acausal._integrate.events import crossing, event_time, extrema, rounds, run_events
from acausal._integrate.loop import loop
from acausal._integrate.setup import schedule, settings
from acausal._reduce.jaxpr import slice_outputs
from components import blocks, electrical

CONSTANTS = {
    "PARTS": [crossing],
    "TURN": [crossing, extrema],
    "MOST": [crossing, extrema],
    "TOGETHER": [rounds],
    "RESOLUTION": [run_events],
    "EARLY": [loop],
    "COUNTABLE": [schedule],
    "SLACK": [crossing, extrema],
    "CLOSE": [extrema],
    "FIRST": [extrema],
}
DERIVATIVE = {"STILL": event_time}  # of event times
ROOM = dict.fromkeys(("AT_ONCE", "STEPS", "MOMENTS", "ROOM"), settings)  # of records
ORDERS = {"NODES", "EVALUATIONS", "DERIVATIVES"}  # whole numbers of a method
FILES = {
    "_integrate.setup": "schedule settings",
    "_integrate.step": "correction interval",
    "_integrate.events": "changes crossing event_history event_numbers event_time extrema iteration rounds run_events",
    "_integrate.loop": "carry loop loop_start peaks",
    "_integrate.results": "event_log",
    "_evaluate": "equation_instants event_set events",
    "_reduce": "angles event_indicators jaxpr_instants jumps traced",
    "_declare": "ifelse",
}


def numbers_of(module: str) -> set[str]:
    """The numbers that a module names in capitals, by themselves."""
    loaded = importlib.import_module(f"acausal.{module}")
    tree = ast.parse(Path(str(loaded.__file__)).read_text())
    names = [
        node.targets[0].id
        for node in tree.body
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name)
    ]
    return {name for name in names if isinstance(getattr(loaded, name), int | float) and not name.startswith("_")}


def test_these_are_all_constants() -> None:
    found = {
        name for folder, files in FILES.items() for file in files.split() for name in numbers_of(f"{folder}.{file}")
    }
    assert found - {"TINY"} == {*CONSTANTS, *DERIVATIVE, *ROOM, *ORDERS}


class Ball(Component):
    """It rebounds from the floor, and turns."""

    e: Param[Scalar, "1"]
    h: Var[Scalar, "m"] = 1.0
    v: Var[Scalar, "m/s"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(speed=eq(d.h, self.v), fall=eq(d.v, -9.81, check_units=False))

    def events(self) -> Events:
        return dict(impact=when(self.h < 0.0, v=-self.e * self.v))


def impacts(e: Any) -> Any:
    """Times of impacts, the height at the end, and the largest speed downwards."""
    run = simulate(Ball(e=e), 2.5, save="end", rtol=1e-10, peaks=lambda s: -s.v)
    return jnp.stack([*run.events.times[:4], run.final.h, *run.peaks])


def ball() -> Any:
    return impacts(0.8)


class Slider(Component):
    """A mass on a belt, held by a spring: it sticks and slips by a table of friction."""

    x: Var[Scalar, "1"] = 0.0
    v: Var[Scalar, "1"] = 0.0

    def equations(self, d: Self) -> Equations:
        slip = 0.5 - self.v
        friction = ifelse(slip > 0.01, 1.0, ifelse(slip < -0.01, -1.0, 100.0 * slip))
        drag = ifelse(self.x > 0.8, 0.2, 0.0) * self.v
        rates = dict(x=(d.x, self.v), v=(d.v, friction - drag - self.x))
        return {name: eq(left, right, check_units=False) for name, (left, right) in rates.items()}


def slider() -> Any:
    run = simulate(Slider(x=0.0), 12.0, save="end", rtol=1e-9, peaks=lambda s: s.x)
    return run.final.x, run.final.v, run.peaks


class Rectifier(Component):
    """It charges a capacitor beside a resistor."""

    sine: blocks.Sine
    source: electrical.SignalVoltage
    diode: electrical.IdealDiode
    resistor: electrical.Resistor
    capacitor: electrical.Capacitor
    ground: electrical.Ground = electrical.Ground()

    def connections(self) -> Connections:
        return (
            connect(self.sine.y, self.source.u),
            connect(self.source.p, self.diode.p),
            connect(self.diode.n, self.resistor.p, self.capacitor.p),
            connect(self.source.n, self.resistor.n, self.capacitor.n, self.ground.p),
        )


def rectifier() -> Any:
    model = Rectifier(
        sine=blocks.Sine(amplitude=10.0, frequency=50.0),
        source=electrical.SignalVoltage(),
        diode=electrical.IdealDiode(Ron=0.1),
        resistor=electrical.Resistor(R=10.0),
        capacitor=electrical.Capacitor(C=1e-3),
    )
    run = simulate(model, 0.05, save="end", rtol=1e-9)
    return run.final.capacitor.v, run.events.times[:5]


class Sampled(Component):
    """A sampled controller with a limit, which watches an angle that turns fast."""

    x: Var[Scalar, "1"] = 1.0
    angle: Var[Scalar, "rad"] = 0.0
    u: Discrete[Scalar, "1"] = 0.0
    turns: Discrete[Scalar, "1"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(x=eq(d.x, self.u, check_units=False), angle=eq(d.angle, 7.0, check_units=False))

    def events(self) -> Events:
        return dict(
            tick=at(-0.25, every=0.1, u=jnp.clip(-3.0 * self.x, -2.0, 2.0)),
            turned=when(jnp.sin(self.angle) > 0.999, turns=self.turns + 1.0),
        )


def sampled() -> Any:
    run = simulate(Sampled(), 3.03, save="end", rtol=1e-9)
    return run.final.x, run.final.turns, run.events.times[:4]  # the clock is not in the log


class Tables(Component):
    """A mass on a spring by a table."""

    x: Var[Scalar, "1"] = 1.5
    v: Var[Scalar, "1"] = 0.0

    def equations(self, d: Self) -> Equations:
        knots, pulls = jnp.array([-2.0, -1.0, 0.0, 1.0, 2.0]), jnp.array([-9.0, -2.0, 0.0, 1.0, 5.0])
        i = jnp.clip(segment(self.x, knots), 1, 4)
        pull = pulls[i - 1] + (pulls[i] - pulls[i - 1]) * (self.x - knots[i - 1])
        rates = dict(x=(d.x, self.v), v=(d.v, -pull - 0.1 * self.v))
        return {name: eq(left, right, check_units=False) for name, (left, right) in rates.items()}


def tables() -> Any:
    run = simulate(
        Tables(), 10.0, save="end", rtol=1e-9, until=lambda s: s.v - 0.9, direction="up", peaks=lambda s: s.x
    )
    return run.t1, run.final.x, run.peaks


MODELS: list[Callable[[], Any]] = [ball, slider, rectifier, sampled, tables]


@ft.cache
def scaled(model: Callable[[], Any]) -> Any:
    """The results of a model as a program of factors, one for each constant, and the constants that it reads."""

    def results(*factors: Any) -> Any:
        with pytest.MonkeyPatch.context() as patch:
            # What is compiled on its own keeps no tracers.
            patch.setattr(compiled, "run_traced", inspect.unwrap(compiled.run_traced))
            for (name, homes), factor in zip(CONSTANTS.items(), factors, strict=True):
                for home in homes:
                    patch.setattr(home, name, factor * getattr(home, name))
            return model()

    traced = jax.jit(results).trace(*[1.0] * len(CONSTANTS))
    closed = traced.jaxpr
    used = slice_outputs(closed, slice(0, len(closed.jaxpr.outvars))).used
    return traced.lower().compile(), {list(CONSTANTS)[i] for i in used}


@pytest.mark.thorough
def test_each_constant_is_read() -> None:
    assert set().union(*(scaled(model)[1] for model in MODELS)) == {*CONSTANTS}


@pytest.mark.parametrize("model", [ball, *(pytest.param(model, marks=pytest.mark.thorough) for model in MODELS[1:])])
def test_results_do_not_depend_on_constants(model: Callable[[], Any]) -> None:
    """Over two orders of magnitude each, beyond the error of the run."""
    program, read = scaled(model)
    exact = program(*[1.0] * len(CONSTANTS))
    wrong = []
    for i, name in enumerate(CONSTANTS):
        for factor in (0.1, 10.0) if name in read else ():
            factors = [1.0] * len(CONSTANTS)
            factors[i] = factor
            found = program(*factors)
            errors = [
                np.max(np.abs(np.asarray(a) - np.asarray(b)))
                for a, b in zip(jax.tree.leaves(found), jax.tree.leaves(exact), strict=True)
            ]
            if not max(errors) < 1e-6:
                wrong.append((name, factor, errors))
    assert not wrong, wrong


@pytest.mark.thorough
def test_derivatives_and_records_do_not_depend_on_constants(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compiled, "run_traced", inspect.unwrap(compiled.run_traced))
    exact = jax.jit(jax.jacfwd(impacts))(0.8)
    values = {name: getattr(home, name) for name, home in (DERIVATIVE | ROOM).items()}
    for factor in (0.1, 10.0):
        for name, home in (DERIVATIVE | ROOM).items():
            value = factor * values[name]
            monkeypatch.setattr(home, name, max(1, round(value)) if name in ROOM else value)
        found = jax.jit(lambda e: jax.jacfwd(impacts)(e))(0.8)  # a function of its own, which is traced anew
        np.testing.assert_allclose(found, exact, rtol=1e-6)
