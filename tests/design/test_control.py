"""Optimal control against closed forms: Bryson and Ho, Applied Optimal Control (1975), sections 2.2 and 3.9."""

from types import SimpleNamespace
from typing import Any

import jax.numpy as jnp
import numpy as np
import pytest

from acausal import Component, Connections, ModelError, ParameterError, connect, simulate
from acausal._units.display import Scale
from acausal.design import control, optimise
from acausal.design._control import course as courses
from acausal.design._optimise.entries import LimitedResult
from acausal.design._problem.limits import Limit
from components.blocks import Staircase, TimeSeries
from components.electrical import EMF, Ground, Resistor, SignalVoltage
from components.rotational import Inertia, ViscousFriction
from components.translational import Fixed, Mass, SignalForce, SpringDamper

FORCE, MASS, WAY, FASTEST = 10.0, 2.5, 0.8, 1.2  # N, kg, m, m/s
BOUNDS: dict[str, Any] = {"command": ("-10 N", "10 N")}
THERE = {"place": (lambda s: s.mass.a.s, "== 0.8 m"), "rest": (lambda s: s.mass.v, "== 0 m/s")}
SPEED = {"speed": (lambda s: s.mass.v, "<= 1.2 m/s")}


class Cart(Component):
    """m dv/dt = u."""

    command: Staircase | TimeSeries
    force: SignalForce
    mass: Mass

    def connections(self) -> Connections:
        return connect(self.command.y, self.force.u), connect(self.force.flange, self.mass.a)


def cart(command: Staircase | TimeSeries, **start: Any) -> Cart:
    return Cart(command=command, force=SignalForce(), mass=Mass(m=MASS, **start))


def steps(*values: float) -> Staircase:
    return Staircase(times=jnp.linspace(0.0, 1.0, len(values) + 1), values=jnp.array(values))


def lines(*values: float) -> TimeSeries:
    return TimeSeries(times=jnp.linspace(0.0, 1.0, len(values)), values=jnp.array(values), smooth=False)


def rest_to_rest() -> float:
    """Full force to the middle, then full force back."""
    return 2.0 * np.sqrt(MASS * WAY / FORCE)


@pytest.mark.thorough
def test_soonest_from_rest_to_rest() -> None:
    course = control(cart(steps(5.0, -3.0)), BOUNDS, ("0.1 s", "5 s"), end=THERE, sensitivities=False)
    assert course.design.status == "optimal"
    assert course.duration == pytest.approx(rest_to_rest(), rel=1e-9)
    assert course.design.values["command.values[1]"] == -FORCE
    assert course["mass.a.s"][-1] == pytest.approx(WAY, rel=1e-9)
    assert abs(course["mass.v"][-1]) < 1e-9
    # T = 2 sqrt(m d / F)
    assert course.design.multipliers["place"] == pytest.approx(-rest_to_rest() / (2.0 * WAY), rel=1e-5)
    assert "command.values[0]" in str(course)
    # Two samples at their bounds and two equations for three variables: prices are not unique, and named as is shown.
    assert set(course.design.not_unique) <= {f"{active.name} ({active.side})" for active in course.design.active}
    panels = course.plot("command.y.value", "mass.v", units=["mm/s"]).axes
    assert [panel.get_ylabel() for panel in panels] == ["command.y.value\n[N]", "mass.v\n[mm/s]"]
    assert np.max(panels[0].get_lines()[0].get_ydata()) == FORCE


def test_the_gap_of_a_course_is_the_largest_jump(monkeypatch: pytest.MonkeyPatch) -> None:
    limits = [Limit(name, "==", 0.0, Scale()) for name in ("segments join[0]", "segments join[1]", "place")]
    results = [LimitedResult(limit, value) for limit, value in zip(limits, (1e-3, -0.2, 5.0), strict=True)]
    found: Any = SimpleNamespace(model=None, results=results)
    shooting: Any = SimpleNamespace(solutions=lambda horizon: (), times=lambda horizon: [0.0, 2.0])
    monkeypatch.setattr(courses, "_of_plant", lambda found, shooting: found)
    assert courses.course_of(found, shooting).gap == 0.2


@pytest.mark.slow
@pytest.mark.parametrize("segments", [1, 3])
def test_soonest_with_a_limit_of_the_speed(segments: int) -> None:
    course = control(
        cart(steps(5.0, 1.0, -3.0)), BOUNDS, ("0.1 s", "5 s"), end=THERE, path=SPEED, segments=segments, switching=True
    )
    assert course.duration == pytest.approx(WAY / FASTEST + MASS * FASTEST / FORCE, rel=1e-9)
    assert course.design.status == "optimal"
    prices = course.design.multipliers
    assert sum(prices[f"speed[{i}]"] for i in range(3)) == pytest.approx(WAY / FASTEST**2 - MASS / FORCE, rel=1e-5)
    ends = [prices[f"command.values[{i}]"] for i in (0, 2)]
    assert sum(ends) == pytest.approx(MASS * FASTEST / FORCE**2, rel=1e-5)
    assert course.design.sensitivities["mass.m"].per_unit == pytest.approx(FASTEST / FORCE, rel=1e-5)
    assert course.gap < 1e-9


@pytest.mark.thorough
def test_bounds_of_the_duration_hold_where_instants_are_free() -> None:
    course = control(cart(steps(5.0, -3.0)), BOUNDS, ("0.1 s", "0.8 s"), end=THERE, switching=True, sensitivities=False)
    assert course.design.status == "infeasible"
    assert "whole duration" in course.design.conflict
    assert course.duration < rest_to_rest()


@pytest.mark.slow
def test_a_duration_is_no_shorter_than_it_may_be() -> None:
    course = control(cart(steps(5.0, -3.0)), BOUNDS, ("1.2 s", "5 s"), end=THERE, switching=True, sensitivities=False)
    assert course.duration == pytest.approx(1.2, rel=1e-9)
    assert course.design.multipliers["whole duration, at least"] == pytest.approx(1.0, abs=1e-6)


@pytest.mark.slow
def test_soonest_to_the_origin_with_a_start_in_motion() -> None:
    x0, v0, a = 1.0, 0.5, FORCE / MASS
    course = control(
        cart(steps(-5.0, 5.0), v=v0, s=x0), BOUNDS, ("0.1 s", "5 s"), switching=True, sensitivities=False,
        end={"place": (lambda s: s.mass.a.s, "== 0 m"), "rest": (lambda s: s.mass.v, "== 0 m/s")},
    )  # fmt: skip
    reach = x0 / a + v0**2 / (2.0 * a**2)
    assert course.duration == pytest.approx(v0 / a + 2.0 * np.sqrt(reach), rel=1e-9)
    assert course.design.values["intervals[0]"] == pytest.approx(v0 / a + np.sqrt(reach), rel=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("segments", [1, 5])
def test_least_energy_is_a_cubic(segments: int) -> None:
    T = 0.8
    course = control(
        cart(lines(1.0, 2.0, 1.0, 0.0, -1.0, -3.0)), {"command": None}, T, {"cost": lambda s: s.force.u.value**2},
        end=THERE, segments=segments, sensitivities=False,
    )  # fmt: skip
    assert course.design.objective == pytest.approx(12.0 * MASS**2 * WAY**2 / T**3, rel=1e-9)
    force = 6.0 * MASS * WAY / T**2 * (1.0 - 2.0 * np.linspace(0.0, 1.0, 6))
    np.testing.assert_allclose(course.design.x, force, atol=1e-6 * FORCE)
    t = course.times / T
    np.testing.assert_allclose(course["mass.a.s"], WAY * t**2 * (3.0 - 2.0 * t), atol=1e-7)


class Motor(Component):
    """J dw/dt = K i - b w, at any voltage."""

    command: TimeSeries
    supply: SignalVoltage
    winding: Resistor
    emf: EMF
    rotor: Inertia
    bearing: ViscousFriction
    ground: Ground = Ground()

    def connections(self) -> Connections:
        return (
            connect(self.command.y, self.supply.u),
            connect(self.supply.p, self.winding.p),
            connect(self.winding.n, self.emf.p),
            connect(self.emf.n, self.supply.n, self.ground.p),
            connect(self.emf.shaft, self.rotor.a, self.bearing.flange),
        )


J, K, R, ANGLE, TIME = 2e-4, 0.05, 0.6, 6.0, 0.4
COPPER = {"copper loss": (lambda s: s.winding.R * s.winding.i**2, "J")}
INPUT = {"energy": (lambda s: s.winding.R * s.winding.i**2 + s.bearing.C * s.rotor.w**2, "J")}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("b", "minimise", "rate"),
    [(0.0, COPPER, 0.0), (4e-4, COPPER, 2.0), (4e-4, INPUT, 6.757711644237765)],
    ids=["frictionless", "viscous", "input energy"],
)
def test_motor_turns_an_inertia_with_least_loss(b: float, minimise: Any, rate: float) -> None:
    # Euler and Lagrange: w'' = rate^2 w + constant, which is a parabola without friction.
    motor = Motor(
        command=lines(*np.linspace(1.0, 0.5, 41)), supply=SignalVoltage(), winding=Resistor(R=R), emf=EMF(k=K),
        rotor=Inertia(J=J), bearing=ViscousFriction(C=b),
    )  # fmt: skip
    course = control(
        motor, {"command": None}, TIME, minimise, sensitivities=False,
        end={"angle": (lambda s: s.rotor.b.phi, "== 6 rad"), "rest": (lambda s: s.rotor.w, "== 0 rad/s")},
    )  # fmt: skip
    t = course.times
    if rate:
        A = ANGLE / (TIME - 2.0 / rate * np.tanh(rate * TIME / 2.0))
        speed = A * (1.0 - np.cosh(rate * (t - TIME / 2.0)) / np.cosh(rate * TIME / 2.0))
        loss = R * J**2 * rate**2 * A * ANGLE / K**2
    else:
        speed = 6.0 * ANGLE / TIME * (t / TIME) * (1.0 - t / TIME)
        loss = 12.0 * R * J**2 * ANGLE**2 / (K**2 * TIME**3)
    assert course.design.objective == pytest.approx(loss, rel=1e-6)
    np.testing.assert_allclose(course["rotor.w"], speed, atol=2e-3 * np.max(speed))


@pytest.mark.parametrize(
    ("change", "error", "said"),
    [
        ({"signals": {}}, ModelError, "at least one signal"),
        ({"signals": {"mass": (-1.0, 1.0)}}, ModelError, "mass has no times and values"),
        ({"signals": {"command": ("5 N", "-5 N")}}, ParameterError, "command.values.*below the upper one"),
        ({"duration": "1 m"}, Exception, "duration"),
        ({"duration": (2.0, 1.0)}, ParameterError, "the lower bound first"),
        ({"duration": 1.0}, ModelError, "nothing to minimise"),
        ({"segments": 3}, ModelError, "cannot be divided into 3"),
        ({"path": {"place": SPEED["speed"]}}, ModelError, "place is the name of a limit at the end"),
        ({"path": {"speed": (lambda s: s.mass.v, "== 1 m/s")}}, ModelError, "a path limit must be"),
        ({"free": {"mass.n": (1.0, 2.0)}}, ModelError, "mass.n"),
        ({"segments": 2, "guess": {"mass.x": [0.0]}}, ModelError, "is not a state"),
    ],
    ids=lambda item: "",
)
def test_wrong_problems_are_told(change: dict[str, Any], error: type[Exception], said: str) -> None:
    given: dict[str, Any] = {"signals": BOUNDS, "duration": (0.1, 5.0), "end": THERE} | change
    with pytest.raises(error, match=said):
        control(cart(steps(5.0, -3.0)), given.pop("signals"), given.pop("duration"), **given)


class Feedback(Component):
    """m dv/dt = -k_s s - k_v v."""

    mass: Mass
    spring: SpringDamper
    wall: Fixed = Fixed()

    def connections(self) -> Connections:
        return connect(self.wall.flange, self.spring.a), connect(self.spring.b, self.mass.a)


@pytest.mark.thorough
def test_gains_are_those_of_riccati() -> None:
    # The least of the integral of q s^2 + r u^2: u = -k_s s - k_v v with k_s = sqrt(q/r), k_v = sqrt(2 m k_s).
    q, r, m, s0, v0 = 4.0, 0.01, 2.0, 0.5, 1.0
    model = Feedback(mass=Mass(m=m, v=v0), spring=SpringDamper(c=10.0, d=5.0, s_rel=s0))
    design = optimise(
        model, {"spring.c": (1.0, 100.0), "spring.d": (1.0, 100.0)}, lambda s: s.integrals["cost"][-1],
        run=lambda m: simulate(
            m, 15.0, save="end", rtol=1e-10, integrals=lambda s: {"cost": q * s.spring.s_rel**2 + r * s.spring.f**2}
        ),
        sensitivities=False,
    )  # fmt: skip
    k_s = np.sqrt(q / r)
    k_v = np.sqrt(2.0 * m * k_s)
    assert design.values == pytest.approx({"spring.c": k_s, "spring.d": k_v}, rel=1e-6)
    # P of [[0, 1], [0, 0]], [0, 1/m]
    P = np.array([[r * k_s * k_v, r * m * k_s], [r * m * k_s, r * m * k_v]])
    assert design.objective == pytest.approx(float(np.array([s0, v0]) @ P @ np.array([s0, v0])), rel=1e-8)
    assert design.status == "optimal"
