"""Bands that show the modes of components over time, such as sticking and sliding; needs matplotlib."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from ..._extras import Axes
from .columns import Column

HEIGHT = 0.7  # of a band, relative to the distance of the rows


def draw_modes(ax: Axes, times: np.ndarray, modes: Sequence[Column]) -> None:
    """Draw a row for each discrete variable, with a band for each interval in which it has one value."""
    words = list(dict.fromkeys(word for column in modes for _, _, word in _intervals(times, column)))
    for row, column in enumerate(modes):
        for start, end, word in _intervals(times, column):
            style = {"color": f"C{words.index(word)}", "alpha": 0.5, "linewidth": 0.0}
            ax.broken_barh([(start, end - start)], (row - HEIGHT / 2, HEIGHT), **style)
    for number, word in enumerate(words):  # one entry in the legend for each word
        ax.broken_barh([], (0.0, 0.0), color=f"C{number}", alpha=0.5, label=word)
    ax.set_yticks(range(len(modes)), [column.label for column in modes])
    ax.set_ylim(len(modes) - 0.5, -0.5)
    ax.grid(visible=False, axis="y")
    ax.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=5, fontsize="small", frameon=False)


def _intervals(times: np.ndarray, column: Column) -> list[tuple[float, float, str]]:
    """Start, end and name of each interval in which a discrete variable is constant."""
    names, values = column.names or {}, column.values.astype(float).tolist()
    edges = [0, *(np.flatnonzero(np.diff(column.values)) + 1).tolist(), len(times) - 1]
    return [
        (float(times[start]), float(times[end]), names.get(values[start], f"{values[start]:g}"))
        for start, end in pairwise(edges)
    ]
