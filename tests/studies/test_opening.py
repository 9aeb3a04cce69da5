"""Opening times, states and derivatives against independent figures."""

import math
from typing import Any

import equinox as eqx
import numpy as np
import pytest
from _designs import DESIGNS, forward, numbers, reverse
from _thesis_reference import ELASTICITIES, OPENING_TIMES, STATES, TURNING_INERTIA

from acausal import Result, simulate
from components.blocks import TimeSeries
from studies import opening
from studies.actuators import commanded


@pytest.mark.thorough
@pytest.mark.parametrize(("design", "keywords", "time"), OPENING_TIMES)
def test_opening_time(design: str, keywords: dict[str, float], time: float) -> None:
    solution = opening(DESIGNS[design](**keywords))
    assert solution.result == Result.stopped
    assert solution.t1 == pytest.approx(time, rel=1e-8)


@pytest.mark.thorough
@pytest.mark.parametrize("design", ["ema_maxon", "ehs_maxon"])
def test_a_constant_command_opens_as_the_voltage_does(design: str) -> None:
    actuator = DESIGNS[design]()
    command = TimeSeries(times=np.array([0.0, 1.0]), values=np.full(2, actuator.supply.V), smooth=False)
    assert opening(commanded(actuator, command)).t1 == pytest.approx(float(opening(actuator).t1), rel=1e-8)


@pytest.mark.thorough
@pytest.mark.parametrize(("design", "keywords", "names", "rows"), STATES)
def test_states(design: str, keywords: dict[str, float], names: tuple[str, ...], rows: Any) -> None:
    expected = np.array(rows)
    solution = simulate(DESIGNS[design](**keywords), expected[-1, 0], save=expected[:, 0], rtol=1e-9)
    for name, values in zip(names, expected[:, 1:].T, strict=True):
        size = np.max(np.abs(values))
        np.testing.assert_allclose(solution[name] / size, values / size, atol=1e-6, rtol=0.0, err_msg=name)


@pytest.mark.thorough
@pytest.mark.parametrize(("design", "changes", "elasticities"), ELASTICITIES)
def test_elasticities(design: str, changes: dict[str, float], elasticities: dict[str, float]) -> None:
    keywords = numbers(design, **changes)
    sizes = keywords | {"rotor_inertia": TURNING_INERTIA[design]}
    time, gradient = reverse(design, keywords)
    for name, expected in elasticities.items():
        tolerance = max(1e-6, 1e-5 * abs(expected))
        assert sizes[name] / time * gradient[name] == pytest.approx(expected, abs=tolerance), name
        assert sizes[name] / time * forward(design, keywords, name)[1] == pytest.approx(expected, abs=tolerance), name


NEVER = (
    {"voltage": 0.0},
    {"voltage": 3.0},
    {"resistance": 1e6},
    {"ratio": 1.9},
    {"ratio": 1e9},
    {"spring_rate": 1e9},
    {"eccentricity": 4e-3},  # the lift of the cam is too small, and the cam keeps turning
)


@pytest.mark.parametrize("changes", NEVER)
def test_never_opens(changes: dict[str, float]) -> None:
    keywords = numbers("ema_maxon", **changes)
    solution = opening(DESIGNS["ema_maxon"](**keywords))
    assert solution.t1 == math.inf
    assert (solution.result == Result.never_stopped) | (solution.result == Result.too_many_steps)
    time, gradient = reverse("ema_maxon", keywords)
    assert time == math.inf
    assert all(value == 0.0 for value in gradient.values())
    for name in ("voltage", "ratio"):
        assert forward("ema_maxon", keywords, name) == (math.inf, 0.0)


def test_settling_ends_within_the_steps() -> None:
    for changes in NEVER[:4]:
        assert opening(DESIGNS["ema_maxon"](**changes)).result == Result.never_stopped


def test_a_bad_parameter_has_its_own_result() -> None:
    model = DESIGNS["ema_maxon"]()
    solution = opening(eqx.tree_at(lambda model: model.piston.m, model, -model.piston.m))
    assert solution.t1 == math.inf
    assert solution.result == Result.bad_parameter


def test_stroke_and_longest_time_are_arguments() -> None:
    model = DESIGNS["ema_maxon"]()
    assert opening(model, stroke=6e-3).final.slave.rod.s == pytest.approx(6e-3, rel=1e-10)
    assert opening(model, t_max=0.05).t1 == math.inf


def test_tolerance() -> None:
    time = OPENING_TIMES[3][2]
    assert opening(DESIGNS["ema_maxon"](), rtol=1e-5).t1 == pytest.approx(time, rel=1e-4)
