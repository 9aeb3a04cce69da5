"""The electrohydraulic actuator with dry friction: smoothed, against independent figures, and with sticking."""

import math
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from studies import opening, opening_time
from studies.actuators import ehs_sticking

# As in `_thesis_reference.py`: hand-written equations, LSODA at 1e-12, friction smoothed over 0.1 rad/s.
SMOOTH_TIME = 0.12999997821490777
SMOOTH_SLOPES = {
    "torque_constant": -0.7010212151717564,
    "resistance": 0.17186642732245586,
    "friction": 20.865633187489735,
    "rotor_inertia": 113.7785251401986,
    "voltage": -0.008616466752576131,
    "spring_rate": 7.119180643079149e-07,
    "slave_bore": 2.708514799387185,
    "displacement": -0.01960863792437081 * 2e6 * math.pi,  # given per cm3/rev
    "break_away": 0.013634866163279318,
    "coulomb": 0.13699553433263145,
}
KEYWORDS = {
    "voltage": 13.5,
    "ramp": 99.973e-3,
    "break_away": 0.18342,
    "coulomb": 0.05,
    "stribeck_speed": 30.0,
    "friction": 8e-4,
    "torque_constant": 0.0302,
    "resistance": 0.4,
    "rotor_inertia": 14e-6,
    "displacement": 1.25e-6 / (2.0 * math.pi),
    "slave_bore": 17.4625e-3,
    "spring_rate": 58e3,
}


def time_of(width: float | None, rtol: float = 1e-9) -> Callable[[dict[str, Any]], Any]:
    return lambda keywords: opening_time(ehs_sticking(width=width, **keywords), rtol=rtol)


@pytest.mark.thorough
def test_smooth() -> None:
    time, slopes = jax.jit(jax.value_and_grad(time_of(0.1)))(KEYWORDS)
    assert time == pytest.approx(SMOOTH_TIME, rel=1e-8)
    for name, expected in SMOOTH_SLOPES.items():
        assert slopes[name] == pytest.approx(expected, rel=1e-5), name


@pytest.mark.thorough
def test_it_sticks_until_the_motor_is_strong_enough() -> None:
    solution = opening(ehs_sticking(**KEYWORDS))
    k = KEYWORDS
    assert solution.events.names == ["command.begin", "bearing.hold", "bearing.forward", "command.end"]
    breaks_away = k["break_away"] * k["resistance"] * k["ramp"] / (k["torque_constant"] * k["voltage"])
    np.testing.assert_allclose(solution.events.times[2:], [breaks_away, k["ramp"]], rtol=1e-9)
    before = np.asarray(solution.ts) <= breaks_away
    # While stuck, it creeps by rounding only; with smoothed friction, it turns at 0.06 rad/s after 10 ms.
    assert np.max(np.abs(np.asarray(solution.bearing.w)[before])) < 1e-9
    assert solution.t1 == pytest.approx(SMOOTH_TIME, abs=2e-5)


@pytest.fixture(scope="module")
def sticking() -> tuple[Callable[..., float], Callable[[str], float]]:
    """The opening time for changed keywords, and its forward-mode derivative, at a tolerance for differences."""
    function = time_of(None, rtol=1e-11)
    run = jax.jit(function)
    slope = jax.jit(lambda keywords, direction: jax.jvp(function, (keywords,), (direction,))[1])

    def time(**changes: float) -> float:
        return float(run({name: jnp.asarray(value, float) for name, value in (KEYWORDS | changes).items()}))

    def forward(name: str) -> float:
        direction = {key: jnp.asarray(key == name, float) for key in KEYWORDS}
        return float(slope({key: jnp.asarray(value, float) for key, value in KEYWORDS.items()}, direction))

    return time, forward


@pytest.mark.thorough
@pytest.mark.parametrize("name", ["displacement", "break_away", "coulomb", "voltage", "ramp"])
def test_derivative_through_break_away(sticking: Any, name: str) -> None:
    time, forward = sticking
    x, h = KEYWORDS[name], 1e-4 * KEYWORDS[name]
    near, far = (
        (time(**{name: x + step}) - time(**{name: x - step})) / (2.0 * step) for step in (h, 2.0 * h)
    )  # fmt: skip
    assert forward(name) == pytest.approx((4.0 * near - far) / 3.0, rel=1e-6)


@pytest.mark.slow
def test_modes_agree_at_a_tight_tolerance(sticking: Any) -> None:
    """Reverse mode recomputes the steps, which must be the same."""
    slopes = jax.jit(jax.grad(time_of(None, rtol=1e-11)))(KEYWORDS)
    for name in ("displacement", "break_away", "voltage"):
        assert slopes[name] == pytest.approx(sticking[1](name), rel=1e-10), name
