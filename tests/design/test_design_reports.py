"""HTML reports of designs, fits and tolerances contain the tables that `print` shows."""

import html
import re
from collections.abc import Callable
from typing import Any

import pytest
from _problems import GearedLoad

from acausal.design import Experiment, Normal, Tolerance, identify, optimise

pytest.importorskip("matplotlib")


def words(text: str) -> set[str]:
    """All words and numbers of a page, or of a printed result."""
    return set(html.unescape(re.sub(r"</?[a-z][^>]*>", " ", text)).split())


def designed() -> Any:
    return optimise(
        GearedLoad(),
        {"ratio": (2.0, 40.0)},
        {"time": (lambda m: m.time, "ms")},
        constraints={"speed": (lambda m: m.motor_speed, "<= 200 rad/s")},
    )


def fitted() -> Any:
    measured = {"time": 0.31, "speed": 190.0}

    def predict(model: GearedLoad) -> dict[str, Any]:
        return {"time": model.time, "speed": model.motor_speed}

    data = Experiment(predict, measured, {"time": 0.01, "speed": 5.0}, units={"time": "s", "speed": "rad/s"})
    return identify(GearedLoad(), {"J_load": (1e-3, 1.0), "torque": (0.01, 1.0)}, data)


def spread() -> Any:
    return Tolerance(
        GearedLoad(), {"torque": Normal(std="5 %"), "J_load": Normal(std="1 %")}, {"time": (lambda m: m.time, "ms")}
    ).first_order()


@pytest.mark.parametrize(
    ("make", "headings", "pictures"),
    [
        (designed, ["Certificate", "Variables", "Limits", "Multipliers", "Sensitivities", "Search"], 1),
        (fitted, ["Estimates", "Measured and fitted", "Residuals", "Correlation"], 2),
        (spread, ["Distributions", "Causes"], 1),
    ],
)
def test_report_contains_what_is_printed(make: Callable[[], Any], headings: list[str], pictures: int) -> None:
    result = make()
    page = result.html()
    assert words(str(result)) - words(page) <= {"correlation"}
    model = ["Parameters", "Model"] if make is not spread else []
    assert re.findall("<h2>(.*?)</h2>", page) == headings + model
    assert page.count('src="data:image/svg+xml;base64,') == pictures
    assert not re.search(r"https?:|href", page)
