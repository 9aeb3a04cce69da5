"""A picture of a choice."""

import numpy as np

from ..._extras import Axes, given_or_new
from .choice import Choice


def plot_choice(choice: Choice, ax: Axes | None, beside: dict[str, np.ndarray]) -> Axes:
    """Feasible combinations over two objectives with the front, or ranked by one, with the objectives `beside`."""
    ax = given_or_new(ax, 6.5, 4.2)
    first, second = choice.objectives[0], choice.objectives[1] if len(choice.objectives) > 1 else None
    order = np.array(choice.order, int)
    ranks = np.arange(1, len(order) + 1)
    for number, structure in enumerate(choice.structures):
        own = choice.places[order, 0] == number
        x = first.scale.value(choice.values[order[own], 0])
        y = ranks[own] if second is None else second.scale.value(choice.values[order[own], 1])
        label = ", ".join(filter(None, [structure.name, "feasible"]))
        ax.plot(x, y, ".", color=f"C{number + 2}" if structure.name else "0.6", markersize=4, label=label)
    if second is not None:
        front = choice.values[choice.front]
        places = first.scale.value(front[:, 0]), second.scale.value(front[:, 1])
        ax.plot(*places, "o-", color="tab:blue", markerfacecolor="none", zorder=1, label="front")
    for (name, values), style in zip(beside.items(), ("-", "--", ":", "-.") * len(beside), strict=False):
        if second is not None and len(values) > 1:
            ax.plot(*(o.scale.value(value) for o, value in zip((first, second), values, strict=False)), "*",
                    color="tab:orange", markersize=11, label=name)  # fmt: skip
        else:
            ax.axvline(first.scale.value(values[0]), color="tab:orange", ls=style, label=name)
    ax.set_xlabel(first.scale.headed(first.name))
    ax.set_ylabel("rank" if second is None else second.scale.headed(second.name))
    ax.legend(frameon=False, fontsize="small")
    ax.grid(alpha=0.3)
    return ax
