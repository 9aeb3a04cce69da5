"""Identification of winding resistance, friction and torque constant of the RE50 actuator from travel and current.

The measurements are simulated, so that the true values are known: without noise, with noise of known standard
deviation, and with noise whose standard deviation is estimated.
"""

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np

from acausal import parameters, simulate
from acausal.design import Experiment, Fit, Scale, identify

from ._output import print_table, progress, require_matplotlib, write_json
from .actuators import ElectromechanicalActuator, ema_maxon

FREE = {"motor.resistor.R": (0.1, 1.0), "motor.bearing.C": (1e-4, 1e-2), "motor.emf.k": (0.02, 0.08)}
TRUE = ema_maxon()
START = ema_maxon(resistance=0.35, friction=0.003, torque_constant=0.042)
TIMES = 1.6e-3 * np.arange(1, 51)  # s
NOISE = {"slave.rod.s": 20e-6, "motor.p.i": 0.2}  # m, A
SEED = 1812
CASES = ("exact data", "noise given", "noise estimated")
HEADS = ("case", "parameter", "unit", "true", "estimate", "low", "high")


@dataclasses.dataclass(frozen=True)
class Row:
    """A parameter of one case with its 95 % confidence interval, in SI units."""

    case: str
    parameter: str
    unit: str
    true: float
    estimate: float
    low: float
    high: float


def measured(rtol: float = 1e-9) -> dict[str, dict[str, np.ndarray]]:
    """The measurements of each case."""
    solution = simulate(TRUE, TIMES[-1], save=TIMES, rtol=rtol)
    noise = np.random.default_rng(SEED).standard_normal((len(TIMES), len(NOISE)))
    exact = {name: np.asarray(solution[name]) for name in NOISE}
    noisy = {name: exact[name] + sigma * noise[:, i] for i, (name, sigma) in enumerate(NOISE.items())}
    return dict(zip(CASES, (exact, noisy, noisy), strict=True))


def fits(rtol: float = 1e-9) -> dict[str, Fit[ElectromechanicalActuator]]:
    """The fit of each case; all of them share one compiled program."""
    data = measured(rtol)
    found = {}
    for case in progress(CASES, "identifying"):
        sigma = {} if case == "noise estimated" else NOISE
        experiment = Experiment.of_run(TIMES, data[case], sigma=sigma, name=case, rtol=rtol)
        found[case] = identify(START, FREE, experiment)
    return found


def main(json: Path | None = None, out: Path | None = None, rtol: float = 1e-9) -> list[Row]:
    """Identify, print, and write rows to the file `json`, pictures and a report to the folder `out`."""
    if out is not None:
        require_matplotlib()
    found = fits(rtol)
    rows = [row for case, fit in found.items() for row in _rows(case, fit)]
    print_table("Identified parameters with 95 % confidence intervals", HEADS, map(_cells, rows))
    if json is not None:
        write_json(json, rows)
    if out is not None:
        _report(found, out)
    return rows


def _cells(row: Row) -> tuple[str, ...]:
    """A line of the table, in display units."""
    scale = Scale.of(row.unit)
    numbers = (row.true, row.estimate, row.low, row.high)
    return row.case, row.parameter, scale.unit, *(f"{scale.value(number):.6g}" for number in numbers)


def _rows(case: str, fit: Fit[Any]) -> list[Row]:
    true = parameters(TRUE)
    columns = zip(fit.names, fit.units, fit.estimates.tolist(), fit.low.tolist(), fit.high.tolist(), strict=True)
    return [Row(case, name, unit, float(true[name]), *numbers) for name, unit, *numbers in columns]


def _report(found: dict[str, Fit[Any]], out: Path) -> None:
    from ._output import save
    from ._report import write_report

    noisy = found["noise given"]
    profile = noisy.profile("motor.resistor.R", points=5)
    pictures = {
        "identify": noisy.plot()[0, 0].figure,
        "identify_residuals": noisy.plot_residuals()[0, 0].figure,
        "identify_correlation": noisy.plot_correlation().figure,
        "identify_profile": profile.plot().figure,
    }
    for name, figure in pictures.items():
        save(figure, out, name)
    parts = [(case, str(fit), list(pictures.values()) if fit is noisy else []) for case, fit in found.items()]
    write_report(out, "identify", "Parameters of the RE50 actuator from measurements", parts, __doc__)
