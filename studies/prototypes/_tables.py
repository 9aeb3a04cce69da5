"""Tables of the study, in display units."""

import dataclasses
import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from acausal import display_unit, displayed
from acausal.design import Combination, Fit

from .._output import ACTUATOR_NAMES, plain_table, read_json, write_json
from ..actuators import ClutchActuator
from ._proposals import Proposal, Separation

# Tables 8.1 to 8.3 of the thesis, and the data sheets' torque constants.
THESIS: Mapping[str, Mapping[str, float]] = {
    "ema_fise": {"motor.resistor.R": 0.133, "motor.bearing.C": 16e-4, "line.damping": 6.8e11, "seal.C": 2e-3},
    "ema_maxon": {
        "motor.resistor.R": 0.309, "motor.bearing.C": 4e-3, "line.damping": 6.8e11, "seal.C": 2e-3,
        "motor.emf.k": 0.0385,
    },
    "ehs_maxon": {"motor.resistor.R": 0.4, "motor.bearing.C": 4e-3, "line.damping": 6.8e11, "seal.C": 2e-3},
}  # fmt: skip
OPEN = 0.5  # relative standard deviation above which a combination of parameters is undetermined
STORED = Path(__file__).parent / "rows.json"

Table = tuple[str, tuple[str, ...], list[tuple[str, ...]]]  # title, heads, cells


@dataclasses.dataclass(frozen=True)
class Row:
    """An identified parameter with its 95 % confidence interval and its value in the thesis, in SI units."""

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
    """A measurement compared with its fitted value."""

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


@dataclasses.dataclass(frozen=True)
class Outcome:
    """The sum of squares of a fit, and the combinations of parameters that the data do not determine."""

    prototype: str
    case: str
    chi2: float
    dof: int
    left_open: list[str]


@dataclasses.dataclass(frozen=True)
class Tables:
    """All tables of the study."""

    rows: list[Row]
    meetings: list[Meeting]
    outcomes: list[Outcome]
    proposals: list[Proposal]
    separations: list[Separation]

    @classmethod
    def of(
        cls,
        found: Sequence[tuple[str, str, Fit[ClutchActuator]]],
        proposals: list[Proposal],
        separations: list[Separation],
    ) -> "Tables":
        """The tables of fits, each given with its prototype and case."""
        return cls(
            [row for place in found for row in _rows(*place)],
            [meeting for place in found for meeting in _meetings(*place)],
            [_outcome(*place) for place in found],
            proposals,
            separations,
        )

    def estimates(self) -> Table:
        """The identified parameters."""
        heads = ("prototype", "case", "parameter", "unit", "thesis", "estimate", "low", "high")
        cells = [
            (*_place(row), row.parameter, *_numbers(row.unit, row.thesis, row.estimate, row.low, row.high))
            for row in self.rows
        ]
        return "Identified parameters with 95 % confidence intervals", heads, cells

    def met(self) -> Table:
        """The measurements and their fitted values."""
        heads = ("prototype", "case", "measurement", "unit", "measured", "sigma", "fitted", "in sigma")
        cells = [
            (
                *_place(row), row.measurement, *_numbers(row.unit, row.measured, row.sigma, row.fitted),
                f"{row.distance:+.2f}",
            )
            for row in self.meetings
        ]  # fmt: skip
        return "Measurements and fitted values", heads, cells

    def fits(self) -> Table:
        """The goodness of fit of each case, and the undetermined combinations."""
        heads = ("prototype", "case", "chi2", "degrees of freedom", "not determined by the data")
        cells = [
            (*_place(row), f"{round(row.chi2, 6):.3g}", f"{row.dof}", "; ".join(row.left_open) or "-")
            for row in self.outcomes
        ]
        return "Goodness of fit, and parameters that the data do not determine", heads, cells

    def predictions(self) -> Table:
        """The predictions of proposed measurements."""
        heads = ("subject", "measurement", "explanation", "unit", "predicted", "noise", "parameters")
        cells = [
            (
                row.subject,
                row.measurement,
                row.explanation,
                *_numbers(row.unit, row.predicted, row.noise, row.spread),
            )
            for row in self.proposals
        ]
        return "Predictions of proposed measurements, with standard deviations", heads, cells

    def distances(self) -> Table:
        """The distances between the explanations."""
        heads = ("subject", "measurement", "explanations", "distance in sigma")
        cells = [(row.subject, row.measurement, row.explanations, f"{row.distance:.1f}") for row in self.separations]
        return "Distances between the explanations", heads, cells

    def all(self) -> list[Table]:
        """All tables, in reading order."""
        return [self.estimates(), self.met(), self.fits(), self.predictions(), self.distances()]

    def write(self, path: Path) -> None:
        """Writes the tables as JSON, in SI units."""
        write_json(path, **{field.name: getattr(self, field.name) for field in dataclasses.fields(self)})


def stored() -> Tables:
    """The tables shown in the documentation, from one run of
    `python -m studies prototypes --json studies/prototypes/rows.json`.
    """
    kinds = dict(rows=Row, meetings=Meeting, outcomes=Outcome, proposals=Proposal, separations=Separation)
    tables: dict[str, list[Any]] = read_json(STORED, **kinds)
    # JSON has no infinity; null stands for it.
    tables["proposals"] = [_unbounded(_unbounded(item, "predicted"), "spread") for item in tables["proposals"]]
    tables["separations"] = [_unbounded(item, "distance") for item in tables["separations"]]
    return Tables(**tables)


def as_text(table: Table) -> str:
    """A table as text, without its title."""
    return plain_table(*table[1:])


def _unbounded(item: Any, name: str) -> Any:
    return dataclasses.replace(item, **{name: math.inf}) if getattr(item, name) is None else item


def _rows(prototype: str, case: str, fit: Fit[ClutchActuator]) -> Iterator[Row]:
    for name, unit, *numbers in zip(fit.names, fit.units, fit.estimates, fit.low, fit.high, strict=True):
        thesis = THESIS[prototype].get(name.split(",")[0])
        yield Row(prototype, case, name, unit, thesis, *map(float, numbers))


def _meetings(prototype: str, case: str, fit: Fit[ClutchActuator]) -> Iterator[Meeting]:
    for channel in fit.channels:
        fitted, sigma = fit.predicted[channel.label][0], fit.sigma[channel.label][0]
        measured = float(channel.measured.ravel()[0])
        yield Meeting(prototype, case, channel.label, channel.unit, measured, float(sigma), float(fitted))


def _outcome(prototype: str, case: str, fit: Fit[ClutchActuator]) -> Outcome:
    said = [_said(combination) for combination in fit.combinations if combination.std >= OPEN]
    return Outcome(prototype, case, float(fit.chi2), int(fit.dof), said)


def _said(combination: Combination) -> str:
    """The combination as text; in words if it has one parameter."""
    alone = [name for name, share in combination.shares.items() if abs(share) > 0.99]
    return f"{alone[0]}, known to {combination.std:.0%}" if alone else str(combination)


def _place(row: Row | Meeting | Outcome) -> tuple[str, str]:
    return ACTUATOR_NAMES[row.prototype], row.case


def _numbers(unit: str, *values: float | None) -> tuple[str, ...]:
    """The display unit, and the values in this unit."""
    return display_unit(unit), *("-" if value is None else f"{displayed(value, unit)[0]:.4g}" for value in values)
