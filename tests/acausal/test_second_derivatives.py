"""Second derivatives of smooth runs against differences of gradients."""

from typing import Any, Self

import equinox as eqx
import jax
import pytest

from acausal import (
    Component,
    Connections,
    Equations,
    Param,
    Scalar,
    Var,
    connect,
    eq,
    ifelse,
    replace,
    simulate,
)
from components.translational import Damper, DualRateSpring, Fixed, Mass
from docs.drive import drive


@pytest.mark.slow
@pytest.mark.parametrize(("result", "step"), [("time of a stop", 1e-3), ("end value", 1e-2)])
def test_hessian_against_differences_of_gradients(result: str, step: float) -> None:
    def value(ratio: Scalar) -> Scalar:
        model = eqx.tree_at(lambda m: m.gear.ratio, drive, ratio)
        if result == "end value":
            return simulate(model, 0.05, save="end", rtol=1e-8).final.load.w
        return simulate(model, 0.5, until=lambda s: s.load.b.phi - 0.8, save="end", rtol=1e-8).t1

    slope, bend = jax.jit(jax.jacfwd(value)), jax.jacfwd(jax.jacfwd(value))
    once, twice = ((slope(20.0 + h) - slope(20.0 - h)) / (2.0 * h) for h in (step, 2.0 * step))
    assert float(bend(20.0)) == pytest.approx(float((4.0 * once - twice) / 3.0), rel=1e-6)


class Bent(Component):
    """The integral of the distance between x and p, which x passes."""

    p: Param[Scalar, "1"] = 0.3
    x: Var[Scalar, "1"] = -1.0
    y: Var[Scalar, "1"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(x=eq(d.x, 1.0, check_units=False), y=eq(d.y, self._distance(), check_units=False))

    def _distance(self) -> Scalar:
        return ifelse(self.x < self.p, self.p - self.x, self.x - self.p)


class Swing(Component):
    """A mass on a spring that gets stiffer."""

    mass: Mass
    spring: DualRateSpring
    damper: Damper
    ground: Fixed

    def connections(self) -> Connections:
        return (
            connect(self.mass.b, self.spring.a, self.damper.a),
            connect(self.spring.b, self.damper.b, self.ground.flange),
        )


@pytest.mark.parametrize("second", [jax.hessian, lambda f: jax.jacfwd(jax.jacfwd(f))])
def test_second_derivatives_where_equations_bend(second: Any) -> None:
    """The moment of a bend moves, and with it where the slopes of its two sides hold: twice their difference here."""

    def end(p: Scalar) -> Scalar:
        return simulate(Bent(p=p), 3.0, save="end", rtol=1e-9).final.y

    assert float(second(end)(0.3)) == pytest.approx(2.0, rel=1e-9)


@pytest.mark.thorough
@pytest.mark.parametrize(("name", "value", "step"), [("spring.knee", 0.2, 1e-3), ("spring.c_1", 10.0, 1e-1)])
def test_hessian_of_a_swing_on_a_spring_in_two_pieces(name: str, value: float, step: float) -> None:
    spring = DualRateSpring(c_1=10.0, c_2=60.0, knee=0.2, s_rel0=1.0)
    swing = Swing(mass=Mass(m=1.0, s=0.0, v=0.0), spring=spring, damper=Damper(d=0.3), ground=Fixed(s0=1.3))

    def end(x: Scalar) -> Scalar:
        return simulate(replace(swing, {name: x}), 3.0, save="end", rtol=1e-9).final.mass.b.s

    slope = jax.jit(jax.grad(end))
    once, twice = ((slope(value + h) - slope(value - h)) / (2.0 * h) for h in (step, 2.0 * step))
    assert float(jax.hessian(end)(value)) == pytest.approx(float((4.0 * once - twice) / 3.0), rel=1e-5)


@pytest.mark.thorough
def test_a_step_that_a_bend_makes_fail_is_repeated_up_to_it() -> None:
    """Shortened by the error alone, it would be rejected again and again on the way there."""
    assert simulate(Bent(), 3.0, save="end", rtol=1e-9).stats["num_rejected_steps"] < 5
