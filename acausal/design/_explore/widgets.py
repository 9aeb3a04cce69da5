"""Widgets of the app: sliders, tables, and charts of curves as specifications of Vega-Lite, which a browser draws."""

import io
import json
from collections.abc import Iterator, Mapping, Sequence
from html import escape
from typing import Any

import marimo as mo
import numpy as np

from ..._errors import AcausalError
from ..._integrate.results.columns import Column
from .._problem.free import Free
from .explored import Explored
from .explorer import Explorer, table

COUNT = 101  # positions between the bounds


def positions(free: Free, x: Sequence[float]) -> list[dict[float, float]]:
    """The positions of the slider of each parameter: numbers as shown, and the values in the declared unit.

    They lie between the bounds, evenly or logarithmically spaced like the scaled variables, with four digits, and
    include the bounds and the values `x`.
    """
    shares = np.linspace(0.0, 1.0, COUNT)[:, None] * np.ones(len(free.variables))
    columns = np.asarray([free.unscaled(row) for row in shares]).T
    found = []
    for variable, column, value in zip(free.variables, columns, x, strict=True):
        scale = variable.scale
        rounded = [float(f"{number:.4g}") for number in scale.value(column).tolist()]
        made = {number: scale.zero + scale.factor * number for number in rounded}
        exact = {float(f"{scale.value(one):.7g}"): one for one in (variable.low, variable.high, value)}
        inside = {number: one for number, one in made.items() if variable.low < one < variable.high}
        found.append(dict(sorted((inside | exact).items())))
    return found


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
    for name, values in column.curves(column.label):
        for time, value in zip(times, values.tolist(), strict=True):
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


def sliders(free: Free, values: Mapping[str, float]) -> list[Any]:
    """A slider for each parameter, at the given values."""
    x = [values[name] for name in free.names]
    return [
        mo.ui.slider(
            steps=list(places), value=next(shown for shown, one in places.items() if one == here),
            label=escape(variable.scale.headed(variable.name)), show_value=True, full_width=True,
        )
        for variable, places, here in zip(free.variables, positions(free, x), x, strict=True)
    ]  # fmt: skip


def chosen(free: Free, values: Mapping[str, float], shown: Sequence[float]) -> dict[str, float]:
    """The values at the positions of the sliders that `values` made."""
    places = positions(free, [values[name] for name in free.names])
    return {name: those[one] for name, those, one in zip(free.names, places, shown, strict=True)}


def optimum(
    explorer: Explorer[Any], now: Explored[Any], result: str, varied: Sequence[bool]
) -> tuple[dict[str, float], str]:
    """The values of the optimum and its certificate; if there is none, the present values and the reason."""
    names = [name for name, is_varied in zip(explorer.free.names, varied, strict=True) if is_varied]
    try:
        design = explorer.optimum(now.values, result, names)
    except AcausalError as error:
        return now.values, str(error)
    return now.values | design.values, str(design)


def inputs(now: Explored[Any], sliders: Any, varied: Any, result: str) -> list[Any]:
    """The sliders, each with the gradient of a result and the choice whether the search varies it."""
    unit, rows = "", []
    if now.results:
        unit, rows = now[result].scale.text, now.gradient_rows(result)
    found: list[Any] = []
    for i, (slider, choice, variable) in enumerate(zip(sliders, varied, now.free.variables, strict=True)):
        said = f"+1{variable.scale.text}: {rows[i][2]}{unit}; +1 %: {rows[i][3]}{unit}" if rows else ""
        note = mo.Html(f'<small style="color:#555">{escape(said)}</small>')
        found += [slider, mo.hstack([note, choice], justify="space-between")]
    return found


def outputs(now: Explored[Any], start: Explored[Any]) -> list[Any]:
    """The message of a failure, the results with those of the start, and the curves over those of the start."""
    found: list[Any] = [mo.callout(now.message, kind="danger")] if now.message else []
    if now.results:
        before = {one.name: one.text for one in start.results}
        rows = [(name, value, before.get(name, ""), *rest) for name, value, *rest in now.result_rows()]
        found.append(mo.Html(table(("result", "now", "start", "limit", "margin", ""), rows, now.broken)))
    return [*found, *charts(now, start)]


def energy(now: Explored[Any], is_wanted: bool) -> Any:
    """The energy account of the run."""
    return text(str(now.solution.energy)) if is_wanted and now.solution is not None else mo.Html("")


def text(said: str) -> Any:
    """A text with its line breaks, as entities because marimo joins lines."""
    lines = escape(said).replace("\n", "&#10;")
    return mo.Html(f'<pre style="overflow-x:auto;font-size:0.8rem">{lines}</pre>' if said else "")


def downloads(now: Explored[Any]) -> Any:
    """Buttons that save the design and its curves."""

    def picture(kind: str) -> bytes:
        content = io.BytesIO()
        now.figure().savefig(content, format=kind)
        return content.getvalue()

    return mo.hstack(
        [
            mo.download(lambda: now.to_json().encode(), "design.json", "application/json", label="Design (JSON)"),
            mo.download(lambda: picture("png"), "curves.png", "image/png", label="Curves (PNG)"),
            mo.download(lambda: picture("svg"), "curves.svg", "image/svg+xml", label="Curves (SVG)"),
        ],
        justify="start",
        wrap=True,
    )


def columns(left: Any, right: Any) -> Any:
    """Two columns, which a narrow window puts below each other."""
    parts = ((left, "1 1 18rem"), (right, "2 1 24rem"))
    content = "".join(f'<div style="flex:{flex};min-width:0">{part}</div>' for part, flex in parts)
    return mo.Html(f'<div style="display:flex;flex-wrap:wrap;gap:2rem">{content}</div>')
