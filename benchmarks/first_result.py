"""Waiting times of a user: the import, the first run and the first gradient in a fresh process, and in a second one.

CPU seconds; those of runs after the import and as multiples of what `diffrax` takes with its own `Tsit5` for the
equations of the clutch actuator, written by hand, to the same event. Programs of runs are optimised once their steps
repay it. They are also optimised at once: the time that this takes at first, and what it saves in each later run. The
gradient is also compiled without optimisation.
"""

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple

from ._effort import Effort
from ._rows import Row, compared

LATER = 20  # runs after the first, of which the fastest counts
IMPORT = 0.4  # of what the packages take to import that the library builds on
IMPORTS = {
    "the first example": """
from acausal import Component, Connections, connect, simulate
from components.electrical import ConstantVoltage, DCMotor, Ground
from components.rotational import Fixed, IdealGear, Inertia, SpringDamper
""",
    "the clutch actuators": "import studies.actuators",
    "every component": """
from components import blocks, electrical, hydraulic, planar, rotational, thermal, translational
for package in (blocks, electrical, hydraulic, planar, rotational, thermal, translational):
    for name in dir(package):
        getattr(package, name)
""",
}


class Limits(NamedTuple):
    """In units: of the run and of the gradient in a first process, of the run in a second one."""

    run: float
    gradient: float | None  # None: not timed
    second: float


LIMITS = {
    "clutch opening": Limits(1.0, 0.6, 0.4),
    "sticking clutch": Limits(2.5, 1.5, 0.6),
    "four clutches": Limits(3.0, 2.5, 1.0),
    "coupled clutches": Limits(3.0, 3.0, 0.6),
    "six-diode rectifier": Limits(2.5, 2.5, 1.0),
    "servo of 36 states": Limits(6.0, None, 1.5),
    "dual clutch": Limits(9.0, None, 1.0),
    "press axis": Limits(9.0, None, 1.0),
}

_IMPORT = """
import json, time
import diffrax, equinox, jax, lineax, optimistix
stack = time.process_time()
{named}
print(json.dumps([stack, time.process_time() - stack]))
"""
_TIMED = """
import json, time
import equinox as eqx
import jax
from jax import monitoring

compiled = []
monitoring.register_event_listener(lambda name, **_: compiled.append(name) if name.endswith("cache_misses") else None)

def timed(function, x):
    start = time.process_time()
    jax.block_until_ready(jax.tree.leaves(function(x)))
    return time.process_time() - start

{setup}
# What jax itself takes for its first program.
jax.block_until_ready(jax.jit(lambda x: 2.0 * x)(1.0))
compiled.clear()
times = [timed(function, x), timed(eqx.filter_grad(function), x) if {gradient} else 0.0]
n = len(compiled)
print(json.dumps([*times, n, min((timed(function, x) for _ in range({later})), default=0.0)]))
"""
_UNIT = """
import diffrax
from benchmarks._handwritten import device_parameters, opening_time
from studies.actuators import ema_maxon
x = device_parameters(ema_maxon())
function = jax.jit(lambda p: opening_time(p, 1e-6, diffrax.Tsit5()))
"""
_CASE = """
from benchmarks._first_models import CASES
make, function = CASES[{name!r}]
x = make()
"""


def run(effort: Effort, out: Path | None = None) -> list[Row]:
    """The least of several fresh processes each; then of others that find what these have compiled."""
    unit_run, unit_gradient, *_ = _least(_UNIT, effort)
    rows = [
        *(_import(name, effort) for name in IMPORTS),
        Row("first result: unit, run", unit_run, "s", "diffrax, by hand", None),
        Row("first result: unit, gradient", unit_gradient, "s", "diffrax, by hand", None),
    ]
    for name, limits in LIMITS.items() if effort.processes > 1 else list(LIMITS.items())[:1]:
        with tempfile.TemporaryDirectory() as folder:
            setup, gradient = _CASE.format(name=name), limits.gradient is not None
            first = _least(setup, effort, gradient=gradient, later=LATER)
            at_once = _least(setup, effort, {"ACAUSAL_OPTIMISE": "on"}, gradient=False, later=LATER)
            quick = _least(setup, effort, {"ACAUSAL_OPTIMISE": "off"}, gradient=True) if gradient else []
            kept = {"ACAUSAL_CACHE": folder}
            _seconds(setup, kept, gradient=gradient)
            second = _seconds(setup, kept, gradient=gradient)
        about = f"first result: {name}"
        rows += [
            compared(f"{about}, run", first[0], "s", unit_run, "the unit", limits.run),
            *(
                [compared(f"{about}, gradient", first[1], "s", unit_gradient, "the unit", limits.gradient)]
                if gradient
                else []
            ),
            compared(f"{about}, run in a second process", second[0], "s", unit_run, "the unit", limits.second),
            Row(f"{about}, programs compiled in a second process", second[2], "", "none", second[2], 0.0),
            compared(f"{about}, run optimised at once", at_once[0], "s", unit_run, "the unit"),
            *(
                [compared(f"{about}, gradient without optimisation", quick[1], "s", unit_gradient, "the unit")]
                if gradient
                else []
            ),
            compared(f"{about}, a later run before its optimisation", first[3], "s", at_once[3], "after it"),
        ]
    return rows


def _import(name: str, effort: Effort) -> Row:
    """With the library, once the byte code is there, as in an installation."""
    program = _IMPORT.replace("{named}", IMPORTS[name])
    with tempfile.TemporaryDirectory() as folder:
        setting = {"PYTHONDONTWRITEBYTECODE": "", "PYTHONPYCACHEPREFIX": folder}
        _, *times = (_printed(program, setting) for _ in range(effort.processes + 1))
    stack, own = (min(part) for part in zip(*times, strict=True))
    return compared(f"import: {name}", own, "s", stack, "jax, equinox, diffrax, optimistix, lineax", IMPORT)


def _least(
    setup: str, effort: Effort, setting: dict[str, str] | None = None, *, gradient: bool = True, later: int = 0
) -> list[float]:
    """The least times of processes that find nothing compiled."""
    setting = {"ACAUSAL_CACHE": "off", **(setting or {})}
    found = [_seconds(setup, setting, gradient=gradient, later=later) for _ in range(effort.processes)]
    return [min(times) for times in zip(*found, strict=True)]


def _seconds(setup: str, setting: dict[str, str], *, gradient: bool, later: int = 0) -> list[float]:
    """CPU seconds of a first run and gradient in a process of its own, how many programs it compiled, and the CPU
    seconds of the fastest of some later runs.
    """
    program = _TIMED.replace("{setup}", setup).replace("{gradient}", str(gradient)).replace("{later}", str(later))
    return _printed(program, setting)


def _printed(program: str, setting: dict[str, str]) -> list[float]:
    """The numbers that a separate process prints last."""
    inherited = {k: v for k, v in os.environ.items() if k not in ("JAX_COMPILATION_CACHE_DIR", "ACAUSAL_OPTIMISE")}
    done = subprocess.run(
        [sys.executable, "-c", program], check=True, capture_output=True, text=True, env={**inherited, **setting}
    )
    return json.loads(done.stdout.splitlines()[-1])
