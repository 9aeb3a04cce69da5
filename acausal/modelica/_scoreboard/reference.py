"""Published reference results of a Modelica library, and the comparison with them."""

import csv
import dataclasses
import re
from pathlib import Path

import numpy as np

from .._errors import ModelicaError

TOLERANCE = 1e-3  # width of the tube around a reference, relative to its range, and in time relative to the run
ROUNDING = 1e-12  # signals that are zero in exact numbers stay below it


@dataclasses.dataclass(frozen=True)
class Reference:
    """The reference result of a model: signals over time, and the names of those to compare."""

    times: np.ndarray
    signals: dict[str, np.ndarray]

    @property
    def end(self) -> float:
        return float(self.times[-1])


def models_in(folder: Path) -> dict[str, Path]:
    """The models with reference results in a folder, each with its own folder."""
    found = sorted(path.parent for path in Path(folder).glob("**/comparisonSignals.txt"))
    return {".".join(path.relative_to(folder).parts): path for path in found}


def read_reference(folder: Path) -> Reference | None:
    """The reference in a folder of a model; None if its file is missing."""
    file = folder / f"{folder.name}.csv"
    if not file.exists():
        return None
    with file.open(newline="") as lines:
        rows = csv.reader(lines)
        names = ["time" if name == "Time" else name for name in next(rows)]
        table = np.array([[float(value) for value in row] for row in rows if row])
    wanted = [name.strip() for name in (folder / "comparisonSignals.txt").read_text().splitlines()]
    columns = {name: table[:, i] for i, name in enumerate(names)}
    return Reference(columns["time"], {n: columns[n] for n in wanted if n != "time" and n in columns})


def interval(folder: Path) -> tuple[float, float]:
    """Start and stop time of a model, from the log of its reference run. Raises `ModelicaError` if it lacks them."""
    file = folder / "creation.txt"
    text = file.read_text(errors="replace") if file.exists() else ""
    found = [re.search(rf"^\s*{name}\s*=\s*([-+.\w]+)", text, re.M) for name in ("StartTime", "StopTime")]
    if None in found:
        raise ModelicaError(f"{folder.name} has no {folder.name}.csv, and no creation.txt with StartTime and StopTime.")
    start, stop = (float(one[1]) for one in found if one)
    return start, stop


def deviation(reference_times: np.ndarray, reference: np.ndarray, times: np.ndarray, values: np.ndarray) -> float:
    """The largest distance of a signal from the tube around its reference, relative to the range of the reference.

    The tube covers all values that the reference takes within `TOLERANCE` of the run before and after, so that the
    instants of jumps may differ by as much. Zero if the signal lies inside this tube. NaN counts as infinite. A range
    below `ROUNDING` is rounding error.
    """
    span = TOLERANCE * (reference_times[-1] - reference_times[0])
    low = np.searchsorted(reference_times, times - span, side="left")
    high = np.searchsorted(reference_times, times + span, side="right")
    size = max(float(np.ptp(reference)) or float(np.max(np.abs(reference))), ROUNDING)
    worst = 0.0
    for t, value, first, last in zip(times, values, low, high, strict=True):
        if not np.isfinite(value):
            return float("inf")
        ends = np.interp([t - span, t + span], reference_times, reference)
        inside = reference[first:last]
        bottom, top = min(ends.min(), inside.min(initial=np.inf)), max(ends.max(), inside.max(initial=-np.inf))
        worst = max(worst, bottom - value, value - top)
    return worst / size
