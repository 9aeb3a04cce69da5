"""Loss of the coil of the holding valve, or of the battery.

The valve is normally open: without current in its coil, the clutch spring presses the liquid back through the pump.
"""

import dataclasses
from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import Any

import numpy as np

from acausal import Scalar, Solution, replace, simulate

from ..actuators import CLOSED, at_rest, hold, valve_held

WATCHED = 1.0  # s, after the failure
OPEN_FOR_EVER = MappingProxyType({"travel.T": 1e9, "travel.x": 1.0})  # the valve stays open
# Changes of the held actuator by case.
FAILURES: Mapping[str, Mapping[str, Scalar]] = MappingProxyType(
    {
        "coil lost, motor switched off": {"drive.k": 0.0},  # short-circuited, which brakes it
        "battery lost": {"motor.resistor.R": 1e6},  # an open circuit
        "coil lost, controller active": {},
    }
)
FAILURE_HEADS = ("failure of the held EHS", "closed after [ms]", "lowest [mm]", "power of the motor, mean [W]")


@dataclasses.dataclass(frozen=True)
class Failure:
    """Results of a failure within `WATCHED`, in SI units; `closed` is None if the clutch stays open."""

    case: str
    closed: float | None
    lowest: float
    power: float


def run_failure(case: str, rtol: Scalar = 1e-9) -> Solution:
    """Simulates `WATCHED` seconds from the clutch held open, with the valve open from then on."""
    model = valve_held()
    failed = replace(at_rest(model, hold(model)), {**OPEN_FOR_EVER, **FAILURES[case], "controller.is_on": 0.0})
    return simulate(failed, WATCHED, rtol=rtol, integrals=_power, max_events=512, max_steps=50_000)


def failures(rtol: Scalar = 1e-9) -> list[Failure]:
    """The results of all failures."""
    return [_failure(case, run_failure(case, rtol)) for case in FAILURES]


def failure_cells(found: Iterable[Failure]) -> list[tuple[str, ...]]:
    """The table cells as text."""
    return [
        (
            one.case, "stays open" if one.closed is None else f"{1e3 * one.closed:.1f}", f"{1e3 * one.lowest:.2f}",
            f"{one.power:z.0f}",
        )
        for one in found
    ]  # fmt: skip


def _failure(case: str, solution: Solution) -> Failure:
    position, times = np.asarray(solution.slave.rod.s), np.asarray(solution.ts)
    below = np.flatnonzero(position < CLOSED)
    closed = None
    if len(below):
        last = slice(below[0] - 1, below[0] + 1)
        closed = float(np.interp(-CLOSED, -position[last], times[last]))
    return Failure(case, closed, float(position.min()), float(solution.integrals["motor"][-1]) / WATCHED)


def _power(s: Any) -> dict[str, Scalar]:
    """Battery power in W."""
    return {"motor": -s.supply.v * s.supply.i}
