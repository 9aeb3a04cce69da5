"""Time-optimal voltages with a soft landing, compared with full voltage.

Without limits, the time-optimal voltage is full voltage. If the final speed of the piston is limited to 5 mm/s, it is
full voltage with braking at the end, apart from a small effect of the compression of the line: two values with a free
switching time. `python -m studies control` limits the current and minimises the heat.
"""

import functools as ft
from typing import Any

import jax.numpy as jnp

from acausal.design import Course, control
from components.blocks import Staircase

from ..actuators import STROKE, SUPPLY, commanded, opening
from ._prototypes import PROTOTYPES
from ._row import Row

ITEM = "profiles"
RTOL = 1e-8
SOFT = 5e-3  # m/s


@ft.cache
def landing(name: str, rtol: float) -> Course[Any]:
    """The time-optimal voltage with a soft landing."""
    actuator = PROTOTYPES[name].build()
    full = float(opening(actuator, save="end", rtol=rtol).t1)
    command: Any = Staircase(times=jnp.array([0.0, 0.9 * full, full]), values=jnp.array([13.0, -8.0]))
    return control(
        commanded(actuator, command), {"command": (-SUPPLY, SUPPLY)}, (0.5 * full, 3.0 * full),
        end={
            "travel": (lambda s: s.slave.rod.s, f"== {STROKE} m"),
            "landing": (lambda s: s.piston.v, f"<= {SOFT} m/s"),
        },
        switching=True, rtol=rtol, sensitivities=False, progress=False,
    )  # fmt: skip


def rows(rtol: float = RTOL) -> list[Row]:
    """Rows of the times and final speeds, at full voltage and with a soft landing."""
    table = []
    for name, (build, _) in PROTOTYPES.items():
        full = opening(build(), save="end", rtol=rtol, throw=True)
        course = landing(name, rtol)
        table += [
            Row(ITEM, f"{name}, full voltage", "opening time", "s", float(full.t1)),
            Row(ITEM, f"{name}, full voltage", "speed of arrival", "m/s", float(full.final.piston.v)),
            Row(ITEM, f"{name}, soft", "opening time", "s", course.duration, None, f"{course.design.status}"),
            Row(ITEM, f"{name}, soft", "speed of arrival", "m/s", float(course["piston.v"][-1])),
            Row(ITEM, f"{name}, soft", "largest current", "A", float(jnp.max(jnp.abs(course["motor.p.i"])))),
            Row(ITEM, f"{name}, soft", "braking at the end", "s", _brake(course)),
        ]
    return table


def _brake(course: Course[Any]) -> float:
    """Duration in s of the negative voltage at the end."""
    model: Any = course.model
    times, values = model.command.times, model.command.values
    return course.duration - float(next((t for t, v in zip(times, values, strict=True) if v < 0.0), course.duration))
