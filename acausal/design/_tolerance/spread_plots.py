"""Pictures of the distribution of a result and of its Sobol' indices."""

from typing import Any

import numpy as np

from ..._extras import Axes, given_or_new
from .sobol_indices import Indices
from .spread import Spread


def plot_spread(spread: Spread, ax: Axes | None, limits: Any) -> Axes:
    """A histogram beside the normal distribution of the same mean and standard deviation, with `limits`."""
    ax = given_or_new(ax, 6.5, 3.6)
    mean, std = spread.scale.value(spread.mean), spread.scale.difference(spread.std)
    if len(spread.samples):
        bins = int(np.clip(np.sqrt(len(spread.samples)), 10, 60))
        ax.hist(spread.scale.value(spread.samples), bins=bins, density=True, color="tab:blue", alpha=0.45)
    x = np.linspace(mean - 4.0 * std, mean + 4.0 * std, 200)
    normal = np.exp(-0.5 * ((x - mean) / std) ** 2) / (std * np.sqrt(2.0 * np.pi))
    ax.plot(x, normal, color="0.3", linewidth=1.0, label="normal")
    for p, label in ((1.0, "1 % and 99 %"), (99.0, "")):
        ax.axvline(spread.scale.value(spread.percentile(p)), color="tab:blue", linewidth=1.0, ls="--", label=label)
    for number, limit in enumerate(np.ravel(limits)):
        ax.axvline(spread.scale.value(limit), color="tab:red", linewidth=1.5, label="" if number else "limit")
    ax.set_xlabel(spread.scale.headed(spread.result))
    ax.set_ylabel(f"density per{spread.scale.text}" if spread.scale.text else "density")
    ax.legend(frameon=False, fontsize="small")
    lost = f", {sum(spread.failed.values())} failed" if spread.failed else ""
    ax.set_title(f"{spread.method}: {mean:.5g} ± {std:.3g}{spread.scale.text}{lost}", fontsize="medium")
    return ax


def plot_indices(indices: Indices, ax: Axes | None, result: str) -> Axes:
    """Bars of both indices of one result with their errors, the largest on top."""
    row = indices.results.index(result) if result else 0
    order = np.argsort(indices.total[row])
    ax = given_or_new(ax, 7.0, 1.4 + 0.45 * len(order))
    places = np.arange(len(order))
    for shift, values, errors, label, colour in (
        (0.2, indices.total, indices.total_error, "in total", "tab:blue"),
        (-0.2, indices.first, indices.first_error, "alone", "tab:orange"),
    ):
        bars = values[row, order]
        ax.barh(places + shift, bars, 0.38, xerr=2.0 * errors[row, order], label=label, color=colour, ecolor="0.3")
    ax.set_yticks(places, [indices.parameters[i] for i in order])
    ax.set_xlabel(f"share of the variance of {indices.results[row]}")
    ax.legend(frameon=False, fontsize="small", loc="lower right")
    ax.grid(axis="x", alpha=0.3)
    return ax
