"""The choice of the variables that are integrated."""

from typing import Any, Self

import equinox as eqx
import numpy as np
import pytest
from _mechanisms import Pendulum, Swing
from _models import gear_train, oscillator, rc, rectifier

from acausal import (
    Component,
    Connections,
    Discrete,
    Equations,
    Param,
    Scalar,
    SimulationError,
    StructureError,
    Var,
    avoid,
    choose_states,
    connect,
    eq,
    prefer,
    simulate,
)
from acausal._evaluate.building import build, system_of
from components.rotational import Flange, IdealGear


class Rotor(Component, partial=True):
    J: Param[Scalar, "kg.m2"] = 1.0
    w: Var[Scalar, "rad/s"] = 0.0
    a: Flange = Flange()

    def equations(self, d: Any) -> Equations:
        return dict(speed=eq(self.w, d.a.phi), newton=eq(self.J * d.w, self.a.tau))


class Plain(Rotor):
    pass


class Preferred(Rotor):
    w: Var[Scalar, "rad/s", prefer] = 0.0


class Avoided(Rotor):
    w: Var[Scalar, "rad/s", avoid] = 0.0


class Geared(Component):
    left: Plain | Preferred | Avoided
    right: Plain | Preferred | Avoided
    gear: IdealGear

    def connections(self) -> Connections:
        return connect(self.left.a, self.gear.a), connect(self.gear.b, self.right.a)


def speed_states(left: type[Any], right: type[Any]) -> list[str]:
    model = Geared(left=left(), right=right(), gear=IdealGear(ratio=2.0))
    return [name for name in system_of(model).state_names if name.endswith(".w")]


@pytest.mark.parametrize(("better", "worse"), [(Preferred, Plain), (Preferred, Avoided), (Plain, Avoided)])
def test_the_better_liked_speed_is_the_state(better: type[Any], worse: type[Any]) -> None:
    assert speed_states(better, worse) == ["left.w"]
    assert speed_states(worse, better) == ["right.w"]


def test_the_choice_does_not_depend_on_what_was_compiled_before() -> None:
    model = gear_train(2.0)
    before = build(model)
    for other in (rc(), oscillator(), rectifier(5.0), Pendulum(x=1.0)):
        build(other)
    after = build(model)
    assert before is not after
    assert before.state_names == after.state_names
    assert [block.unknowns for block in before.ordered.blocks] == [block.unknowns for block in after.ordered.blocks]
    assert [torn.tears for torn in before.torn] == [torn.tears for torn in after.torn]


def test_the_choice_does_not_depend_on_the_numbers() -> None:
    assert system_of(gear_train(2.0)) is system_of(gear_train(-1e-6, w1=3.0))


@pytest.mark.thorough
def test_the_choice_is_the_same_under_jit() -> None:
    systems = []

    @eqx.filter_jit
    def run(model: Any) -> Any:
        sol = simulate(model, 0.1, save="end")
        systems.append(sol.system)
        return sol.t1

    run(gear_train(2.0))
    assert systems == [system_of(gear_train(5.0))]


@pytest.mark.parametrize(
    ("ratio", "states"), [(0.5, {"gear.b.phi", "second.w"}), (100.0, {"first.w", "drive.flange.phi"})]
)
def test_compile_pivots_on_the_numbers(ratio: float, states: set[str]) -> None:
    """The side of a gear on which the other one depends strongly is integrated; the classes do not tell which."""
    assert set(choose_states(gear_train(ratio)).state_names) == states


@pytest.mark.parametrize("start", [{"x": 1.0}, {"y": -1.0}])
def test_compile_keeps_all_candidates_where_no_pivot_is_safe(start: dict[str, Any]) -> None:
    """A pivot that is good at the start may vanish in a run."""
    assert set(choose_states(Pendulum(**start)).state_names) == {"x", "y", "u", "v"}


@pytest.mark.thorough
def test_compile_in_a_singular_position() -> None:
    """At the joint of the rod its constraint has no slope, so that no point on it is found."""
    model = Pendulum(x=0.0, y=0.0)
    with pytest.raises(SimulationError, match=r"The start values contradict the equations\. [xy] "):
        simulate(model, 1.0, system=choose_states(model))


def test_a_forced_choice_in_a_singular_position() -> None:
    with pytest.raises(StructureError, match=r"No states can be chosen.*rod.*Change the start values"):
        choose_states(Swing(x=0.0, y=0.0))


def test_compile_needs_numbers() -> None:
    with pytest.raises(Exception, match=r"choose_states\(model\) needs concrete numbers"):
        eqx.filter_jit(choose_states)(rc())


class Rod(Component):
    """A point on a circle whose radius is a discrete variable: its equation is differentiated."""

    L: Discrete[Scalar, "m"] = 1.0
    x: Var[Scalar, "m"] = 1.0
    y: Var[Scalar, "m"] = 0.0
    u: Var[Scalar, "m/s"] = 0.0
    v: Var[Scalar, "m/s"] = 0.0
    pull: Var[Scalar, "1/s2"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(
            x=eq(d.x, self.u),
            y=eq(d.y, self.v),
            u=eq(d.u, -self.pull * self.x),
            v=eq(d.v, -self.pull * self.y - 9.81, check_units=False),
            rod=eq(self.x**2 + self.y**2, self.L**2),
        )


@pytest.mark.thorough
def test_a_differentiated_equation_may_read_a_discrete_variable() -> None:
    model = Rod()
    chosen = simulate(model, 0.3, save="end", system=choose_states(model)).final.x
    np.testing.assert_allclose(chosen, simulate(model, 0.3, save="end").final.x, rtol=1e-6)
