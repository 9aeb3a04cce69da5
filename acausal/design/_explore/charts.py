"""Charts of curves as specifications of Vega-Lite, which a browser draws."""

import json
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from ..._integrate.results.columns import Column
from .explored import Explored

HEIGHT = 150  # of a panel, in pixels
IS_START = "datum.design === 'start'"


class Chart:
    """A chart that a notebook shows."""

    def __init__(self, specification: dict[str, Any]) -> None:
        self.specification = specification

    def _mime_(self) -> tuple[str, str]:
        """The protocol of marimo."""
        return "application/vnd.vegalite.v6+json", json.dumps(self.specification)


def charts(now: Explored[Any], start: Explored[Any]) -> list[Chart]:
    """The curves of a design over those of the start, which are dashed; a chart for each unit."""
    pairs = [(start, "start"), (now, "now")]
    found = [(explored, design, column) for explored, design in pairs for column in explored._columns]
    units = list(dict.fromkeys(column.unit for _, _, column in found))
    end = max((float(np.asarray(explored.solution.ts)[-1]) for explored, _ in pairs if explored.solution), default=0.0)
    return [
        _chart(
            unit,
            [row for one, design, column in found if column.unit == unit for row in _rows(one, design, column)],
            end,
        )
        for unit in units
    ]


def _rows(explored: Explored[Any], design: str, column: Column) -> Iterator[dict[str, Any]]:
    """The points of a curve in order; an array variable has one curve for each element."""
    assert explored.solution is not None
    times = np.asarray(explored.solution.ts).tolist()
    for place in np.ndindex(column.values.shape[1:]):
        name = column.label + (f"[{', '.join(map(str, place))}]" if place else "")
        for time, value in zip(times, column.values[(slice(None), *place)].tolist(), strict=True):
            yield {"t": time, "y": value, "curve": name, "design": design}


def _chart(unit: str, rows: Sequence[dict[str, Any]], end: float) -> Chart:
    names = list(dict.fromkeys(row["curve"] for row in rows))
    head = f"{names[0]} " if len(names) == 1 else ""
    colour = {
        "field": "curve",
        "type": "nominal",
        "title": None,
        "legend": {"orient": "top"} if len(names) > 1 else None,
    }
    dash = {"condition": {"test": IS_START, "value": [4, 4]}, "value": [1, 0]}
    return Chart(
        {
            "$schema": "https://vega.github.io/schema/vega-lite/v6.json",
            "width": "container", "height": HEIGHT, "data": {"values": list(rows)}, "mark": {"type": "line"},
            "encoding": {
                "x": {
                    "field": "t", "type": "quantitative", "title": "time [s]", "scale": {"domain": [0.0, end]},
                    "axis": {"tickCount": 6},
                },
                "y": {
                    "field": "y", "type": "quantitative", "title": f"{head}[{unit}]" if unit else head,
                    "axis": {"minExtent": 45, "tickCount": 5},
                },
                "color": {"condition": {"test": IS_START, "value": "#9a9a9a"}, **colour},
                "strokeDash": dash,
                "detail": {"field": "design"},
                "order": {"value": None},
            },
        }
    )  # fmt: skip
