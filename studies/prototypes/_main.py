"""`python -m studies prototypes`."""

import dataclasses
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from acausal.design import Fit

from .._output import ACTUATOR_NAMES, plain_table, print_table, progress, require_matplotlib, save, write_json
from ._cases import CASES, Case, fit
from ._dead_time import EXPLANATIONS, record
from ._dead_time import fit as fit_dead_time
from ._proposals import GRID, Proposal, Separation, dead_time, of_records, re50, separations

# Tables 8.1 to 8.3 of the thesis, and the data sheets' torque constants.
THESIS: Mapping[str, Mapping[str, float]] = {
    "ema_fise": {"motor.resistor.R": 0.133, "motor.bearing.C": 16e-4, "line.damping": 6.8e11, "seal.C": 2e-3},
    "ema_maxon": {
        "motor.resistor.R": 0.309, "motor.bearing.C": 4e-3, "line.damping": 6.8e11, "seal.C": 2e-3,
        "motor.emf.k": 0.0385,
    },
    "ehs_maxon": {"motor.resistor.R": 0.4, "motor.bearing.C": 4e-3, "line.damping": 6.8e11, "seal.C": 2e-3},
}  # fmt: skip
OPEN = 0.5  # relative standard deviation from which a combination of parameters counts as left open
HEADS = ("prototype", "case", "parameter", "unit", "thesis", "estimate", "low", "high")
MEETING_HEADS = ("prototype", "case", "measurement", "unit", "measured", "sigma", "fitted", "in sigma")
PROPOSAL_HEADS = ("subject", "measurement", "unit", "noise", "explanation", "predicted")
SEPARATION_HEADS = ("subject", "measurement", "explanations", "distance in sigma")


@dataclasses.dataclass(frozen=True)
class Row:
    """An identified parameter with its interval of 95 %, in SI units; the thesis' value where it has one."""

    prototype: str
    case: str
    parameter: str
    unit: str
    thesis: float | None
    estimate: float
    low: float
    high: float


@dataclasses.dataclass(frozen=True)
class Meeting:
    """How a fit meets a measurement."""

    prototype: str
    case: str
    measurement: str
    unit: str
    measured: float
    sigma: float
    fitted: float

    @property
    def distance(self) -> float:
        return (self.fitted - self.measured) / self.sigma


def main(json: Path | None = None, out: Path | None = None, rtol: float = 1e-9) -> None:
    """Fit, print, and write tables to the file `json`, and pictures and a report to the folder `out`.

    Fits run at a tolerance of their own, 1e-7: what was measured is known to some percent.
    """
    del rtol
    if out is not None:
        require_matplotlib()
    fits = {case: fit(case) for case in progress(CASES, "identifying")}
    late = {name: fit_dead_time(name) for name in progress(list(EXPLANATIONS), "explaining the dead time")}
    found = [(case.actuator, case.name, item) for case, item in fits.items()]
    found += [("ehs_maxon", f"dead time: {name}", item) for name, item in late.items()]
    rows = [row for place in found for row in _rows(*place)]
    meetings = [meeting for place in found for meeting in _meetings(*place)]
    competing = {case.name: item.model for case, item in _competing(fits).items()}
    records = {name: record(item.model, GRID) for name, item in late.items()}
    proposals = [*re50(competing), *dead_time({name: item.model for name, item in late.items()})]
    distances = [*separations(proposals), *of_records(records)]
    tables = (
        ("Identified parameters, intervals of 95 %", HEADS, list(_cells(rows))),
        ("What the fits make of the measurements", MEETING_HEADS, list(_meeting_cells(meetings))),
        ("What was not measured, as the explanations predict it", PROPOSAL_HEADS, list(_proposal_cells(proposals))),
        ("How far apart the explanations are", SEPARATION_HEADS, list(_separation_cells(distances))),
    )
    for table in tables:
        print_table(*table)
    print(_left_open(found))
    if json is not None:
        write_json(json, rows, meetings=meetings, proposals=proposals, separations=distances)
    if out is not None:
        parts = [(title, plain_table(heads, cells)) for title, heads, cells in tables]
        _draw(out, fits, records, proposals, [*parts, ("What the data leave open", _left_open(found))])


def _competing(fits: Mapping[Case, Fit[Any]]) -> dict[Case, Fit[Any]]:
    """Those of the RE50 that were given all its data, and can meet them."""
    return {case: item for case, item in fits.items() if case.actuator == "ema_maxon" and len(case.free) == 3}


def _rows(prototype: str, case: str, fit: Fit[Any]) -> Iterable[Row]:
    for name, unit, *numbers in zip(fit.names, fit.units, fit.estimates, fit.low, fit.high, strict=True):
        thesis = THESIS[prototype].get(name.split(",")[0])
        yield Row(prototype, case, name, unit, thesis, *map(float, numbers))


def _meetings(prototype: str, case: str, fit: Fit[Any]) -> Iterable[Meeting]:
    for channel in fit.channels:
        fitted, sigma = fit.predicted[channel.label][0], fit.sigma[channel.label][0]
        measured = float(channel.measured.ravel()[0])
        yield Meeting(prototype, case, channel.label, channel.unit, measured, float(sigma), float(fitted))


def _cells(rows: list[Row]) -> Iterable[tuple[str, ...]]:
    for row in rows:
        thesis = "-" if row.thesis is None else f"{row.thesis:.4g}"
        numbers = (f"{value:.4g}" for value in (row.estimate, row.low, row.high))
        yield ACTUATOR_NAMES[row.prototype], row.case, row.parameter, row.unit, thesis, *numbers


def _meeting_cells(meetings: list[Meeting]) -> Iterable[tuple[str, ...]]:
    for row in meetings:
        numbers = (f"{value:.4g}" for value in (row.measured, row.sigma, row.fitted))
        name = ACTUATOR_NAMES[row.prototype]
        yield name, row.case, row.measurement, row.unit, *numbers, f"{row.distance:+.2f}"


def _proposal_cells(proposals: list[Proposal]) -> Iterable[tuple[str, ...]]:
    for row in proposals:
        yield row.subject, row.measurement, row.unit, f"{row.noise:g}", row.explanation, f"{row.predicted:.4g}"


def _separation_cells(distances: list[Separation]) -> Iterable[tuple[str, ...]]:
    for row in distances:
        yield row.subject, row.measurement, row.explanations, f"{row.distance:.1f}"


def _left_open(found: list[tuple[str, str, Fit[Any]]]) -> str:
    """The sum of squares of each fit, and the directions in which the data say next to nothing."""
    lines = []
    for prototype, case, item in found:
        said = [str(combination) for combination in item.combinations if combination.std >= OPEN]
        chi2 = f"chi2 {item.chi2:.3g} with {item.dof} degrees of freedom"
        lines.append(f"{ACTUATOR_NAMES[prototype]}, {case}: {chi2}" + "".join(f"\n    {line}" for line in said))
    return "\n".join(lines)


def _draw(out: Path, fits: Any, records: Any, proposals: list[Proposal], parts: list[tuple[str, str]]) -> None:
    from .._report import write_report
    from ._plot import plot_dead_time, plot_plane, plot_proposals

    competing = {case.name: item for case, item in fits.items() if case.actuator == "ema_maxon"}
    pictures = {
        "prototypes_re50": plot_plane(competing),
        "prototypes_re50_proposals": plot_proposals(proposals, "RE50"),
        "prototypes_dead_time": plot_dead_time(records),
        "prototypes_dead_time_proposals": plot_proposals(proposals, "dead time"),
    }
    for name, figure in pictures.items():
        save(figure, out, name)
    title = "The prototypes: what their measurements tell"
    write_report(
        out, "prototypes", title, [("Pictures", "", list(pictures.values())), *((*part, []) for part in parts)]
    )
