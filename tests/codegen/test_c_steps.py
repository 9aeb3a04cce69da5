"""Runs of C code with fixed steps against the same method in Python, and against known results."""

import ctypes
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _c_models import (
    Ball,
    Balls,
    Clock,
    Offset,
    Striker,
    motor_servo,
    nonlinear_block,
    rectifier,
    sampled_servo,
    stick_slip,
)
from _compiled import COMPILER, STRICT, Compiled, needs_compiler

from acausal import Component, replace, simulate
from acausal.codegen import export_c

pytestmark = [needs_compiler, pytest.mark.filterwarnings("ignore::acausal.JumpWarning")]
Field = Callable[[float, np.ndarray], np.ndarray]


def in_python(compiled: Compiled, method: str, step: float, n: int) -> np.ndarray:
    """The states after some steps without events, by the equations of the engine."""
    model, system = compiled.model, compiled.model.system
    size = model.n_states
    guess = [jnp.asarray(compiled.point[size:])]

    @jax.jit
    def field(t: Any, x: Any, rest: Any) -> Any:
        return system.vector_field(t, jnp.concatenate([x, rest]), model.inputs)

    slopes = jax.jit(jax.jacfwd(field, argnums=(0, 1)))
    remembered = jax.jit(lambda t, x, rest: system.with_memory(t, jnp.concatenate([x, rest]), model.inputs)[size:])
    x = np.array(compiled.x)
    for k in range(n):
        t = k * step
        f = np.asarray(field(t, x, guess[0]))
        guess[0] = remembered(t, x, guess[0])
        if method == "explicit":
            x = x + step * f
        elif method == "rk4":
            k2 = np.asarray(field(t + step / 2, x + step / 2 * f, guess[0]))
            k3 = np.asarray(field(t + step / 2, x + step / 2 * k2, guess[0]))
            k4 = np.asarray(field(t + step, x + step * k3, guess[0]))
            x = x + step / 6 * (f + 2 * k2 + 2 * k3 + k4)
        else:
            of_time, of_states = (np.asarray(part) for part in slopes(t, x, guess[0]))
            x = x + np.linalg.solve(np.eye(size) - step * of_states, step * (f + step * of_time))
    return x


def test_a_signal_has_the_unit_of_the_quantity_that_it_sets(tmp_path: Path) -> None:
    model = export_c(rectifier(), tmp_path, step=1e-5, method="implicit", outputs=["sine.y.value"])
    assert model.outputs[0].unit == "V"
    assert "sine.y.value [V]" in (tmp_path / f"{model.name}.h").read_text()


def test_a_start_value_holds_in_the_branch_at_the_start(tmp_path: Path) -> None:
    compiled = Compiled(Offset(y=1.0), tmp_path, "rk4", 1e-2)
    compiled.call("initialise")
    assert compiled.x[0] == pytest.approx(1.0, abs=1e-12)
    for _ in range(50):
        compiled.call("step")
    assert compiled.x[0] == pytest.approx(np.exp(-0.5) + 0.25, abs=1e-8)


@pytest.mark.parametrize(
    "method", [pytest.param("implicit"), *(pytest.param(m, marks=pytest.mark.thorough) for m in ("explicit", "rk4"))]
)
def test_a_run_follows_the_method(tmp_path: Path, method: str) -> None:
    step, n = 1e-3, 50
    compiled = Compiled(nonlinear_block(), tmp_path, method, step)
    wanted = in_python(compiled, method, step, n)
    assert [compiled.call("step") for _ in range(n)] == [0] * n
    assert compiled.struct.t == n * step
    assert compiled.struct.failures == 0
    np.testing.assert_allclose(compiled.x, wanted, rtol=1e-12)


@pytest.mark.thorough
def test_sparse_columns_give_the_same_steps(tmp_path: Path) -> None:
    compiled = Compiled(motor_servo(), tmp_path, step=1e-4)
    wanted = in_python(compiled, "implicit", 1e-4, 40)
    compiled.call("initialise")
    for _ in range(40):
        compiled.call("step")
    np.testing.assert_allclose(compiled.x, wanted, rtol=1e-11, atol=1e-14)


@pytest.mark.thorough
def test_a_ball_rebounds(tmp_path: Path) -> None:
    """Impacts at the ends of steps; the ball of the second run flies too high."""
    compiled = Compiled(Ball(), tmp_path, "rk4", 1e-5)
    compiled.call("initialise")
    happened = [compiled.call("step") for _ in range(200_000)]
    assert sum(happened) == compiled.array("d")[0] == 3.0
    fall = np.sqrt(2.0 / 9.81)
    after = fall * (1.0 + 2.0 * (0.8 + 0.64 + 0.512))
    speed = 9.81 * fall * 0.512
    t = 2.0 - (after - 2.0 * fall * 0.512)
    assert compiled.x[0] == pytest.approx(speed * t - 4.905 * t**2, abs=1e-3)
    compiled.call("start")
    compiled.x[1] = 20.0
    compiled.call("initialise")
    while compiled.call("step") >= 0:
        assert compiled.struct.t < 1.0
    assert compiled.struct.refused == b"far: the ball flies away"


@pytest.mark.thorough
def test_a_model_with_many_parameters(tmp_path: Path) -> None:
    """Above 300 leaves, the engine holds parameters by component class."""
    balls = tuple(Ball(h=-1.0, v=-1.0) if k == 70 else Ball() for k in range(80))
    compiled = Compiled(Balls(balls=balls), tmp_path, "explicit", outputs=["balls[70].v", "balls[71].v"])
    assert len(compiled.model.system.flat.leaves) > 300
    assert compiled.call("initialise") == 1
    assert compiled.outputs == {"balls[70].v": 0.8, "balls[71].v": 0.0}


def test_time_events(tmp_path: Path) -> None:
    """Ticks every 0.01 s; single events at 0.012 and 0.031 s; an alarm at 0.045 s, then every 0.021 s."""
    compiled = Compiled(Clock(), tmp_path, "explicit", 1e-3)
    level, alarm, ticks = 0.0, 0.045, np.zeros(3)
    x = 0.0
    compiled.call("initialise")
    ticks += [1.0, 0.0, 0.0]  # of the past ticks, the last one
    for k in range(1, 101):
        x += 1e-3 * ((0.5 if x > 0.05 else 2.0) + level)
        compiled.call("step")
        if k in (12, 31):
            level -= 0.5
        if k in (45, 66, 87):
            level += 1.0
            alarm += 0.021
        if k % 10 == 0:
            ticks += [1.0, level, x]
        named = {q.name: q.place for q in compiled.model.discrete}
        found = compiled.array("d")
        assert found[named["level"]] == level
        assert found[named["alarm"]] == pytest.approx(alarm, rel=1e-14)
        np.testing.assert_allclose(found[named["ticks"] : named["ticks"] + 3], ticks, rtol=1e-12)
        np.testing.assert_allclose(compiled.x, [x], rtol=1e-12)
    assert compiled.call("next_time", gives=ctypes.c_double) == pytest.approx(0.108)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("make", "name", "t1", "tolerance"),
    [
        (sampled_servo, "parts[6].w", 0.2, 0.01),
        (rectifier, "capacitor.v", 0.05, 0.01),
        (stick_slip, "parts[2].s", 1.0, 0.01),
    ],
)
def test_small_steps_approach_the_run(
    tmp_path: Path, make: Callable[[], Component], name: str, t1: float, tolerance: float
) -> None:
    model = make()
    wanted = np.asarray(simulate(model, t1, save=jnp.linspace(0.0, t1, 11), max_events=1000)[name])
    step = t1 / 20_000
    compiled = Compiled(model, tmp_path, step=step, outputs=[name])
    compiled.call("initialise")
    found = [compiled.outputs[name]]
    for _ in range(10):
        assert min(compiled.call("step") for _ in range(2000)) >= 0
        found.append(compiled.outputs[name])
    np.testing.assert_allclose(found, wanted, rtol=0.0, atol=tolerance * np.max(np.abs(wanted)))


def test_an_event_sets_a_variable_that_constraints_tie_to_the_states(tmp_path: Path) -> None:
    compiled = Compiled(Striker(), tmp_path, "rk4", 1e-4, outputs=["v", "s", "w", "phi"])
    before = compiled.outputs
    assert compiled.call("initialise") == 1
    after = compiled.outputs
    assert after["v"] == pytest.approx(-0.5 * before["v"], rel=1e-12)
    assert after["s"] == pytest.approx(0.3 * np.sin(after["phi"]), rel=1e-12)
    assert after["v"] == pytest.approx(0.3 * np.cos(after["phi"]) * after["w"], rel=1e-12)


def test_parameters_are_tunable_and_their_requirements_are_checked(tmp_path: Path) -> None:
    compiled = Compiled(nonlinear_block(), tmp_path)
    compiled.struct.p[[q.name for q in compiled.model.parameters].index("parts[1].R")] = 50.0
    found = compiled.vector("rates", 1)
    other = replace(nonlinear_block(), {"parts[1].R": 50.0})
    system = compiled.model.system
    np.testing.assert_allclose(found, system.vector_field(0.0, jnp.asarray(compiled.x), system.pack(other)), rtol=1e-12)
    assert compiled.call("violation", gives=ctypes.c_char_p) is None


@pytest.mark.thorough
def test_the_example_runs(tmp_path: Path) -> None:
    export_c(rectifier(), tmp_path, step=1e-4, outputs=["capacitor.v", "load.i"], name="bridge")
    files = [str(tmp_path / name) for name in ("main.c", "bridge.c")]
    subprocess.run([str(COMPILER), *STRICT, *files, "-o", str(tmp_path / "run"), "-lm"], check=True)
    lines = subprocess.run([str(tmp_path / "run")], check=True, capture_output=True, text=True).stdout.splitlines()
    assert len(lines) == 11
    t, v, i = map(float, lines[-1].split())
    assert t == pytest.approx(0.1)
    assert 8.0 < v < 10.0
    assert i == pytest.approx(v / 50.0, rel=1e-4)
