"""Widgets of the app."""

import io
from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

import marimo as mo

from ..._errors import AcausalError
from .._problem.free import Free
from .charts import charts
from .explored import Explored
from .explorer import Explorer
from .html import table
from .sliders import positions


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
