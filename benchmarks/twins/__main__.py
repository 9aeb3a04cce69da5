"""The comparison of circuits made twice: `python -m benchmarks.twins --help`."""

import argparse
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from acausal import modelica, simulate

from . import electrics, heat_and_signals, mechanics
from .twin import Twin

RTOL = 1e-9
MOST = 1e-6  # deviation of a signal, relative to its range, up to which twins agree
TIMES = 201


def main(arguments: Sequence[str] | None = None) -> int:
    """Run all circuits, print the deviations of their signals, and return 1 if one differs."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.twins", description="Compare components with those of the Modelica Standard Library."
    )
    parser.add_argument("--roots", action="append", required=True, help="the folder with the library")
    roots = parser.parse_args(arguments).roots
    found = {}
    for twin in (*mechanics.twins(), *electrics.twins(), *heat_and_signals.twins()):
        found[twin.name] = deviations(twin, roots)
        signals = ", ".join(f"{name} {value:.1g}" for name, value in found[twin.name].items())
        print(f"{twin.name}: {'differs' if differs(found[twin.name]) else 'agrees'}; {signals}", flush=True)
    return int(any(map(differs, found.values())))


def deviations(twin: Twin, roots: Sequence[str | Path]) -> dict[str, float]:
    """The largest distance between the two runs for each signal, relative to its range. NaN counts as infinite."""
    times = np.linspace(0.0, twin.stop, TIMES)
    theirs = simulate(modelica.load(twin.text, twin.name, roots), twin.stop, save=times, rtol=RTOL)
    ours = simulate(twin.ours, twin.stop, save=times, rtol=RTOL)
    found = {}
    for name, own in twin.signals.items():
        a, b = np.asarray(theirs[name]), np.asarray(ours[own])
        size = float(np.ptp(a)) or max(float(np.max(np.abs(a))), 1.0)
        found[name] = float(np.max(np.nan_to_num(np.abs(a - b), nan=np.inf))) / size
    return found


def differs(signals: Mapping[str, float]) -> bool:
    """Whether one of the deviations is larger than `MOST`."""
    return any(not value <= MOST for value in signals.values())


if __name__ == "__main__":
    sys.exit(main())
