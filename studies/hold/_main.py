"""`python -m studies hold`."""

import dataclasses
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from acausal import Solution, Table, displayed

from .._output import ACTUATOR_NAMES, print_table, progress, require_matplotlib, save, write_json
from ..actuators import STROKE, SUPPLY, ema_fise, hold
from ._elasticities import Elasticities, Leaking, elasticities, sweep
from ._failures import FAILURE_HEADS, failure_cells, failures
from ._runs import DESIGNS, DURATION, run, static_current, static_power, top_up_times

HEADS = (
    "method", "motor, held [A]", "battery, mean [A]", "power, mean [W]", "motor [J]", "coil [J]", "total [J]",
    "top-ups", "lowest [mm]", "highest [mm]",
)  # fmt: skip
ELASTICITY_HEADS = ("parameter", *(f"energy, {ACTUATOR_NAMES[name]}" for name in DESIGNS), "time between top-ups")
SWEEP_HEADS = ("leakage resistance [bar.s/cm3]", *(f"{ACTUATOR_NAMES[name]} [J]" for name in DESIGNS), "top-ups")
ABOUT = """Battery energy to hold the clutch open for a minute, by the motor or by a valve.

If the motor holds alone, a controller keeps the stroke. If a valve holds, it is closed by its coil, and the motor is
off. Liquid leaks past the seals until a two-point controller runs the motor again (a top-up). Elasticities are changes
in per cent for one per cent more of a parameter. Leakage, chamber and closing time of the valve are assumed; the thesis
does not state them.

The thesis mentions a magnetic brake to hold the actuator with the FISE motor (section 7.1.1). Its power is assumed.
"""
BRAKE = 10.0  # W, coil power of a brake of a few tenths of N.m; assumed


@dataclasses.dataclass(frozen=True)
class Row:
    """A hold of `DURATION` with the opening before it, in SI units; positions are those of the slave, once open.

    `motor_current` is the final value. Battery current and power are means, with a lossless converter.
    """

    actuator: str
    method: str
    energy_motor: float
    energy_coil: float
    energy: float
    motor_current: float
    battery_current: float
    mean_power: float
    top_ups: int
    lowest: float
    highest: float


def main(json: Path | None = None, out: Path | None = None, rtol: float = 1e-9) -> list[Row]:
    """Hold, print, and write tables to the file `json`, pictures and a report to the folder `out`."""
    if out is not None:
        require_matplotlib()
    runs = {name: run(DESIGNS[name](), rtol) for name in progress(list(DESIGNS), "holding")}
    rows = [_static_row(), *(_row(name, solution) for name, solution in runs.items()), *_fise_rows()]
    slopes = [row for name in progress(list(DESIGNS), "differentiating") for row in elasticities(name, rtol)]
    leaks = [row for name in progress(list(DESIGNS), "sweeping") for row in sweep(name, rtol)]
    lost = failures(rtol)
    tables = [
        (f"Clutch held open for {DURATION:g} s", HEADS, list(_cells(rows))),
        ("Elasticities", ELASTICITY_HEADS, list(_elasticity_cells(slopes))),
        ("Other leakage resistances", SWEEP_HEADS, list(_sweep_cells(leaks))),
        ("Loss of the coil or of the battery while the valve holds", FAILURE_HEADS, failure_cells(lost)),
    ]
    for table in tables:
        print_table(*table)
    print(_brake())
    if json is not None:
        write_json(json, rows, elasticities=slopes, sweep=leaks, failures=lost)
    if out is not None:
        from .._report import write_report
        from ._plot import plot_energies, plot_runs

        pictures = {"hold": plot_runs(runs), "hold_energy": plot_energies(runs, leaks)}
        for name, figure in pictures.items():
            save(figure, out, name)
        parts = [
            *((title, Table(heads, cells), []) for title, heads, cells in tables),
            ("A magnetic brake", _brake(), []),
            ("The hold over time", "", [pictures["hold"]]),
            ("Energy from the battery", "", [pictures["hold_energy"]]),
        ]
        write_report(out, "hold", "Holding the clutch open by motor or by valve", parts, ABOUT)
    return rows


def _static_row() -> Row:
    model = DESIGNS["motor_held"]()
    power, current = float(static_power(model)), float(static_current(model))
    energy = DURATION * power
    return Row(
        "motor_held", "at rest, in closed form", energy, 0.0, energy, current, power / SUPPLY, power, 0, STROKE, STROKE
    )


def _fise_rows() -> list[Row]:
    """The electromechanical actuator with the FISE motor, held by the motor or by a brake."""
    rest = hold(ema_fise())
    current, power = float(rest.current), float(rest.power)
    given = (
        ("by its motor, in closed form", DURATION * power, 0.0, current),
        ("by a magnetic brake", 0.0, DURATION * BRAKE, 0.0),
    )
    return [
        Row(
            "ema_fise", method, motor, coil, motor + coil, held, (motor + coil) / DURATION / SUPPLY,
            (motor + coil) / DURATION, 0, STROKE, STROKE,
        )
        for method, motor, coil, held in given
    ]  # fmt: skip


def _brake() -> str:
    """A sentence with the torque that a brake must hold."""
    model = ema_fise()
    torque = float(hold(model).torque)
    return (
        f"The brake of the FISE must hold {torque:.3f} N.m at the motor shaft, or "
        f"{float(model.gearbox.ratio) * torque:.2f} N.m at the camshaft."
    )


def _row(actuator: str, solution: Solution) -> Row:
    position = np.asarray(solution.slave.rod.s)
    held = position[np.argmax(position >= STROKE) :]
    motor, coil = (float(solution.integrals[name][-1]) for name in ("motor", "coil"))
    top_ups = int(np.sum(np.isfinite(top_up_times(solution)))) if actuator == "valve_held" else 0
    return Row(
        actuator, "simulated", motor, coil, motor + coil, float(solution.final.motor.p.i),
        (motor + coil) / DURATION / SUPPLY, (motor + coil) / DURATION, top_ups, float(np.min(held)),
        float(np.max(held)),
    )  # fmt: skip


def _cells(rows: list[Row]) -> Iterable[tuple[str, ...]]:
    for row in rows:
        energies = (row.energy_motor, row.energy_coil, row.energy)
        yield (
            f"{ACTUATOR_NAMES[row.actuator]}, {row.method}", f"{row.motor_current:z.2f}", f"{row.battery_current:.2f}",
            f"{row.mean_power:.2f}", *(f"{energy:.1f}" for energy in energies), str(row.top_ups),
            f"{1e3 * row.lowest:.3f}", f"{1e3 * row.highest:.3f}",
        )  # fmt: skip


def _elasticity_cells(slopes: list[Elasticities]) -> Iterable[tuple[str, ...]]:
    found = {(row.actuator, row.parameter): row for row in slopes}
    for name in dict.fromkeys(row.parameter for row in slopes):
        motor, valve = (found.get((actuator, name)) for actuator in DESIGNS)
        yield name, *(_number(row and row.energy) for row in (motor, valve)), _number(valve and valve.period)


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:+.4f}"


def _sweep_cells(leaks: list[Leaking]) -> Iterable[tuple[str, ...]]:
    motor, valve = ([row for row in leaks if row.actuator == name] for name in DESIGNS)
    for by_motor, by_valve in zip(motor, valve, strict=True):
        leakage = f"{displayed(by_valve.leakage_resistance, 'Pa.s/m3')[0]:.4g}"
        yield leakage, f"{by_motor.energy:.1f}", f"{by_valve.energy:.1f}", str(by_valve.top_ups)
