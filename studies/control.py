"""Optimal voltages that open the clutch, for two actuators: at full voltage; soonest, with a current limit and a soft
landing; and with the least heat in the winding, with the same limits.

Full voltage opens the clutch soonest, but the motor first draws its stall current, and the piston arrives at speed. The
optimal voltage is piecewise linear between evenly spaced samples, within the range of an H-bridge.
"""

import dataclasses
import functools as ft
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import jax.numpy as jnp
import numpy as np

from acausal import Scalar, Table, simulate
from acausal.design import Course, control
from components.blocks import TimeSeries

from ._output import (
    ACTUATOR_NAMES,
    finished,
    legend,
    print_table,
    progress,
    require_matplotlib,
    resumed,
    write_json,
)
from .actuators import (
    STROKE,
    SUPPLY,
    CommandedElectrohydraulic,
    CommandedElectromechanical,
    commanded,
    ehs_maxon,
    ema_maxon,
    opening,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ACTUATORS = {
    "ema_maxon": (ema_maxon(), 35.0),
    "ehs_maxon": (ehs_maxon(), 27.0),
}  # with the current allowed, in A
SOFT = 5e-3  # m/s, largest speed of the piston at the end
SLOWER = 1.5  # duration for the least heat, relative to the opening time at full voltage
INTERVALS = 10
FULL, SOONEST, COOLEST = "full voltage", "soonest", "least heat"
HEADS = ("problem", "time [ms]", "end speed [mm/s]", "peak current [A]", "heat [J]", "at full voltage [ms]", "status")
SHOWN = ("command.y.value", "motor.p.i", "slave.rod.s", "piston.v")


@dataclasses.dataclass(frozen=True)
class Row:
    """One way to open the clutch, in SI units."""

    problem: str
    time: float
    end_speed: float
    peak_current: float
    full_voltage_time: float
    heat: float
    status: str
    kkt_residual: float


def heat(s: CommandedElectromechanical | CommandedElectrohydraulic) -> Scalar:
    """The power in W dissipated in the winding."""
    return s.motor.resistor.R * s.motor.p.i**2


def courses(name: str, rtol: float = 1e-8) -> dict[str, Callable[[], Course[Any]]]:
    """The optimisations of an actuator by problem, each a function without arguments."""
    actuator, allowed = ACTUATORS[name]
    full = float(opening(actuator, save="end", rtol=rtol).t1)
    times = jnp.linspace(0.0, SLOWER * full, INTERVALS + 1)
    model = commanded(actuator, TimeSeries(times=times, values=jnp.linspace(8.0, 5.0, len(times)), smooth=False))
    asked: dict[str, Any] = dict(
        end={
            "travel": (lambda s: s.slave.rod.s, f"== {STROKE} m"),
            "landing": (lambda s: s.piston.v, f"<= {SOFT} m/s"),
        },
        path={"current": (lambda s: s.motor.p.i, f"<= {allowed} A")},
        rtol=rtol,
        sensitivities=False,
    )
    bounds = {"command": (f"-{SUPPLY} V", f"{SUPPLY} V")}
    return {
        SOONEST: ft.partial(control, model, bounds, (0.8 * full, 3.0 * full), **asked),
        COOLEST: ft.partial(control, model, bounds, SLOWER * full, {"heat": (heat, "J")}, **asked),
    }


def rows_of(name: str, found: dict[str, Course[Any]], rtol: float = 1e-8) -> list[Row]:
    """Rows of the optimal voltages of an actuator, after the row of full voltage."""
    actuator, _ = ACTUATORS[name]
    time = float(opening(actuator, save="end", rtol=rtol).t1)
    full = simulate(
        actuator, time, rtol=rtol, save="end", integrals=lambda s: {"heat": heat(s)}, peaks=lambda s: s.motor.p.i
    )
    title = ACTUATOR_NAMES[name]
    speed, spent = float(full.final.piston.v), float(full.integrals["heat"][-1])
    rows = [Row(f"{title}: {FULL}", time, speed, float(full.peaks.value), time, spent, "", 0.0)]
    for problem, course in found.items():
        current, t = course["motor.p.i"], course.times
        lost = np.trapezoid(float(actuator.motor.resistor.R) * current**2, t)
        design = course.design
        spent = design.objective if problem == COOLEST else float(lost)
        rows.append(
            Row(
                f"{title}: {problem}", course.duration, float(course["piston.v"][-1]), _peak(course), time,
                spent, design.status, design.kkt_residual,
            )
        )  # fmt: skip
    return rows


def _peak(course: Course[Any]) -> float:
    return max(result.value for result in course.design.results if result.limit.name.startswith("current"))


def main(json: Path | None = None, out: Path | None = None, rtol: float = 1e-8) -> list[Row]:
    """Find the voltages, print, and write rows to the file `json`, pictures and a report to the folder `out`.

    With `out`, an interrupted study can be resumed.
    """
    if out is not None:
        require_matplotlib()
    ways = [(name, problem, find) for name in ACTUATORS for problem, find in courses(name, rtol).items()]
    found: dict[str, dict[str, Course[Any]]] = {}
    for name, problem, find in progress(ways, "controlling"):
        found.setdefault(name, {})[problem] = resumed(out, f"{name}_{problem.replace(' ', '_')}_{rtol:g}", find)
    rows = [row for name, ways in found.items() for row in rows_of(name, ways, rtol)]
    print_table("Ways to open the clutch", HEADS, map(_cells, rows))
    if json is not None:
        write_json(json, rows)
    if out is not None:
        _report(found, rows, out)
    finished(out)
    return rows


def _cells(row: Row) -> tuple[str, ...]:
    numbers = (1e3 * row.time, 1e3 * row.end_speed, row.peak_current, row.heat, 1e3 * row.full_voltage_time)
    return row.problem, *(f"{number:.5g}" for number in numbers), row.status


def _report(found: dict[str, dict[str, Course[Any]]], rows: list[Row], out: Path) -> None:
    from ._output import save
    from ._report import write_report

    parts = []
    for name, ways in found.items():
        for problem, course in ways.items():
            figure = picture(name, course)
            figure.suptitle(f"{ACTUATOR_NAMES[name]}: {problem}", fontsize="medium")
            save(figure, out, f"control_{name}_{problem.replace(' ', '_')}")
            parts.append((f"{ACTUATOR_NAMES[name]}: {problem}", str(course), [figure]))
    overview = ("Overview", Table(HEADS, [_cells(row) for row in rows]), [])
    write_report(out, "control", "Optimal voltages to open the clutch", [overview, *parts], __doc__)


def picture(name: str, course: Course[Any]) -> "Figure":
    """Plots voltage, current, travel and speed over time, compared with full voltage."""
    actuator, allowed = ACTUATORS[name]
    full = opening(actuator, rtol=1e-6)
    figure = course.plot(*SHOWN, units=("mm", "mm/s"))
    others = (np.full(len(full.ts), SUPPLY), full["motor.p.i"], 1e3 * full["slave.rod.s"], 1e3 * full["piston.v"])
    labels = ("voltage [V]", "current [A]", "travel [mm]", "speed [mm/s]")
    for panel, other, label in zip(figure.axes, others, labels, strict=True):
        panel.plot(full.ts, other, "--", color="0.5", label="at full voltage")
        panel.set_ylabel(label)
        panel.get_lines()[0].set_label("found")
    figure.axes[1].axhline(allowed, color="C3", linewidth=1.0, label="limit")
    figure.axes[-1].xaxis.set_major_formatter(lambda t, _: f"{1e3 * t:g}")
    figure.axes[-1].set_xlabel("time [ms]")
    legend(figure, 3)
    return figure
