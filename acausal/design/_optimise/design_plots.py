"""Pictures of an optimisation and of a Pareto front."""

from typing import Any

import numpy as np

from ..._extras import Axes, Figure, given_or_new, needed
from .design import Design
from .entries import Tried
from .pareto import Front

LEAST = -1.0  # smallest margin to draw: a start can violate its limits by far


def plot_design(design: Design[Any]) -> Figure:
    """Objective, variables between their bounds, and margins of the limits, over the steps of the search."""
    plt = needed("matplotlib.pyplot", "plots", "A picture")
    n = 3 if design.results else 2
    figure, axes = plt.subplots(n, 1, figsize=(8.0, 2.6 * n), layout="constrained", sharex=True)
    _plot_objective(design, axes[0])
    _plot_variables(design, axes[1])
    if design.results:
        _plot_margins(design, axes[2])
    for panel in axes:
        panel.grid(alpha=0.3)
        panel.xaxis.get_major_locator().set_params(integer=True)
        if panel is not axes[0]:
            panel.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False, fontsize="small")
    axes[-1].set_xlabel("step")
    return figure


def _plot_objective(design: Design[Any], panel: Axes) -> None:
    scale = design.objective_scale
    feasible = [_is_feasible(design, tried) for tried in design.history]
    values = [scale.value(tried.objective) for tried in design.history]
    panel.plot(values, color="0.6", linewidth=1.0)
    for is_good, colour, label in ((True, "C0", "keeps all limits"), (False, "C3", "breaks a limit")):
        where = [i for i, good in enumerate(feasible) if good is is_good]
        if where:
            panel.plot(where, [values[i] for i in where], "o", color=colour, label=label)
    panel.set_ylabel(scale.headed(design.objective_name))
    panel.set_title(f"{design.status}: {design._objective}, KKT residual {design.kkt_residual:.1e}", fontsize="medium")
    panel.legend(frameon=False, fontsize="small")


def _plot_variables(design: Design[Any], panel: Axes) -> None:
    z = np.array([np.asarray(design.free.scaled(tried.x)) for tried in design.history])
    for i, variable in enumerate(design.free.variables):
        end = f"{variable.scale.value(design.x[i]):.5g}{variable.scale.text}"
        panel.plot(z[:, i], "o-", markersize=3, label=f"{variable.name} = {end}")
    panel.set_ylabel("between its bounds")
    panel.set_ylim(-0.05, 1.05)


def _plot_margins(design: Design[Any], panel: Axes) -> None:
    active = {active.name for active in design.active}
    for i, result in enumerate(design.results):
        margins = [result._replace(value=tried.results[i]).margin for tried in design.history]
        label = f"{result.limit.name} {result.limit.text}"
        style = "o-" if result.limit.name in active else "o--"
        panel.plot(100.0 * np.maximum(margins, LEAST), style, markersize=3, label=label)
    panel.axhline(0.0, color="C3", linewidth=1.0)
    panel.set_ylabel("margin [%]")


def _is_feasible(design: Design[Any], tried: Tried) -> bool:
    pairs = zip(design.results, tried.results, strict=True)
    return not any(result._replace(value=value).is_broken for result, value in pairs)


def plot_front(front: Front[Any], ax: Axes | None) -> Axes:
    """The second result over the first one."""
    ax = given_or_new(ax, 6.4, 4.8)
    ax.plot(*(scale.value(column) for scale, column in zip(front.scales, front.values.T, strict=True)), "o-")
    ax.set_xlabel(front.scales[0].headed(front.names[0]))
    ax.set_ylabel(front.scales[1].headed(front.names[1]))
    ax.grid(alpha=0.3)
    return ax
