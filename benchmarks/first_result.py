"""What a user waits for: the first run and the first gradient in a fresh process, and in a second one.

CPU seconds after the import, as multiples of what `diffrax` takes with its own `Tsit5` for the equations of the clutch
actuator, written by hand, to the same event.
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


class Limits(NamedTuple):
    """In units: of the run and of the gradient in a first process, of the run in a second one."""

    run: float
    gradient: float
    second: float


LIMITS = {
    "clutch opening": Limits(1.2, 1.0, 0.4),
    "sticking clutch": Limits(2.0, 1.5, 0.6),
    "four clutches": Limits(3.0, 2.5, 1.0),
    "six-diode rectifier": Limits(3.0, 2.5, 1.0),
}

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
times = [timed(function, x), timed(eqx.filter_grad(function), x)]
print(json.dumps([*times, len(compiled)]))
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
    unit_run, unit_gradient, _ = _least(_UNIT, effort)
    rows = [
        Row("first result: unit, run", unit_run, "s", "diffrax, by hand", None),
        Row("first result: unit, gradient", unit_gradient, "s", "diffrax, by hand", None),
    ]
    for name, limits in LIMITS.items() if effort.processes > 1 else list(LIMITS.items())[:1]:
        with tempfile.TemporaryDirectory() as folder:
            first = _least(_CASE.format(name=name), effort)
            _seconds(_CASE.format(name=name), folder)
            second = _seconds(_CASE.format(name=name), folder)
        about = f"first result: {name}"
        rows += [
            compared(f"{about}, run", first[0], "s", unit_run, "the unit", limits.run),
            compared(f"{about}, gradient", first[1], "s", unit_gradient, "the unit", limits.gradient),
            compared(f"{about}, run in a second process", second[0], "s", unit_run, "the unit", limits.second),
            Row(f"{about}, programs compiled in a second process", second[2], "", "none", second[2], 0.0),
        ]
    return rows


def _least(setup: str, effort: Effort) -> list[float]:
    """Of processes that find nothing compiled."""
    return [min(times) for times in zip(*(_seconds(setup, "off") for _ in range(effort.processes)), strict=True)]


def _seconds(setup: str, cache: str) -> list[float]:
    """CPU seconds of a first run and gradient in a process of its own, and how many programs it compiled."""
    inherited = {k: v for k, v in os.environ.items() if k != "JAX_COMPILATION_CACHE_DIR"}
    program = _TIMED.replace("{setup}", setup)
    done = subprocess.run(
        [sys.executable, "-c", program], check=True, capture_output=True, text=True,
        env={**inherited, "ACAUSAL_CACHE": cache},
    )  # fmt: skip
    return json.loads(done.stdout.splitlines()[-1])
