"""All that is wrong with a model at once."""

from typing import Self

import equinox as eqx
import jax.numpy as jnp
import pytest
from _models import gear_train, rc

from acausal import Component, Connections, Equations, Param, Scalar, Var, check, connect, eq, prefer
from components.electrical import Capacitor, ConstantVoltage, Ground, Resistor, TwoPin
from components.rotational import Inertia


def test_nothing_wrong() -> None:
    found = check(rc())
    assert found
    assert found.problems == ()
    assert str(found).startswith("No problems found.\n20 variables, 3 parameters\n")


def test_parameters_out_of_range() -> None:
    """`eqx.tree_at` runs no checks."""
    found = check(eqx.tree_at(lambda m: (m.r.R, m.c.C), rc(), (jnp.asarray(-1.0), jnp.asarray(0.0))))
    assert not found
    assert found.problems == (
        "r.R must be nonnegative and finite (otherwise use NegativeResistor), got -1.0 ohm.",
        "c.C must be positive and finite, got 0.0 F.",
    )
    assert str(found).splitlines()[0] == "2 problems found."
    assert found.summary == "The structure was not analysed: correct these first."


class Mismatch(Component):
    """A resistor joined with a shaft, and with another one that is named without its port."""

    r: Resistor
    other: Resistor
    rotor: Inertia

    def connections(self) -> Connections:
        return (connect(self.r.n, self.rotor.a),)


class Both(Component):
    pair: Mismatch
    circuit: Component


def test_connections_and_parameters_at_once() -> None:
    circuit = eqx.tree_at(lambda m: m.r.R, rc(), jnp.asarray(-1.0))
    pair = Mismatch(r=Resistor(R=1.0), other=Resistor(R=1.0), rotor=Inertia(J=1.0))
    connection, parameter = check(Both(pair=pair, circuit=circuit)).problems
    assert connection.startswith("pair: pair.r.n is a Pin and pair.rotor.a a Flange")
    assert parameter == "circuit.r.R must be nonnegative and finite (otherwise use NegativeResistor), got -1.0 ohm."


class WrongTwice(Component):
    """An equation whose units do not agree, and a variable that none determines."""

    x: Var[Scalar, "m"] = 0.0
    y: Var[Scalar, "m"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(decay=eq(d.x, -self.x))


def test_units_and_structure_at_once() -> None:
    found = check(WrongTwice())
    units, structure = found.problems
    assert "equation decay: equates d.x in m/s with -self.x in m" in units
    assert structure.startswith("Too few equations: no equation determines y.")
    assert str(found).splitlines()[-1] == "The start was not computed: correct these first."


class Circuit(Component):
    """Two-poles side by side."""

    members: tuple[TwoPin, ...]
    ground: Ground = Ground()

    def connections(self) -> Connections:
        return connect(*(m.p for m in self.members)), connect(*(m.n for m in self.members), self.ground.p)


@pytest.mark.thorough
def test_contradicting_start_values() -> None:
    (problem,) = check(Circuit(members=(ConstantVoltage(V=5.0), Capacitor(C=1.0, v=2.0)))).problems
    assert problem == "members[1].v: the start values contradict the equations. Omit some of them."
    (problem,) = check(gear_train(2.0, w1=1.0, w2=1.0)).problems
    assert {"first.w", "second.w"} & set(problem.partition(":")[0].split(", "))


def test_singular_block_at_the_start() -> None:
    """A resistance of zero straight across a source leaves the current open."""
    (problem,) = check(Circuit(members=(ConstantVoltage(V=5.0), Resistor(R=0.0)))).problems
    assert problem.startswith("members[0].i is infinite or not a number at the start. The equations members[1].ohm for")
    assert "for members[0].i are singular there" in problem
    assert "Remedy: look for parameters that are zero" in problem


class Rootless(Component):
    """y^2 = -1 - x."""

    T: Param[Scalar, "s"] = 1.0
    x: Var[Scalar, "1", prefer] = 0.0
    y: Var[Scalar, "1"] = 0.5

    def equations(self, d: Self) -> Equations:
        return dict(square=eq(self.y**2, -1.0 - self.x), rate=eq(self.T * d.x, self.y))


def test_nonlinear_block_without_solution() -> None:
    (problem,) = check(Rootless()).problems
    assert "The equations square for y have no solution there, or the iteration does not converge to it" in problem
    assert "give start values near the solution for y" in problem
