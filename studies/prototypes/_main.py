"""`python -m studies prototypes`."""

import functools as ft
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

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
Two push the clutch open by motor, gearbox, cam and master cylinder (EMA), one by motor and pump (EHS).

From these measurements the parameters of the model are identified that the thesis has in its tables 8.1 to 8.3, with
intervals. Where they do not decide between explanations, it is told which measurement would.
"""
BLURRED = (
    "What each explanation predicts of measurements that were not made. Thick bars are two sigma of their noise, thin\n"
    "ones with caps of noise and parameters together: where these overlap, the measurement would not tell."
)
SHOWN: Mapping[str, tuple[str, str]] = MappingProxyType(
    {
        "prototypes_re50": (
            "RE50: resistance and friction",
            "On each line the model opens in the measured time; in each band it has the measured peak current.\n"
            "With viscous friction alone all meet far from Table 8.2. Fits to the current of the held clutch, too,\n"
            "have a third parameter and lie beside the lines.",
        ),
        "prototypes_re50_proposals": (
            "RE50: what would have to be measured",
            BLURRED,
        ),
        "prototypes_dead_time": (
            "EHS: the dead time of 30 ms",
            "Four explanations, each fitted to opening time, dead time and peak current, as they would be recorded.",
        ),
        "prototypes_dead_time_proposals": (
            "EHS: what would have to be measured",
            BLURRED,
        ),
    }
)


@compiled_quickly()
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
    """Those of the RE50 that were given all its data, and can meet them."""
    return {case: item for case, item in fits.items() if case.actuator == "ema_maxon" and len(case.free) == 3}


def _draw(out: Path, fits: Mapping[Case, Fit[ClutchActuator]], records: Any, tables: Tables) -> None:
    from .._report import Table as Shown
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
    parts = [(table[0], Shown(*table[1:]), []) for table in tables.all()]
    parts += [(*SHOWN[name], [figure]) for name, figure in pictures.items()]
    write_report(out, "prototypes", "The prototypes: what their measurements tell", parts, ABOUT)
