"""`python -m studies prototypes`."""

import functools as ft
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

from acausal import Table
from acausal.design import Fit

from .._compile import compiled_quickly
from .._output import print_table, progress, require_matplotlib, save
from ..actuators import ClutchActuator
from ._cases import CASES, Case, fit
from ._dead_time import EXPLANATIONS, REFUTED, record
from ._dead_time import fit as fit_dead_time
from ._proposals import GRID, of_dead_time, of_re50, predictions, proposals, separations
from ._tables import Tables

ABOUT = """Meloni's thesis (Torino, 2012) measured opening times, peak and holding currents of three clutch actuators.
Two open the clutch by motor, gearbox, cam and master cylinder (EMA), one by motor and pump (EHS).

The study identifies the parameters in tables 8.1 to 8.3 of the thesis from these measurements, with confidence
intervals. If the data do not decide between explanations, it names the measurements that would.
"""
BLURRED = (
    "Predictions of measurements that were not made, by explanation. Thick bars are two standard deviations of\n"
    "the noise, thin bars with caps those of noise and parameters combined. If the thin bars overlap, the\n"
    "measurement does not discriminate between the explanations."
)
SHOWN: Mapping[str, tuple[str, str]] = MappingProxyType(
    {
        "prototypes_re50": (
            "RE50: resistance and friction",
            "On each line, the model has the measured opening time; in each band, the measured peak current. With\n"
            "viscous friction only, they intersect far from Table 8.2. Fits that include the holding current have\n"
            "a third parameter and lie beside the lines.",
        ),
        "prototypes_re50_proposals": (
            "RE50: proposed measurements",
            BLURRED,
        ),
        "prototypes_dead_time": (
            "EHS: the dead time of 30 ms",
            "Four explanations, each fitted to opening time, dead time and peak current.",
        ),
        "prototypes_dead_time_proposals": (
            "EHS: proposed measurements",
            BLURRED,
        ),
    }
)


@compiled_quickly()
def main(json: Path | None = None, out: Path | None = None, rtol: float = 1e-9) -> None:
    """Fit, print, and write tables to the file `json`, and pictures and a report to the folder `out`.

    Fits use a tolerance of 1e-7, because the measurements are accurate to a few per cent only.
    """
    del rtol
    if out is not None:
        require_matplotlib()
    fits = {case: fit(case) for case in progress(CASES, "identifying")}
    late = {name: fit_dead_time(name) for name in progress(list(EXPLANATIONS), "explaining the dead time")}
    found = [(case.actuator, case.name, item) for case, item in fits.items()]
    refuted = {name: fit_dead_time(name) for name in REFUTED}
    found += [("ehs_maxon", f"dead time: {name}", item) for name, item in {**late, **refuted}.items()]
    competing = {case.name.removeprefix("all data, "): item for case, item in _competing(fits).items()}
    open_questions = {
        "RE50": predictions(competing, dict.fromkeys(competing, of_re50)),
        "dead time": predictions(late, {name: ft.partial(of_dead_time, name) for name in late}),
    }
    tables = Tables.of(
        found,
        [item for subject, predicted in open_questions.items() for item in proposals(subject, predicted)],
        [item for subject, predicted in open_questions.items() for item in separations(subject, predicted)],
    )
    records = {name: record(item.model, GRID) for name, item in late.items()}
    for table in tables.all():
        print_table(*table)
    if json is not None:
        tables.write(json)
    if out is not None:
        _draw(out, fits, records, tables)


def _competing(fits: Mapping[Case, Fit[ClutchActuator]]) -> dict[Case, Fit[ClutchActuator]]:
    """The fits of the RE50 to all data with a third parameter."""
    return {case: item for case, item in fits.items() if case.actuator == "ema_maxon" and len(case.free) == 3}


def _draw(out: Path, fits: Mapping[Case, Fit[ClutchActuator]], records: Any, tables: Tables) -> None:
    from .._report import write_report
    from ._plot import plot_dead_time, plot_plane, plot_proposals

    competing = {case.name: item for case, item in fits.items() if case.actuator == "ema_maxon"}
    pictures = {
        "prototypes_re50": plot_plane(competing),
        "prototypes_re50_proposals": plot_proposals(tables.proposals, "RE50"),
        "prototypes_dead_time": plot_dead_time(records),
        "prototypes_dead_time_proposals": plot_proposals(tables.proposals, "dead time"),
    }
    for name, figure in pictures.items():
        save(figure, out, name)
    parts = [(table[0], Table(*table[1:]), []) for table in tables.all()]
    parts += [(*SHOWN[name], [figure]) for name, figure in pictures.items()]
    write_report(out, "prototypes", "Parameters of three prototypes from measurements", parts, ABOUT)
