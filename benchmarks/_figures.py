"""Diagrams, drawn with matplotlib where it is installed."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from ._precision import Curve


def work_precision(curves: Sequence[Curve], path: Path) -> None:
    """Time over error, both logarithmic."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(6.5, 4.2), layout="constrained")
    for curve in curves:
        style = "o-" if curve.name.startswith("acausal") else "s--"
        axes.loglog(np.maximum(curve.errors, 1e-14), curve.times * 1e3, style, ms=4, label=curve.name)
    axes.invert_xaxis()
    axes.set(xlabel="relative error of the opening time", ylabel="time of a run [ms]")
    axes.grid(which="both", alpha=0.25)
    axes.legend(fontsize="small")
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=160)
    plt.close(figure)


def scaling(lengths: Sequence[int], times: Mapping[str, Sequence[float]], path: Path) -> None:
    """Times over the length of a chain, both logarithmic."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(6.5, 4.2), layout="constrained")
    for name, seconds in times.items():
        axes.loglog(lengths, seconds, "o-" if "array" in name else "s--", ms=4, label=name)
    axes.set(xlabel="inertias in the chain", ylabel="time [s]")
    axes.grid(which="both", alpha=0.25)
    axes.legend(fontsize="small", ncols=2)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=160)
    plt.close(figure)
