"""Controllers in closed loops and at their limits."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from acausal import Component, Connections, Scalar, connect, simulate
from acausal.testing import check_law
from components import blocks

TIMES = np.linspace(0.0, 6.0, 25)


class Loop(Component):
    """A controller on a plant of first order, with a step of the set point from the start."""

    set_point: blocks.Constant
    control: blocks.LimPI | blocks.LimPID
    plant: blocks.FirstOrder

    def connections(self) -> Connections:
        return (
            connect(self.set_point.y, self.control.u_s),
            connect(self.control.y, self.plant.u),
            connect(self.plant.y, self.control.u_m),
        )


class PlainLoop(Component):
    """The same with a controller of the difference."""

    set_point: blocks.Constant
    difference: blocks.Sum
    control: blocks.PI | blocks.PID
    plant: blocks.FirstOrder

    def connections(self) -> Connections:
        return (
            connect(self.set_point.y, self.difference.u1),
            connect(self.plant.y, self.difference.u2),
            connect(self.difference.y, self.control.u),
            connect(self.control.y, self.plant.u),
        )


def plain(control: blocks.PI | blocks.PID) -> PlainLoop:
    return PlainLoop(
        set_point=blocks.Constant(k=1.0),
        difference=blocks.Sum(k2=-1.0),
        control=control,
        plant=blocks.FirstOrder(T=0.5, k=2.0),
    )


def loop(control: blocks.LimPI | blocks.LimPID) -> Loop:
    return Loop(set_point=blocks.Constant(k=1.0), control=control, plant=blocks.FirstOrder(T=0.5, k=2.0))


def second_order(times: np.ndarray, k: float, Ti: float) -> np.ndarray:
    """Closed loop of k (1 + 1/(Ti s)) and 2 / (1 + 0.5 s): (Ti s + 1) / (a s^2 + b s + 1), underdamped."""
    a, b = 0.5 * Ti / (2.0 * k), Ti * (1.0 + 1.0 / (2.0 * k))
    sigma, w = 0.5 * b / a, np.sqrt(1.0 / a - (0.5 * b / a) ** 2)
    return 1.0 - np.exp(-sigma * times) * (np.cos(w * times) + (sigma - Ti / a) / w * np.sin(w * times))


@pytest.mark.thorough
@pytest.mark.parametrize("limited", [True, False])
def test_pi_on_a_plant_of_first_order(limited: bool) -> None:
    """Both controllers give the step response in closed form, as long as no limit is reached."""
    k, Ti = 0.6, 0.1
    wide = loop(blocks.LimPI(k=k, Ti=Ti, y_min=-9.0, y_max=9.0))
    model = wide if limited else plain(blocks.PI(k=k, T=Ti))
    solution = simulate(model, 6.0, save=jnp.asarray(TIMES), rtol=1e-9)
    np.testing.assert_allclose(solution["plant.y.value"], second_order(TIMES, k, Ti), atol=1e-7)


@pytest.mark.thorough
def test_limited_pid_within_its_limits_is_the_plain_one() -> None:
    """With the set point weighted as the measured value."""
    gains: dict[str, Any] = {"k": 0.6, "Ti": 0.3, "Td": 0.05, "Nd": 8.0}
    wide = simulate(
        loop(blocks.LimPID(**gains, wd=1.0, y_min=-99.0, y_max=99.0)), 6.0, save=jnp.asarray(TIMES), rtol=1e-9
    )
    narrow = simulate(plain(blocks.PID(**gains)), 6.0, save=jnp.asarray(TIMES), rtol=1e-9)
    np.testing.assert_allclose(wide["control.y.value"], narrow["control.y.value"], atol=1e-7)
    assert narrow["control.y.value"][0] == pytest.approx(0.6 * 9.0)  # k (1 + Nd), from the step


def limited(Ni: float, kind: str = "PI") -> Loop:
    """A loop that is held back by its limit at first: the plant tends to 2 y_max = 1.2."""
    gains: dict[str, Any] = {"k": 3.0, "Ti": 0.2, "y_min": 0.0, "y_max": 0.6, "Ni": Ni}
    return loop(blocks.LimPI(**gains) if kind == "PI" else blocks.LimPID(**gains, Td=0.02))


@pytest.mark.parametrize("kind", ["PI", "PID"])
def test_limits_and_anti_windup(kind: str) -> None:
    """The output stays within its limits; feeding back what they cut off spares most of the overshoot."""
    wound, unwound = (simulate(limited(Ni, kind), 6.0, save=jnp.asarray(TIMES), rtol=1e-8) for Ni in (1e6, 0.9))
    for solution in (wound, unwound):
        y = np.asarray(solution["control.y.value"])
        assert np.min(y) >= 0.0
        assert np.max(y) == 0.6
        assert solution["plant.y.value"][-1] == pytest.approx(1.0, abs=1e-2)
    overshoot = [np.max(np.asarray(solution["plant.y.value"])) - 1.0 for solution in (wound, unwound)]
    assert overshoot[0] > 0.15
    assert overshoot[1] < 0.2 * overshoot[0]


def test_integral_part_while_limited_follows_the_closed_form() -> None:
    """At the limit from the start: Ti x' = e + (y_max / k - e - x) / Ni with e = 1 - y_plant = -0.2 + 1.2 exp(-2 t)."""
    k, Ti, Ni = 3.0, 0.2, 0.9
    times = np.linspace(0.0, 0.5, 6)
    solution = simulate(limited(Ni), 0.5, save=jnp.asarray(times), rtol=1e-9)
    c0 = 0.6 / k - 0.2 * (Ni - 1.0)
    c1 = 1.2 * (Ni - 1.0) / (1.0 - 2.0 * Ni * Ti)
    exact = c0 + c1 * np.exp(-2.0 * times) - (c0 + c1) * np.exp(-times / (Ni * Ti))
    assert np.all(solution["control.y_unlimited"] >= 0.6)
    np.testing.assert_allclose(solution["control.x"], exact, atol=1e-8)


@pytest.mark.thorough
def test_gradient_through_the_limits() -> None:
    """Forward and reverse mode agree with finite differences."""

    def at_end(k: Scalar) -> Scalar:
        control = blocks.LimPI(k=k, Ti=0.2, y_min=0.0, y_max=0.6)
        return simulate(loop(control), 1.2, save="end", rtol=1e-10).final.plant.y.value

    k, h = 3.0, 1e-4
    difference = (at_end(k + h) - at_end(k - h)) / (2.0 * h)
    forward = jax.jacfwd(at_end)(k)
    np.testing.assert_allclose(forward, difference, rtol=1e-4)
    np.testing.assert_allclose(jax.grad(at_end)(k), forward, rtol=1e-9)


def test_setpoint_weights() -> None:
    """They act on the set point alone: not on the measured value, the integral or the filter of the derivative."""
    given = {"u_s.value": 3.0, "u_m.value": 1.2, "x": 0.5}
    limits: dict[str, Any] = dict(k=2.0, Ti=0.7, y_min=-50.0, y_max=50.0)
    proportional = 0.4 * 3.0 - 1.2 + 0.5
    check_law(blocks.LimPI(wp=0.4, **limits), given, {"y_unlimited": 2.0 * proportional, "der(x)": 1.8 / 0.7})
    lead = 0.3 * 3.0 - 1.2 - 0.1
    check_law(
        blocks.LimPID(wp=0.4, wd=0.3, Td=0.2, Nd=8.0, **limits),
        given | {"x_d": 0.1},
        {"y_unlimited": 2.0 * (proportional + 8.0 * lead), "der(x_d)": 8.0 * lead / 0.2},
    )
