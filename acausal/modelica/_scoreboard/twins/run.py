"""The comparison of circuits made twice."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from ...._integrate.simulate import simulate
from ..._load import load
from ..._translate.tree import attribute_path
from . import electrics, heat_and_signals, mechanics
from .twin import Twin

RTOL = 1e-9
MOST = 1e-6  # deviation of a signal, relative to its range, up to which twins agree
TIMES = 201


def run_twins(roots: Sequence[str | Path]) -> dict[str, dict[str, float]]:
    """Runs all circuits; prints and returns the deviations of their signals."""
    found = {}
    for twin in (*mechanics.twins(), *electrics.twins(), *heat_and_signals.twins()):
        found[twin.name] = deviations(twin, roots)
        signals = ", ".join(f"{name} {value:.1g}" for name, value in found[twin.name].items())
        print(
            f"{twin.name}: {'differs' if differing({twin.name: found[twin.name]}) else 'agrees'}; {signals}", flush=True
        )
    return found


def deviations(twin: Twin, roots: Sequence[str | Path]) -> dict[str, float]:
    """The largest distance between the two runs for each signal, relative to its range. NaN counts as infinite."""
    times = np.linspace(0.0, twin.stop, TIMES)
    theirs = simulate(load(twin.text, twin.name, roots), twin.stop, save=times, rtol=RTOL)
    ours = simulate(twin.ours, twin.stop, save=times, rtol=RTOL)
    found = {}
    for name, own in twin.signals.items():
        a, b = np.asarray(theirs[attribute_path(name)]), np.asarray(ours[own])
        size = float(np.ptp(a)) or max(float(np.max(np.abs(a))), 1.0)
        found[name] = float(np.max(np.nan_to_num(np.abs(a - b), nan=np.inf))) / size
    return found


def differing(found: Mapping[str, Mapping[str, float]]) -> list[str]:
    """The circuits with a signal that deviates by more than `MOST`."""
    return [name for name, own in found.items() if any(not value <= MOST for value in own.values())]
