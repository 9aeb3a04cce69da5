"""The app of the actuators: choices on the command line, and the page in a browser."""

import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from acausal import ArgumentError, replace
from acausal.design import Explorer, serve
from acausal.design import explore as make_explorer
from acausal.design._explore.widgets import positions
from studies import explore
from studies.__main__ import main
from studies.actuators import ehs_maxon, ema_maxon, explorer, figures, opening, opening_time, sila

CHROMIUM = shutil.which("chromium")
OPTIONS = (
    "--headless --no-sandbox --disable-gpu --disable-quic --no-first-run --disable-background-networking "
    "--disable-component-update --disable-sync"
).split()
LONG = 300_000.0  # ms
PROGRAM = """
from acausal import Component, Param, Scalar
from acausal.design import explore

class Square(Component):
    side: Param[Scalar, "m"] = 2.0

mine = explore(Square(), {"side": (1.0, 3.0)}, {"area": (lambda m: m.side**2, "m2")})
"""


def test_choices_are_the_actuators_and_the_explorers_of_a_file(tmp_path: Path) -> None:
    known = explore.choices()
    assert next(iter(known)) == "EMA, Maxon RE50"
    assert next(iter(explore.choices("ehs_maxon"))) == "EHS, Maxon RE40"
    assert len(known) == len(explore.choices("sila")) == 4
    file = tmp_path / "mine.py"
    file.write_text(PROGRAM)
    name, make = next(iter(explore.choices(str(file)).items()))
    assert name == "mine.py: mine"
    assert make().at({"side": "3 m"})["area"].value == 9.0


def test_an_actuator_of_a_file_has_its_limits_and_sliders(tmp_path: Path) -> None:
    file = tmp_path / "actuator.toml"
    file.write_text(
        'concept = "electromechanical"\nmotor = "370354"\ngearhead = 4.3\nlimits = { "peak current" = "<= 50 A" }\n'
        'free = { "gearbox.ratio" = [2, 10] }\ntemperatures = [60]\n'
    )
    made = explore.choices(str(file))["actuator.toml"]()
    assert made.free.names == ("gearbox.ratio",)
    assert made.objectives[0].name == "opening time"
    with pytest.raises(ArgumentError, match="explorer takes one temperature, got -30, 60"):
        explorer(ema_maxon(), temperatures=(-30, 60))
    with pytest.raises(ArgumentError, match="explorer has no result 'peak'"):
        explorer(ema_maxon(), limits={"peak": "<= 1 A"})


@pytest.mark.parametrize("build", [ema_maxon, ehs_maxon, sila])
def test_an_actuator_has_sliders_for_its_sizes(build: Any) -> None:
    made = explorer(build())
    names = made.free.names
    assert ("pump.displacement" in names) == (build is ehs_maxon)
    assert ("cam.profile.eccentricity" in names) == (build is ema_maxon)
    assert set(made.held) < set(names)
    for variable in made.free.variables:
        assert variable.low * 2.5 == pytest.approx(variable.start) == variable.high / 2.5


@pytest.mark.parametrize(("name", "message"), [("mine", "is not an actuator or a file"), ("empty.py", "defines no")])
def test_command_line_refuses(
    name: str, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "empty.py").write_text("")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit):
        main(["explore", name, "--no-browser"])
    assert message in capsys.readouterr().err


class Page:
    """The app in a browser, as a user sees it; pictures go to a folder."""

    def __init__(self, page: Any, folder: Path) -> None:
        self.page, self.folder = page, folder

    def move(self, slider: int, key: str) -> None:
        """Moves a slider with a key and waits until the page has changed."""
        before = self.page.inner_text("body")
        handle = self.page.get_by_role("slider").nth(slider)
        handle.focus()
        self.page.keyboard.press(key)
        self.page.wait_for_function("before => document.body.innerText != before", arg=before, timeout=LONG)
        self.page.wait_for_timeout(1000)

    def row(self, name: str) -> list[str]:
        """The cells of a result."""
        return self.page.locator("tr", has_text=name).first.locator("td").all_inner_texts()

    def picture(self, name: str) -> None:
        self.page.screenshot(path=self.folder / f"{name}.png", full_page=True)


@pytest.fixture
def made() -> Explorer[Any]:
    """The opening of an actuator with few results, which compiles faster."""
    return make_explorer(
        ema_maxon(),
        {"gearbox.ratio": (2.0, 12.0), "supply.V": (5.0, 15.0)},
        {"opening time": (lambda s: s.t1, "ms")},
        run=lambda model, save: opening(model, t_max=1.0, save=save, rtol=1e-8, throw=True),
        curves=[{"stroke": "slave.rod.s"}, "line.p"],
        units=["mm", "bar"],
    )


@pytest.fixture
def page(made: Explorer[Any], tmp_path: Path) -> Iterator[tuple[Page, list[str]]]:
    playwright = pytest.importorskip("playwright.sync_api")
    if CHROMIUM is None:
        pytest.skip("needs the browser chromium")
    app = serve({"actuator": lambda: made}, browser=False)
    with playwright.sync_playwright() as started:
        browser = started.chromium.launch_persistent_context(
            tmp_path / "browser", executable_path=CHROMIUM, args=OPTIONS, viewport={"width": 1300, "height": 1100}
        )
        try:
            opened, asked = browser.new_page(), []
            opened.on("request", lambda request: asked.append(request.url))
            opened.goto(app.url)
            opened.wait_for_selector("td", timeout=LONG)
            yield Page(opened, tmp_path), asked
        finally:
            browser.close()
            app.close()


@pytest.mark.slow
def test_an_explorer_shows_the_figures_of_the_actuator() -> None:
    model = ema_maxon()
    found, expected = explorer(model, rtol=1e-8).at(), figures(model)
    pairs = {
        "opening time": expected.opening_time,
        "peak current": expected.peak_current,
        "line pressure": expected.line_pressure,
        "energy of the battery": expected.energies.battery,
        "heat of the winding": expected.energies.winding,
        "energy of the clutch": expected.energies.clutch,
        "hold for 10 s": expected.energies.holding,
        "holding current": expected.holding_current,
        "holding power": expected.holding_power,
    }
    assert {name: found[name].value for name in pairs} == pytest.approx(
        {name: float(value) for name, value in pairs.items()}, rel=1e-6
    )


@pytest.mark.slow
def test_page_in_a_browser(page: tuple[Page, list[str]], made: Explorer[Any]) -> None:
    shown, asked = page
    model = ema_maxon()
    assert shown.row("opening time")[1] == f"{1e3 * float(opening_time(model)):.5g} ms"

    shown.move(0, "PageUp")
    place = int(shown.page.get_by_role("slider").first.get_attribute("aria-valuenow"))
    ratio = list(positions(made.free, [4.3, 13.5])[0].values())[place]
    assert ratio > 4.5
    expected = made.at({"gearbox.ratio": ratio})["opening time"]
    moved = opening_time(replace(model, {"gearbox.ratio": ratio}))
    assert float(shown.row("opening time")[1].split()[0]) == pytest.approx(1e3 * float(moved), rel=1e-4)
    assert f"+1 %: {expected.per_percent(0, ratio):+.4g} ms" in shown.page.inner_text("body")
    shown.picture("moved")

    shown.page.get_by_text("Minimise the result from here").click()
    shown.page.wait_for_selector("text=KKT residual", timeout=LONG)
    shown.page.wait_for_timeout(1000)
    best = made.optimum({"gearbox.ratio": ratio})
    assert float(shown.row("opening time")[1].split()[0]) == pytest.approx(1e3 * best.objective, rel=1e-4)
    shown.picture("optimum")

    shown.move(0, "Home")
    shown.move(1, "Home")
    shown.page.wait_for_selector("text=At t = 1 s: The stop condition was never met")
    assert shown.row("opening time") == []
    shown.picture("failed")
    shown.page.get_by_text("Back to the start").click()
    shown.page.wait_for_selector("td", timeout=LONG)
    shown.page.wait_for_timeout(1000)
    assert shown.row("opening time")[1] == f"{1e3 * float(opening_time(model)):.5g} ms"

    shown.page.set_viewport_size({"width": 420, "height": 900})
    shown.page.wait_for_timeout(1000)
    assert shown.page.evaluate("document.documentElement.scrollWidth") <= 430
    shown.picture("narrow")
    server = shown.page.url.partition("/?")[0]
    assert not [url for url in asked if not url.startswith((server, "data:", "blob:"))]
