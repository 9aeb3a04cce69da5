"""HTML reports: well formed, complete, with units, and without anything from elsewhere."""

import base64
import html.parser
import re
from importlib.metadata import version
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _models import rc

from acausal import (
    EventLog,
    ModelError,
    Picture,
    Solution,
    Table,
    diagram,
    parameters,
    quantity,
    replace,
    report,
    simulate,
)
from acausal._integrate.results.solution_report import event_table

pytest.importorskip("matplotlib")
EMPTY = ("meta", "img")  # elements without an end


class Page(html.parser.HTMLParser):
    """Checks that elements nest, and collects headings, the cells of tables by heading, and attributes."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.attributes: list[tuple[str, str | None]] = []
        self.rows: dict[str, list[list[str]]] = {}
        self.heading = ""
        self.feed(text)
        self.close()
        assert not self.open

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.attributes += attrs
        if tag == "tr":
            self.rows.setdefault(self.heading, []).append([])
        elif tag in ("td", "th"):
            self.rows[self.heading][-1].append("")
        elif tag in ("h2", "h3"):
            self.heading = ""
        if tag not in EMPTY:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        inside = self.open[-1] if self.open else ""
        if inside in ("td", "th"):
            self.rows[self.heading][-1][-1] += data
        elif inside in ("h2", "h3"):
            self.heading += data


def loads_nothing(page: Page) -> bool:
    """Whether all that a page refers to lies in it."""
    sources = [value or "" for name, value in page.attributes if name in ("src", "href", "srcset", "action")]
    return all(value.startswith("data:image/") for value in sources)


@pytest.fixture(scope="module")
def charged() -> Solution[Any]:
    return simulate(rc(), 2.0, energy=True)


def test_report_of_a_solution(charged: Solution[Any], tmp_path: Path) -> None:
    text = charged.html(tmp_path / "rc.html")
    assert (tmp_path / "rc.html").read_text() == text
    page = Page(text)
    assert loads_nothing(page)
    assert not re.search(r"https?:|url\(|@import", text)
    assert sum(value is not None and value.startswith("data:image/svg") for _, value in page.attributes) == 2
    assert [row[0] for row in page.rows["Outcome"]] == ["result", "end of the run", "steps"]
    assert all(f"{package} {version(package)}" in text for package in ("acausal", "jax"))
    assert "Python 3." in text
    assert re.search(r"on \d{4}-\d\d-\d\d with", text)


def test_numbers_of_a_solution_have_units(charged: Solution[Any]) -> None:
    rows = Page(charged.html()).rows
    head, *variables = rows["Variables"]
    assert head[-1] == "unit"
    assert {row[0]: row[-1] for row in variables} == {
        name: charged.unit(name) for name in list(charged.keys()) if name not in parameters(charged.final)
    }
    end = next(row for row in variables if row[0] == "c.v")
    assert float(end[2]) == pytest.approx(float(charged.final.c.v), rel=1e-5)
    assert float(end[4]) == pytest.approx(float(np.max(charged["c.v"])), rel=1e-5)
    found = parameters(charged.final)
    assert [(row[0], row[2]) for row in rows["Parameters"][1:]] == list(found.units.items())
    assert any("must be" in row[3] for row in rows["Parameters"][1:])
    assert all("[J]" in cell for cell in rows["Energy"][0][1:])
    assert dict(row for row in rows["Options of the run"])["t1"] == "2 s"


def test_items_and_units_are_those_of_the_plot(charged: Solution[Any]) -> None:
    page = Page(charged.html(None, "r.i", units=["mA"]))
    assert any(name == "alt" and value == "[mA] over time [s]" for name, value in page.attributes)


def test_fingerprints_follow_parameters_and_equations(charged: Solution[Any]) -> None:
    def prints(solution: Solution[Any]) -> dict[str, str]:
        return dict(Page(solution.html()).rows["Model"])

    here, other = prints(charged), prints(simulate(replace(rc(), {"c.C": 0.5}), 2.0, energy=True))
    assert here["fingerprint of the equations"] == other["fingerprint of the equations"]
    assert here["fingerprint of the parameters"] != other["fingerprint of the parameters"]


def test_events_are_listed() -> None:
    log = EventLog(jnp.array([0.5, 1.25]), jnp.array([1, 0]), jnp.array(2), ("stop.lower", "stop.upper"))
    page = Page(report("Events", {"Events": event_table(log)}))
    assert page.rows["Events"] == [["time [s]", "event"], ["0.5", "stop.upper"], ["1.25", "stop.lower"]]


def test_several_results_in_one_report(charged: Solution[Any]) -> None:
    axes = charged.plot("c.v")
    table = Table(("part <a>", "time [ms]"), [("valve", "1.5")], "Times")
    text = report("Two & more", {"Run": charged, "Picture": axes, "Rest": ["a < b", table]}, about="One.\n\nTwo.")
    page = Page(text)
    assert loads_nothing(page)
    assert page.rows["Rest"] == [["part <a>", "time [ms]"], ["valve", "1.5"]]
    assert "Variables" in page.rows
    assert "<pre>a &lt; b</pre>" in text
    assert "<p>One.</p>\n<p>Two.</p>" in text


def test_reports_are_reproducible(charged: Solution[Any]) -> None:
    assert charged.html() == charged.html()


def test_a_batch_is_refused(charged: Solution[Any]) -> None:
    runs = jax.tree_util.tree_map(lambda leaf: jnp.stack([leaf, leaf]), charged)
    with pytest.raises(ModelError, match="A report shows a single run with known numbers"):
        runs.html()


def test_other_contents_are_refused() -> None:
    with pytest.raises(ModelError, match="'Number' holds a Quantity"):
        report("Wrong", {"Number": quantity(1.0, "bar")})


def test_a_diagram_is_a_picture() -> None:
    page = Page(report("One", {"Schematic": diagram(rc())}))
    assert ("alt", "Schematic") in page.attributes
    assert (
        "src",
        f"data:image/svg+xml;base64,{base64.b64encode(diagram(rc()).svg.encode()).decode()}",
    ) in page.attributes


def test_picture_of_a_png() -> None:
    page = Page(report("One", {"Photo": Picture(b"\x89PNG...", "a pump")}))
    assert ("alt", "a pump") in page.attributes
    assert any(value is not None and value.startswith("data:image/png;base64,") for _, value in page.attributes)


@pytest.mark.parametrize("row", [["1"], ["1", "2", "3"], ["1", 2.0]])
def test_a_row_that_does_not_fit_its_table_is_refused(row: list[Any]) -> None:
    with pytest.raises(ModelError, match=r"'sizes' has the row .*a text for each of its 2 columns"):
        report("title", {"part": Table(["a", "b"], [row], "sizes")})
