"""Consistent start values."""

from typing import Any, Self

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _models import gear_train

from acausal import (
    Component,
    Connections,
    Equations,
    Scalar,
    SimulationError,
    Var,
    check,
    connect,
    eq,
    initialise,
    linearise,
    prefer,
    replace,
    simulate,
)
from components.translational import Damper, Fixed, Mass, Spring


@pytest.mark.parametrize(("ratio", "speed"), [(-3.0, 2.0), (10.0, 500.0), (50.0, -2e3)])
def test_given_start_propagates_through_gear(ratio: float, speed: float) -> None:
    """Given values hold exactly, however large the speeds are compared with their nominal size."""
    sol = simulate(gear_train(ratio, w2=speed), 1e-3, save="end")
    np.testing.assert_allclose(sol.final.second.w, speed, rtol=1e-12)
    np.testing.assert_allclose(sol.final.first.w, ratio * speed, rtol=1e-12)


class Chain(Component):
    """Two masses with a spring between them, the first with a damper to the wall."""

    first: Mass
    second: Mass
    spring: Spring
    damper: Damper
    wall: Fixed = Fixed()

    def connections(self) -> Connections:
        return (
            connect(self.wall.flange, self.damper.a),
            connect(self.damper.b, self.first.a),
            connect(self.first.b, self.spring.a),
            connect(self.spring.b, self.second.a),
        )


def chain(**starts: Any) -> Chain:
    model = Chain(first=Mass(m=1.0), second=Mass(m=2.0), spring=Spring(c=3.0), damper=Damper(d=4.0))
    return replace(model, {name.replace("__", "."): value for name, value in starts.items()})


@pytest.mark.thorough
def test_algebraic_variables_have_the_values_they_are_given() -> None:
    """The spring's length is a difference of states, the damper's force a multiple of another one."""
    sol = simulate(chain(spring__s_rel=0.2, damper__f=6.0), 0.1, save="dense")
    start = sol.at(0.0)
    np.testing.assert_allclose(start.spring.s_rel, 0.2, rtol=1e-9)
    np.testing.assert_allclose(start.second.a.s - start.first.b.s, 0.2, rtol=1e-9)
    np.testing.assert_allclose(start.damper.f, 6.0, rtol=1e-9)
    np.testing.assert_allclose(start.first.v, 1.5, rtol=1e-9)


@pytest.mark.thorough
def test_given_values_may_repeat_what_others_say() -> None:
    """The spring's length follows from the two ends; what else is given still counts."""
    model = chain(spring__s_rel=0.2, first__a__s=0.1, second__a__s=0.3, damper__f=6.0)
    start = simulate(model, 0.1, save="dense").at(0.0)
    found = jnp.stack([start.first.a.s, start.second.a.s, start.spring.s_rel])
    np.testing.assert_allclose(found, [0.1, 0.3, 0.2], rtol=1e-12)
    np.testing.assert_allclose(start.damper.f, 6.0, rtol=1e-9)


@pytest.mark.thorough
def test_derivative_with_respect_to_the_value_of_an_algebraic_variable() -> None:
    """The first mass stays where it is given to be, so that the second one has to go."""

    def end(s_rel: Any) -> Any:
        return simulate(chain(spring__s_rel=s_rel, first__a__s=0.1), 0.5, save="end", rtol=1e-10).final.second.a.s

    forward, reverse = jax.jit(jax.jacfwd(end))(0.2), jax.jit(jax.grad(end))(0.2)
    run, h = jax.jit(end), 1e-4
    np.testing.assert_allclose(forward, (run(0.2 + h) - run(0.2 - h)) / (2.0 * h), rtol=1e-7)
    np.testing.assert_allclose(reverse, forward, rtol=1e-10)


@pytest.mark.thorough
def test_contradiction_with_an_algebraic_variable_is_named() -> None:
    model = chain(spring__s_rel=0.2, first__a__s=0.1, second__a__s=0.5)
    for call in (lambda: simulate(model, 0.1, save="end"), lambda: linearise(model)):
        with pytest.raises(SimulationError, match=r"spring\.s_rel cannot have the value it is given"):
            call()
    assert "spring.s_rel" in str(check(model))


class Pair(Component):
    """Two states, their sum and their difference."""

    x: Var[Scalar, "1", prefer] = 0.8
    y: Var[Scalar, "1", prefer] = 0.1
    total: Var[Scalar, "1"] = 0.0
    apart: Var[Scalar, "1"] = 0.0
    rate: Var[Scalar, "1/s"] = 0.0
    other: Var[Scalar, "1/s"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(
            x=eq(d.x, -self.rate),
            y=eq(d.y, -self.other),
            total=eq(self.total, self.x + self.y),
            apart=eq(self.apart, self.x - self.y),
            rate=eq(self.rate, d.total + 1.0, check_units=False),
            other=eq(self.other, d.apart + 2.0, check_units=False),
        )


def test_what_depends_on_states_moves_before_they_do() -> None:
    """Each state takes half of the missing part of a given sum. The difference follows, however far it moves."""
    start = simulate(Pair(total=1.0), 0.1, save="dense").at(0.0)
    np.testing.assert_allclose(jnp.stack([start.x, start.y, start.apart]), [0.85, 0.15, 0.7], rtol=1e-3)


class AngledPendulum(Component):
    """A pendulum in Cartesian coordinates whose rod has the direction of a vector, which an angle determines."""

    phi: Var[Scalar, ""] = 0.0
    across: Var[Scalar, ""] = 0.0
    down: Var[Scalar, ""] = 0.0
    x: Var[Scalar, ""] = 0.0
    y: Var[Scalar, ""] = 0.0
    u: Var[Scalar, ""] = 0.0
    v: Var[Scalar, ""] = 0.0
    force: Var[Scalar, ""] = 0.0

    def equations(self, d: Self) -> Equations:
        length = jnp.sqrt(self.across**2 + self.down**2)
        return dict(
            across=eq(self.across, 2.0 * jnp.sin(self.phi)),
            down=eq(self.down, 2.0 * jnp.cos(self.phi)),
            place_x=eq(self.x, self.across / length),
            place_y=eq(self.y, -self.down / length),
            speed_x=eq(self.u, d.x),
            speed_y=eq(self.v, d.y),
            newton_x=eq(d.u, -self.force * self.x),
            newton_y=eq(d.v, -self.force * self.y - 9.81),
        )


def test_dependent_variables_follow_given_ones_before_the_search() -> None:
    """The direction of a vector of zeros, the guess, is not a number."""
    start = simulate(AngledPendulum(phi=0.3), 0.0).final
    np.testing.assert_allclose(jnp.stack([start.x, start.y, start.u]), [np.sin(0.3), -np.cos(0.3), 0.0], rtol=1e-12)


def test_dependent_variables_follow_before_conditions_are_met() -> None:
    start = simulate(initialise(AngledPendulum(), lambda s, d: dict(angle=eq(s.phi, 0.3))), 0.0).final
    np.testing.assert_allclose(jnp.stack([start.x, start.y]), [np.sin(0.3), -np.cos(0.3)], rtol=1e-9)


class Buckled(Component):
    """A strut at x, with two positions of rest, x = 1 and x = -1, and a pointer at y = 2 x."""

    x: Var[Scalar, "m", prefer] = 0.8
    y: Var[Scalar, "m"] = 1.6
    v: Var[Scalar, "m/s", prefer] = 0.0
    w: Var[Scalar, "m/s"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(
            speed=eq(self.v, d.x),
            pointer_speed=eq(self.w, d.y),
            pointer=eq(self.y, 2.0 * self.x),
            newton=eq(d.v, self.x - self.x**3 - self.v, check_units=False),
        )


def test_a_guess_of_a_tied_variable_guides_the_search() -> None:
    """The state x follows the guess of y, although the class has a default of x."""
    for model, expected in ((Buckled(), 1.0), (Buckled(y=-2.2), -1.0), (Buckled(x=-1.1), -1.0)):
        np.testing.assert_allclose(initialise(model, steady=True).x, expected, rtol=1e-9)
