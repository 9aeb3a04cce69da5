"""Messages about wrong models, wrong numbers and failed runs: each names the culprit and a remedy."""

from collections.abc import Callable
from typing import Any, Self

import equinox as eqx
import jax
import jax.numpy as jnp
import pytest
from _models import oscillator, rc

from acausal import (
    Component,
    Connections,
    Equations,
    ModelError,
    Param,
    Scalar,
    SimulationError,
    StructureError,
    Var,
    choose_states,
    connect,
    eq,
    simulate,
)
from components import hydraulic, rotational, translational
from components.electrical import Capacitor, ConstantVoltage, Ground, Resistor, TwoPin


class Loose(Component):
    """A variable that no equation mentions."""

    x: Var[Scalar, ""] = 1.0
    loose: Var[Scalar, ""] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(decay=eq(d.x, -self.x))


class Empty(Component):
    x: Var[Scalar, "m"] = 1.0


class Holder(Component):
    part: Loose


def test_variable_in_no_equation() -> None:
    with pytest.raises(StructureError, match=r"Too few equations(.|\n)*part\.loose(.|\n)*Remedy"):
        simulate(Holder(part=Loose()), 1.0)


def test_model_without_equations() -> None:
    with pytest.raises(StructureError, match=r"(?s)Too few equations.*x"):
        simulate(Empty(), 1.0)


def test_system_of_another_model() -> None:
    with pytest.raises(ModelError, match="choose_states"):
        simulate(oscillator(), 1.0, system=choose_states(rc()))


READERS = {
    "t1": lambda sol: sol.t1,
    "final": lambda sol: sol.final.c.v,
    "trajectory": lambda sol: sol["c.v"],
    "integrals": lambda sol: sol.integrals["charge"],
}


@pytest.mark.parametrize("reader", READERS)
def test_failure_under_jit_shows_whatever_is_read(reader: str) -> None:
    """A result that is not the end time must not hide that the run went wrong."""

    @eqx.filter_jit
    def run(R: Scalar) -> Scalar:
        model = eqx.tree_at(lambda m: m.r.R, rc(), R)
        sol = simulate(model, 0.1, save=jnp.array([0.05, 0.1]), integrals=lambda s: {"charge": s.c.i})
        return READERS[reader](sol)

    run(jnp.asarray(100.0))
    with pytest.raises(RuntimeError, match=r"r\.R must be nonnegative"):
        run(jnp.asarray(-100.0))


@pytest.mark.parametrize(("option", "value"), [("save", "step"), ("direction", "upwards")])
def test_unknown_option(option: str, value: str) -> None:
    keywords: dict[str, Any] = {option: value}
    with pytest.raises(ModelError, match=f"(?s){option}.*{value}"):
        simulate(rc(), 1.0, until=lambda s: s.c.v - 1.0, **keywords)


def test_condition_of_wrong_shape() -> None:
    with pytest.raises(ModelError, match="until"):
        simulate(rc(), 1.0, until=lambda s: jnp.stack([s.c.v - 1.0, s.c.v - 2.0]))


def test_condition_that_is_a_truth_value() -> None:
    with pytest.raises(ModelError, match="until"):
        simulate(rc(), 1.0, until=lambda s: s.c.v > 1.0)


class Circuit(Component):
    """Two-poles side by side, all from one node to another; with `grounded`, one of the nodes is the reference."""

    members: tuple[TwoPin, ...]
    ground: Ground | None = None

    def connections(self) -> Connections:
        low = [member.n for member in self.members]
        grounds = [] if self.ground is None else [self.ground.p]
        return connect(*(member.p for member in self.members)), connect(*low, *grounds)


class Ring(Component):
    """Three two-poles one after the other in a ring, none of them grounded."""

    members: tuple[TwoPin, TwoPin, TwoPin]

    def connections(self) -> Connections:
        a, b, c = self.members
        return connect(a.n, b.p), connect(b.n, c.p), connect(c.n, a.p)


class Loop(Component):
    """Two elements, joined at both ends."""

    one: translational.Compliant | hydraulic.TwoPort
    two: translational.Compliant | hydraulic.TwoPort

    def connections(self) -> Connections:
        return connect(self.one.a, self.two.a), connect(self.one.b, self.two.b)


@pytest.mark.parametrize(
    ("element", "reference"),
    [
        (lambda: translational.Spring(c=1.0), "a Fixed"),
        (lambda: hydraulic.LaminarResistance(resistance=1e9), "a Tank"),
    ],
)
def test_a_missing_reference_is_named_as_its_port_names_it(element: Callable[[], Any], reference: str) -> None:
    with pytest.raises(StructureError, match=rf"no reference: connect {reference} to it"):
        simulate(Loop(one=element(), two=element()), 1.0)


def test_loop_of_two_without_ground() -> None:
    model = Circuit(members=(ConstantVoltage(V=5.0), Resistor(R=1.0)))
    with pytest.raises(StructureError, match=r"(?s)members\[\d\].*Ground"):
        simulate(model, 1.0)


def test_loop_of_three_without_ground() -> None:
    model = Ring(members=(ConstantVoltage(V=5.0), Resistor(R=1.0), Capacitor(C=1.0)))
    with pytest.raises(StructureError, match=r"(?s)members\[\d\].*Ground"):
        simulate(model, 1.0)


def test_node_of_three_without_ground() -> None:
    model = Circuit(members=(ConstantVoltage(V=5.0), Resistor(R=1.0), Resistor(R=1.0)))
    with pytest.raises(StructureError, match=r"(?s)members\[\d\].*Ground"):
        simulate(model, 1.0)


def test_ideal_sources_in_parallel() -> None:
    model = Circuit(members=(ConstantVoltage(V=5.0), ConstantVoltage(V=6.0), Resistor(R=1.0)), ground=Ground())
    with pytest.raises(
        StructureError, match=r"(?s)Too many equations.*members\[0\].*members\[1\].*sources in parallel"
    ):
        simulate(model, 1.0)


class OpenRing(Component):
    """A planetary gear whose ring takes up no torque."""

    drive: rotational.ConstantTorque
    gear: rotational.PlanetaryGear
    load: rotational.Inertia

    def connections(self) -> Connections:
        return connect(self.drive.flange, self.gear.sun), connect(self.gear.carrier, self.load.a)


def test_an_open_port_that_leaves_too_many_equations_is_named() -> None:
    model = OpenRing(
        drive=rotational.ConstantTorque(torque=1.0),
        gear=rotational.PlanetaryGear(ring_to_sun=2.0),
        load=rotational.Inertia(J=1.0),
    )
    with pytest.raises(StructureError, match=r"Nothing is connected to gear\.ring, so tau is zero there\.") as caught:
        simulate(model, 1.0)
    assert "load" not in str(caught.value)  # whose open port is usual


class Twice(Component):
    """A variable that two equations determine."""

    x: Var[Scalar, ""] = 1.0
    y: Var[Scalar, ""] = 1.0
    k: Param[Scalar, ""] = 2.0

    def equations(self, d: Self) -> Equations:
        return dict(law=eq(d.x, -self.x), level=eq(self.y, self.k), again=eq(self.y, self.k * self.k))


class Outer(Component):
    part: Twice


def test_too_many_equations_are_named_and_others_are_not() -> None:
    with pytest.raises(StructureError, match=r"3 equations for 2 variables") as info:
        simulate(Outer(part=Twice()), 1.0)
    (line,) = (line for line in str(info.value).splitlines() if line.startswith("  equations:"))
    assert set(line.partition("equations:")[2].replace(" ", "").split(",")) == {"part.level", "part.again"}
    assert "Remedy: remove one" in str(info.value)


def test_start_value_against_a_source() -> None:
    """A capacitor straight across 5 V cannot start at 2 V."""
    model = Circuit(members=(ConstantVoltage(V=5.0), Capacitor(C=1.0, v=2.0)), ground=Ground())
    with pytest.raises(SimulationError, match=r"members\[1\]\.v cannot have the value.*omit the start value"):
        simulate(model, 1.0)


def test_start_value_that_agrees_with_a_source() -> None:
    model = Circuit(members=(ConstantVoltage(V=5.0), Capacitor(C=1.0, v=5.0)), ground=Ground())
    assert float(simulate(model, 1.0, save="end").final.members[1].v) == pytest.approx(5.0, rel=1e-12)


def test_unknown_name_in_a_condition() -> None:
    with pytest.raises(ModelError, match=r"until: .*voltage.*shape of the model"):
        simulate(rc(), 1.0, until=lambda s: s.c.voltage)  # pyright: ignore[reportAttributeAccessIssue]


def test_times_outside_the_run() -> None:
    with pytest.raises(ModelError, match=r"between t0 and t1, got 1\.5 with t0=0\.0 and t1=1\.0"):
        simulate(rc(), 1.0, save=jnp.array([0.5, 1.5]))


class Printing(Component):
    """Prints where it states its equation."""

    x: Var[Scalar, ""] = 1.0

    def equations(self, d: Self) -> Equations:
        jax.debug.print("{}", self.x)
        return dict(decay=eq(d.x, -self.x))


@pytest.mark.thorough
def test_equations_that_print_say_where_it_is_possible(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(ModelError, match=r"Printing\.equations has a side effect.* print them in a function"):
        simulate(Printing(), 1.0)

    def printed(s: Any) -> Any:
        jax.debug.print("at {}", s.c.v)
        return s.c.v

    simulate(rc(), 0.1, peaks=printed)
    jax.effects_barrier()
    assert "at 0.0\n" in capsys.readouterr().out
