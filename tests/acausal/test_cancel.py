"""Equations that depend on each other although their structure does not show it."""

from fractions import Fraction
from typing import Self

import jax.numpy as jnp
import numpy as np
import pytest
from _models import rc
from hypothesis import given, settings
from hypothesis import strategies as st

from acausal import Component, Connections, Equations, Param, Scalar, StructureError, Var, connect, eq, simulate
from acausal._evaluate.building import build
from acausal._reduce.index import FRACTIONS, MODULAR, dependencies, modular
from components.electrical import Capacitor, ConstantVoltage, Ground, Inductor, Resistor

NUMBERS = st.integers(-3, 3)


@given(st.lists(st.lists(NUMBERS, min_size=5, max_size=5), min_size=1, max_size=7))
@settings(deadline=None)
def test_dependencies_span_the_left_null_space(matrix: list[list[int]]) -> None:
    exact = [{j: Fraction(x) for j, x in enumerate(row) if x} for row in matrix]
    found = dependencies(exact, FRACTIONS)
    array = np.array(matrix, float)
    assert len(found) == len(matrix) - np.linalg.matrix_rank(array)
    factors = np.array([[float(parts.get(i, 0)) for i in range(len(matrix))] for parts in found]).reshape(
        -1, len(matrix)
    )
    np.testing.assert_allclose(factors @ array, 0.0, atol=1e-9)
    assert np.linalg.matrix_rank(factors) == len(found)
    in_field = [{j: modular(x) for j, x in enumerate(row) if x} for row in matrix]
    assert len(dependencies(in_field, MODULAR)) == len(found)


def test_modular_numbers_keep_fractions() -> None:
    half, third = modular(0.5), MODULAR.ratio(1, 3)
    assert MODULAR.tidy(2 * half) == 1
    assert MODULAR.tidy(3 * third) == 1


class Bridge(Component):
    """A capacitor straight across a source that floats between two resistors to the ground."""

    source: ConstantVoltage
    capacitor: Capacitor
    left: Resistor
    right: Resistor
    ground: Ground = Ground()

    def connections(self) -> Connections:
        return (
            connect(self.source.p, self.capacitor.p, self.left.p),
            connect(self.source.n, self.capacitor.n, self.right.p),
            connect(self.left.n, self.right.n, self.ground.p),
        )


@pytest.mark.thorough
def test_capacitor_across_a_floating_source() -> None:
    bridge = Bridge(
        source=ConstantVoltage(V=2.0), capacitor=Capacitor(C=1.0), left=Resistor(R=1.0), right=Resistor(R=3.0)
    )
    assert not build(bridge).states
    sol = simulate(bridge, 1.0)
    np.testing.assert_allclose(sol.final.capacitor.v, 2.0)
    np.testing.assert_allclose(sol.final.left.v - sol.final.right.v, 2.0)
    np.testing.assert_allclose(sol.final.left.i, -sol.final.right.i)
    np.testing.assert_allclose(sol.final.left.i, 2.0 / 4.0)


class Island(Component):
    """Two inductors are the only links to a part of the circuit with two resistors side by side."""

    source: ConstantVoltage
    into: Inductor
    out: Inductor
    one: Resistor
    other: Resistor
    ground: Ground = Ground()

    def connections(self) -> Connections:
        return (
            connect(self.source.p, self.into.p),
            connect(self.into.n, self.one.p, self.other.p),
            connect(self.one.n, self.other.n, self.out.p),
            connect(self.out.n, self.source.n, self.ground.p),
        )


@pytest.mark.thorough
def test_inductors_as_the_only_links_carry_one_current() -> None:
    island = Island(
        source=ConstantVoltage(V=5.0),
        into=Inductor(L=1.0),
        out=Inductor(L=2.0),
        one=Resistor(R=3.0),
        other=Resistor(R=6.0),
    )
    sol = simulate(island, 1.0, rtol=1e-10)
    assert len(sol.system.states) == 1
    current = 5.0 / 2.0 * (1.0 - np.exp(-2.0 / 3.0))
    np.testing.assert_allclose(sol.final.out.i, current, rtol=1e-9)
    np.testing.assert_allclose(sol.final.one.i, current * 2.0 / 3.0, rtol=1e-9)


class Twice(Component):
    """Two equations that say the same of two variables, one of them with a known offset."""

    offset: Param[Scalar, "1"] = 1.0
    x: Var[Scalar, "1"] = 0.0
    y: Var[Scalar, "1"] = 0.0
    z: Var[Scalar, "1"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(
            one=eq(self.x + self.y, self.z),
            two=eq(self.x + self.y, self.z + self.offset),
            rate=eq(d.z, -self.x, check_units=False),
        )


def test_contradiction_names_the_equations() -> None:
    with pytest.raises(StructureError, match=r"repeat or contradict(?s:.)*one, two"):
        build(Twice())


class Mirrored(Component):
    """Two sums of rates that say the same of x and y, without a combination of fixed equations that shows it."""

    x: Var[Scalar, "1"] = 0.0
    y: Var[Scalar, "1"] = 0.0
    a: Var[Scalar, "1"] = 0.0
    b: Var[Scalar, "1"] = 0.0

    def equations(self, d: Self) -> Equations:
        return dict(
            one=eq(d.x + d.y, self.a, check_units=False),
            two=eq(d.x + d.y, self.b, check_units=False),
            left=eq(self.a, -jnp.sin(self.x)),
            right=eq(self.b, -jnp.sin(self.y)),
        )


def test_equations_that_cannot_be_rewritten_are_refused() -> None:
    with pytest.raises(StructureError, match="Equations cancel"):
        simulate(Mirrored(), 1.0)


def test_what_does_not_cancel_is_left_as_it_is() -> None:
    system = build(rc())
    assert all(family.names is None for family in system.ordered.table.families)
