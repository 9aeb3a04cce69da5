"""Fronts of two results."""

from typing import Any

import numpy as np
import pytest
from _problems import GearedLoad

from acausal import Component, ModelError, Param, Scalar
from acausal.design import pareto

BOTH = {"time": (lambda m: m.time, "ms"), "motor speed": (lambda m: m.motor_speed, "rad/s")}


def test_front_of_time_and_speed() -> None:
    front = pareto(GearedLoad(), {"ratio": (5.0, 40.0)}, BOTH, points=6)
    times, speeds = front.values.T
    assert np.all(np.diff(times) > 0.0)
    np.testing.assert_allclose(np.diff(speeds), np.diff(speeds)[0], rtol=1e-9)
    # Both grow with the ratio below that of least time, so that the ends are that ratio and the lower bound.
    ratios = np.array([design.values["ratio"] for design in front.designs])
    np.testing.assert_allclose(ratios[[0, -1]], [np.sqrt(0.02 / 5.6e-5), 5.0], rtol=1e-7)
    for design, (time, speed) in zip(front.designs, front.values, strict=True):
        assert design.status == "optimal"
        assert float(design.model.time) == pytest.approx(time, rel=1e-12)
        assert float(design.model.motor_speed) == pytest.approx(speed, rel=1e-9)
    # The multipliers are the slopes of the front: dT/dN / dw/dN.
    for design in front.designs[1:-1]:
        model, step = design.model, 1e-6
        sides = [_at(float(model.ratio) * (1.0 + sign * step)) for sign in (1.0, -1.0)]
        slope = (sides[0][0] - sides[1][0]) / (sides[0][1] - sides[1][1])
        assert design.multipliers["motor speed"] == pytest.approx(-slope, rel=1e-5)
    assert "time [ms]  motor speed [rad/s]" in str(front)
    assert repr(front) == "<Front of time and motor speed: 6 designs>"
    axes = front.plot()
    assert axes.get_xlabel() == "time [ms]"


def _at(ratio: float) -> tuple[float, float]:
    model = GearedLoad(ratio=ratio)
    return float(model.time), float(model.motor_speed)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        (dict(minimise={"time": BOTH["time"]}), "takes two functions to minimise, by name; got 1"),
        (dict(minimise=BOTH["time"]), "takes two functions"),
        (dict(points=1), "points must be at least 2"),
        (dict(constraints={"time": (lambda m: m.time, "<= 1 s")}), "time is the name of the objective"),
    ],
)
def test_wrong_fronts_are_told(changes: dict[str, Any], said: str) -> None:
    problem: dict[str, Any] = dict(minimise=BOTH) | changes
    with pytest.raises(ModelError, match=said):
        pareto(GearedLoad(), {"ratio": (5.0, 40.0)}, **problem)


class Follow(Component):
    """x between two aims, and y that is to follow it."""

    x: Param[Scalar, "1"] = 0.3
    y: Param[Scalar, "1"] = 0.5


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_what_one_result_does_not_depend_on_is_best_for_the_other(sign: float) -> None:
    both = {"a": lambda m: (m.x - 1.0) ** 2 + (m.y - m.x) ** 2, "b": lambda m: (m.x + 1.0) ** 2}
    front = pareto(
        Follow(), {"x": (-5.0, 5.0), "y": (-5.0, 5.0)}, both if sign > 0.0 else dict(reversed(both.items())), points=3
    )
    ends = np.array([design.x for design in front.designs])
    np.testing.assert_allclose(ends[[0, -1]], sign * np.array([[1.0, 1.0], [-1.0, -1.0]]), atol=1e-6)
    assert [design.status for design in front.designs] == ["optimal"] * 3
