"""Scatter of the opening time of the RE50 actuator with ten parameters, by four methods, with the causes.

All parameters are assumed normal and independent. Their relative standard deviations are first guesses: 10 % for
friction, 5 % for a winding, 0.2 % for a bore.
"""

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Any

from acausal.design import Normal, SensitivityTable, Spread, Tolerance, sensitivities

from ._measured import FULL, MEASURED
from ._output import finished, print_table, progress, require_matplotlib, resumed, write_json
from .actuators import ElectromechanicalActuator, ema_maxon, opening

SHARES = {
    "motor.resistor.R": 5.0, "motor.bearing.C": 10.0, "motor.emf.k": 3.0, "clutch.rate": 4.0, "supply.V": 2.0,
    "cam.profile.eccentricity": 1.0, "master.bore": 0.2, "motor.rotor.J": 5.0, "line.damping": 20.0,
    "line.stiffness": 10.0,
}  # fmt: skip
MEMBERS, SEED = 2000, 4711
LATEST = 95e-3  # s, specified limit
HEADS = ("result", "method", "mean [ms]", "std [ms]", "1 % [ms]", "99 % [ms]")
METHODS = ("first order", "second order", "Monte Carlo", "Sobol sequence")


@dataclasses.dataclass(frozen=True)
class Row:
    """The distribution of a result by one method, in SI units."""

    result: str
    method: str
    mean: float
    std: float
    p01: float
    p99: float


def study(rtol: float = 1e-9) -> Tolerance[ElectromechanicalActuator]:
    """The opening time with its tolerances. One inertia stands for all parts that turn with the motor."""
    model = ema_maxon(rotor_inertia=56e-6, gearbox_inertia=0.0)
    distributions = {path: Normal(std=f"{share} %") for path, share in SHARES.items()}
    results = {"opening time": (lambda s: s.t1, "ms")}
    return Tolerance(model, distributions, results, run=lambda m: opening(m, rtol=rtol, t_max=1.0, save="end"))


Keep = Callable[[str, Callable[[], Any]], Any]


def spreads(tolerance: Tolerance[ElectromechanicalActuator], kept: Keep = lambda name, make: make()) -> list[Spread]:
    """The distribution of the opening time by each method; `kept` returns stored results of an interrupted run."""
    run = {
        "first order": tolerance.first_order,
        "second order": tolerance.second_order,
        "Monte Carlo": lambda: tolerance.monte_carlo(MEMBERS, seed=SEED),
        "Sobol sequence": lambda: tolerance.sobol_sequence(1024),
    }
    return [
        kept(method.replace(" ", "_"), lambda m=method: run[m]()["opening time"])
        for method in progress(METHODS, "sampling")
    ]


def main(json: Path | None = None, out: Path | None = None, rtol: float = 1e-9) -> list[Row]:
    """Compute, print, and write rows to the file `json`, pictures and a report to the folder `out`.

    An interrupted study resumes from the files in that folder.
    """
    if out is not None:
        require_matplotlib()

    def kept(name: str, make: Callable[[], Any]) -> Any:
        return resumed(out, f"{name}_{rtol:g}", make)

    tolerance = study(rtol)
    found = spreads(tolerance, kept)
    rows = [_row(spread) for spread in found]
    cells = [(row.result, row.method, *(f"{1e3 * x:.5g}" for x in dataclasses.astuple(row)[2:])) for row in rows]
    print_table("Scatter of the opening time", HEADS, cells)
    inside = found[2].share(high=LATEST)
    print(f"within {1e3 * LATEST:g} ms: {inside}")
    worst = kept("worst_case", tolerance.worst_case)
    print(worst)
    if json is not None:
        write_json(json, rows)
    if out is not None:
        _report(tolerance, found, f"within {1e3 * LATEST:g} ms: {inside}\n\n{worst}", out, kept, rtol)
        finished(out)
    return rows


def _row(spread: Spread) -> Row:
    low, high = spread.percentile([1.0, 99.0]).tolist()
    return Row(spread.result, spread.method, spread.mean, spread.std, low, high)


def _report(
    tolerance: Tolerance[ElectromechanicalActuator], found: list[Spread], text: str, out: Path, kept: Keep, rtol: float
) -> None:
    from ._output import save
    from ._report import write_report

    indices = kept("causes", lambda: tolerance.indices(512))
    results = {"opening time": (lambda s: s.t1, "ms")}
    run = lambda m: opening(m, rtol=rtol, t_max=1.0, save="end")  # noqa: E731
    slopes: SensitivityTable = kept(
        "sensitivities", lambda: sensitivities(tolerance.model, results, run=run)["opening time"]
    )
    scatter = found[2].plot(limits=[LATEST])
    measured = MEASURED["ema_maxon"][FULL]["opening time"].value
    scatter.axvline(1e3 * measured, color="black", linestyle=":", label="thesis: measured on one specimen")
    scatter.legend(frameon=False, fontsize="small", loc="upper left", bbox_to_anchor=(1.0, 1.0))
    pictures = {
        "tolerance": scatter.figure,
        "tolerance_causes": indices.plot().figure,
        "tolerance_sensitivities": slopes.plot().figure,
    }
    for name, figure in pictures.items():
        save(figure, out, name)
    parts = [
        ("Distribution", "\n".join(map(str, found)) + "\n\n" + text, [pictures["tolerance"]]),
        ("Causes", str(indices), [pictures["tolerance_causes"]]),
        ("Sensitivities to all parameters", str(slopes), [pictures["tolerance_sensitivities"]]),
    ]
    write_report(out, "tolerance", "Scatter of the opening time of the RE50 actuator", parts, __doc__)
