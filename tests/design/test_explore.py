"""Sliders without a browser: results, gradients, limits, failures, optima, positions and curves."""

import json
import math
import socket
import sys
import urllib.request
from collections.abc import Iterator
from typing import Any
from urllib.error import URLError

import pytest
from _problems import Box, GearedLoad
from jax import monitoring

from acausal import Component, Connections, ModelError, ParameterError, connect, simulate
from acausal._progress import COMPILING
from acausal.design import Explorer, explore, optimise, serve
from acausal.design._explore import served
from acausal.design._explore.explorer import table
from acausal.design._explore.widgets import charts, positions
from components.electrical import Capacitor, ConstantVoltage, Ground, Resistor
from components.rotational import Cam, EccentricDisc

LOAD = GearedLoad()
FREE = {"ratio": (2.0, 60.0), "torque": ("0.1 N.m", "0.5 N.m")}
TIME = {"time": (lambda m: m.time, "ms")}
SPEED = {"speed": (lambda m: m.motor_speed, "<= 1500 rpm")}


class Charging(Component):
    """A capacitor that charges through a resistor: v = V (1 - exp(-t / (R C)))."""

    supply: ConstantVoltage
    r: Resistor
    c: Capacitor
    ground: Ground = Ground()

    def connections(self) -> Connections:
        return (
            connect(self.supply.p, self.r.p),
            connect(self.r.n, self.c.p),
            connect(self.c.n, self.supply.n, self.ground.p),
        )


def charged(model: Charging, save: str) -> Any:
    """The run until half a volt."""
    return simulate(model, 1.0, until=lambda s: s.c.v - 0.5, save=save, rtol=1e-8)


@pytest.fixture(scope="module")
def load() -> Explorer[GearedLoad]:
    return explore(LOAD, FREE, TIME, constraints=SPEED, held=["torque"])


@pytest.fixture(scope="module")
def charging() -> Explorer[Charging]:
    model = Charging(supply=ConstantVoltage(V=1.0), r=Resistor(R=100.0), c=Capacitor(C=1e-4, v=0.0))
    results = {"time": (lambda s: s.t1, "ms")}
    curves = [{"voltage": "c.v", "supply": "supply.v"}, "c.i"]
    return explore(model, {"supply.V": (0.1, 5.0), "r.R": (10.0, 1e3)}, results, run=charged, curves=curves)


def test_results_and_gradients_are_those_of_the_model(load: Explorer[Any]) -> None:
    found = load.at({"ratio": 8.0, "torque": "0.3 N.m"})
    moved = GearedLoad(ratio=8.0, torque=0.3)
    assert found.values == {"ratio": 8.0, "torque": 0.3}
    assert found["time"].value == pytest.approx(float(moved.time), rel=1e-12)
    step = 1e-6
    other = GearedLoad(ratio=8.0 + step, torque=0.3)
    per_unit = found["time"].per_unit(0, load.free.variables[0])
    assert per_unit == pytest.approx(1e3 * float(other.time - moved.time) / step, rel=1e-5)
    # T enters as 1 / sqrt(T): one per cent more saves half a per cent.
    assert found["time"].per_percent(1, 0.3) == pytest.approx(-0.005 * 1e3 * float(moved.time), rel=1e-12)


def test_limits_are_marked_as_broken(load: Explorer[Any]) -> None:
    assert load.at().broken == ()
    fast = load.at({"ratio": 40.0})
    assert fast.broken == ("speed",)
    assert "broken" in str(fast)
    assert fast["speed"].limited is not None
    assert fast["speed"].limited.margin == pytest.approx(1.0 - fast["speed"].value / (1500.0 * math.pi / 30.0))


def test_optimum_is_that_of_optimise_and_keeps_what_is_held(load: Explorer[Any]) -> None:
    design = load.optimum({"torque": 0.3})
    expected = optimise(GearedLoad(torque=0.3), {"ratio": FREE["ratio"]}, TIME, constraints=SPEED, sensitivities=False)
    assert design.status == expected.status == "optimal"
    assert design.values == pytest.approx(expected.values, rel=1e-9)
    assert float(design.model.torque) == 0.3
    both = load.optimum(varied=["ratio", "torque"])
    assert set(both.values) == {"ratio", "torque"}
    assert both.objective < design.objective


def test_another_result_can_be_minimised() -> None:
    results = {"height": lambda m: m.height, "area": (lambda m: m.area, "m2")}
    volume = {"volume": (lambda m: m.volume, "== 4 m3")}
    design = explore(Box(), {"base": (0.5, 4.0), "height": (0.5, 4.0)}, results, constraints=volume).optimum(
        minimise="area"
    )
    assert design.values == pytest.approx({"base": 2.0, "height": 1.0}, rel=1e-6)


def test_curves_are_those_of_the_run(charging: Explorer[Any]) -> None:
    found = charging.at({"r.R": 200.0})
    assert found["time"].value == pytest.approx(200.0 * 1e-4 * math.log(2.0), rel=1e-6)
    now, start = charts(found, charging.at()), charging.at()["time"].value
    assert [chart.specification["encoding"]["y"]["title"] for chart in now] == ["[V]", "c.i [A]"]
    rows = [row for row in now[0].specification["data"]["values"] if row["curve"] == "voltage"]
    drawn = {design: [row for row in rows if row["design"] == design] for design in ("start", "now")}
    for row in drawn["now"]:
        assert row["y"] == pytest.approx(1.0 - math.exp(-row["t"] / 0.02), abs=1e-6)
    assert drawn["start"][-1]["t"] == pytest.approx(start)
    assert now[0].specification["encoding"]["x"]["scale"]["domain"] == pytest.approx([0.0, found["time"].value])
    kind, text = now[1]._mime_()
    assert kind.startswith("application/vnd.vegalite")
    assert json.loads(text) == now[1].specification
    assert len(found.figure().axes) == 2


def test_a_run_that_fails_is_a_message_and_the_next_one_recovers(charging: Explorer[Any]) -> None:
    weak = charging.at({"supply.V": 0.4})
    assert "The stop condition was never met" in weak.message
    assert (weak.results, weak.solution, weak._columns) == ((), None, [])
    assert weak.message in str(weak)
    assert json.loads(weak.to_json())["message"] == weak.message
    assert charging.at({"supply.V": 2.0}).is_good


def test_values_that_the_model_refuses_are_its_message() -> None:
    cam = Cam(profile=EccentricDisc(eccentricity=5e-3, radius=20e-3), J=1e-5)
    free = {"profile.eccentricity": ("2 mm", "12 mm"), "profile.radius": ("10 mm", "30 mm")}
    explorer = explore(cam, free, {"lift": (lambda m: m.profile.lift(3.0), "mm")})
    bad = explorer.at({"profile.eccentricity": "11 mm", "profile.radius": "10 mm"})
    assert "eccentricity must be smaller than radius" in bad.message
    assert explorer.at({"profile.eccentricity": "11 mm", "profile.radius": "12 mm"}).is_good


def test_moving_sliders_compiles_nothing(charging: Explorer[Any]) -> None:
    charging.at({"r.R": 300.0})._columns  # noqa: B018
    compiled: list[str] = []
    listener = lambda event, *_, **__: compiled.append(event) if event == COMPILING else None  # noqa: E731
    monitoring.register_event_duration_secs_listener(listener)
    try:
        for resistance in (310.0, 320.0):
            found = charging.at({"r.R": resistance})
            charts(found, found)
    finally:
        monitoring.unregister_event_duration_listener(listener)
    assert not compiled


def test_positions_of_sliders_include_bounds_and_values(load: Explorer[Any]) -> None:
    x = [10.0 / 3.0, 0.25]
    ratio, torque = positions(load.free, x)
    for places, value, low, high in ((ratio, x[0], 2.0, 60.0), (torque, x[1], 0.1, 0.5)):
        numbers = list(places.values())
        assert numbers == sorted(numbers)
        assert (numbers[0], numbers[-1]) == (low, high)
        assert value in numbers
        assert len(numbers) > 95
    # The ratio spans more than a decade, so its positions are logarithmic.
    assert ratio[2.0] == 2.0
    assert sorted(ratio)[50] == pytest.approx(math.sqrt(2.0 * 60.0), rel=0.1)


def test_json_holds_values_results_and_units(load: Explorer[Any]) -> None:
    found = json.loads(load.at({"ratio": 8.0}).to_json())
    assert found["values"]["torque"] == {"value": 0.25, "unit": "N.m"}
    assert found["results"]["speed"]["limit"] == "<= 1500 rpm"
    values = {name: entry["value"] for name, entry in found["values"].items()}
    assert load.at(values)["time"].value == found["results"]["time"]["value"]


def test_the_static_view_shows_results_gradients_and_curves(charging: Explorer[Any]) -> None:
    page = charging._repr_html_()
    assert "6.9315 ms" in page
    assert "supply.V" in page
    assert "<svg" in page
    assert repr(charging) == "<Explorer of Charging: supply.V, r.R>"
    assert table(["a"], [["<b>"]], ["<b>"]).count("&lt;b&gt;") == 1


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"free": {"ratio": (2.0, None)}}, "ratio: a slider needs a lower and an upper bound"),
        ({"curves": ["ratio"]}, "Curves need a run, such as"),
        ({"held": ["rate"]}, "held: 'rate' is not a free parameter. Did you mean ratio"),
        ({"results": {}}, "nothing to minimise"),
    ],
)
def test_invalid_problems_are_refused(changes: dict[str, Any], message: str) -> None:
    arguments = {"free": FREE, "results": TIME} | changes
    with pytest.raises(ModelError, match=message):
        explore(LOAD, **arguments)


def test_unknown_names_are_refused(load: Explorer[Any]) -> None:
    with pytest.raises(ModelError, match=r"'ratios' is not a free parameter. Did you mean ratio"):
        load.at({"ratios": 3.0})
    with pytest.raises(ParameterError, match="outside its bounds 2 to 60"):
        load.at({"ratio": 1.0})
    with pytest.raises(ModelError, match=r"There is no result 'times' to minimise. Did you mean time"):
        load.optimum(minimise="times")
    with pytest.raises(ModelError, match="'rat' is not a free parameter"):
        load.optimum(varied=["rat"])
    with pytest.raises(ModelError, match="The search varies no parameter"):
        load.optimum(varied=[])


def test_curves_need_a_solution() -> None:
    wrong = explore(LOAD, FREE, {"time": lambda m: m[0]}, run=lambda m, save: (m.time,), curves=["ratio"])
    assert "Curves need a run that returns a solution; it returned a tuple." in wrong.at().message


@pytest.fixture
def offered() -> Iterator[None]:
    served.offered.clear()
    yield
    served.offered.clear()


@pytest.mark.usefixtures("offered")
def test_a_missing_package_or_a_port_in_use_is_named(load: Explorer[Any], monkeypatch: pytest.MonkeyPatch) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        with pytest.raises(ModelError, match=r"Port \d+ cannot be used: .* Pass another, or 0"):
            load.app(port=taken.getsockname()[1], browser=False)
    for name in ["marimo", *(name for name in sys.modules if name.startswith("marimo."))]:
        monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(ModelError, match=r'The app needs marimo: pip install "acausal\[explore\]"\.'):
        load.app(browser=False)


@pytest.mark.usefixtures("offered")
def test_the_cells_of_the_app_run_without_a_browser(charging: Explorer[Any]) -> None:
    from acausal.design._explore.app import app

    served.offered["charging"] = lambda: charging
    _, names = app.run()
    assert names["model"].value == "charging"
    assert names["now"]["time"].value == pytest.approx(0.01 * math.log(2.0), rel=1e-6)
    assert [slider.value for slider in names["sliders"]] == [1.0, 100.0]


@pytest.mark.usefixtures("offered")
def test_widgets_show_gradients_messages_and_the_optimum(load: Explorer[Any], charging: Explorer[Any]) -> None:
    from acausal.design._explore import widgets

    start = load.at()
    sliders = widgets.sliders(load.free, start.values)
    assert widgets.chosen(load.free, start.values, [one.value for one in sliders]) == start.values
    shown = "".join(item.text for item in widgets.inputs(start, sliders, sliders, "time"))
    assert f"+1 %: {start['time'].per_percent(0, 10.0):+.4g} ms" in shown
    values, verdict = widgets.optimum(load, start, "time", [True, False])
    assert values == load.optimum().values | {"torque": 0.25}
    assert "optimal" in verdict
    assert widgets.optimum(load, start, "time", [False, False])[1].startswith("The search varies no parameter")
    failed = charging.at({"supply.V": 0.4})
    assert "never met" in widgets.outputs(failed, charging.at())[0].text
    assert "&#10;" in widgets.energy(charging.at(), True).text


def test_serve_names_what_it_offers() -> None:
    with pytest.raises(ModelError, match="serve needs at least one explorer"):
        serve({}, browser=False)


@pytest.mark.usefixtures("offered")
def test_the_app_answers_until_it_is_closed(load: Explorer[Any]) -> None:
    app = load.app(browser=False)
    assert app.url.endswith("/?design=GearedLoad")
    assert app.url in app._repr_html_()
    with urllib.request.urlopen(app.url) as page:
        assert b"Explore a design" in page.read()
    app.close()
    app.close()
    with pytest.raises(URLError):
        urllib.request.urlopen(app.url)
