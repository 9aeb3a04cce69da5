"""Connections: which across variables are merged, and which flows sum to zero with which signs."""

from typing import Any

import numpy as np
import pytest
from _reading import values_without_states

from acausal import Array as Parts
from acausal import Component, Connections, ModelError, connect, repeat, simulate
from acausal._reduce.aliases import ZERO, merge
from acausal._reduce.flat_model import FlatModel
from acausal._reduce.flatten import flatten
from components.blocks import Constant, Gain, Output
from components.electrical import ConstantVoltage, Ground, Pin, Resistor
from components.rotational import Fixed, Inertia, Spring
from components.translational import Mass


def flow_sets(flat: FlatModel) -> set[frozenset[tuple[str, int]]]:
    """The signed flows of each connection by name; those of one flow, which is open, left out."""
    named = ((map(flat.node_name, nodes), signs) for nodes, signs in flat.flow_sets if len(nodes) > 1)
    return {frozenset(zip(names, signs, strict=True)) for names, signs in named}


def across_sets(flat: FlatModel) -> set[frozenset[str]]:
    return {frozenset((flat.node_name(a), flat.node_name(b))) for a, b in flat.across.tolist()}


class Star(Component):
    """Three resistors at one node."""

    r: tuple[Resistor, Resistor, Resistor]

    def connections(self) -> Connections:
        a, b, c = self.r
        return connect(a.n, b.n), connect(c.n, b.n)


def test_connections_that_share_a_port_are_one_set() -> None:
    ohm = Resistor(R=1.0)
    flat = flatten(Star(r=(ohm, ohm, ohm)))
    assert flow_sets(flat) == {frozenset({("r[0].n.i", 1), ("r[1].n.i", 1), ("r[2].n.i", 1)})}
    assert across_sets(flat) == {frozenset({"r[0].n.v", "r[1].n.v"}), frozenset({"r[2].n.v", "r[1].n.v"})}


class Half(Component):
    """A resistor behind two pins of its own."""

    inner: Resistor
    p: Pin = Pin()
    n: Pin = Pin()

    def connections(self) -> Connections:
        return connect(self.p, self.inner.p), connect(self.inner.n, self.n)


class Whole(Component):
    """Two of them in series, behind pins again."""

    upper: Half
    lower: Half
    p: Pin = Pin()
    n: Pin = Pin()

    def connections(self) -> Connections:
        return connect(self.p, self.upper.p), connect(self.upper.n, self.lower.p), connect(self.lower.n, self.n)


class Nested(Component):
    source: ConstantVoltage
    load: Whole
    ground: Ground = Ground()

    def connections(self) -> Connections:
        return (
            connect(self.source.p, self.load.p),
            connect(self.load.n, self.source.n, self.ground.p),
        )


def nested() -> Nested:
    load = Whole(upper=Half(inner=Resistor(R=3.0)), lower=Half(inner=Resistor(R=2.0)))
    return Nested(source=ConstantVoltage(V=10.0), load=load)


def test_a_port_counts_with_opposite_signs_from_inside_and_outside() -> None:
    assert flow_sets(flatten(nested())) == {
        frozenset({("source.p.i", 1), ("load.p.i", 1)}),
        frozenset({("load.p.i", -1), ("load.upper.p.i", 1)}),
        frozenset({("load.upper.p.i", -1), ("load.upper.inner.p.i", 1)}),
        frozenset({("load.upper.inner.n.i", 1), ("load.upper.n.i", -1)}),
        frozenset({("load.upper.n.i", 1), ("load.lower.p.i", 1)}),
        frozenset({("load.lower.p.i", -1), ("load.lower.inner.p.i", 1)}),
        frozenset({("load.lower.inner.n.i", 1), ("load.lower.n.i", -1)}),
        frozenset({("load.lower.n.i", 1), ("load.n.i", -1)}),
        frozenset({("load.n.i", 1), ("source.n.i", 1), ("ground.p.i", 1)}),
    }


def test_currents_through_nested_composites() -> None:
    values = values_without_states(nested())
    for name in ("load.p.i", "load.upper.p.i", "load.lower.inner.i"):
        np.testing.assert_allclose(values[name], 2.0, rtol=1e-14)
    np.testing.assert_allclose(values["load.n.i"], -2.0, rtol=1e-14)
    np.testing.assert_allclose(values["load.lower.p.v"], 4.0, rtol=1e-14)
    np.testing.assert_allclose(values["ground.p.i"], 0.0, atol=1e-14)


class Line(Component):
    """Inertias joined by springs, and the first held by a wall."""

    masses: Parts[Inertia]
    springs: Parts[Spring]
    wall: Fixed = Fixed()

    def connections(self) -> Connections:
        return (
            connect(self.masses[:-1].b, self.springs[:].a),
            connect(self.masses[1:].a, self.springs[:].b),
            connect(self.masses[0].a, self.wall.flange),
        )


def test_arrays_joined_by_slices() -> None:
    flat = flatten(Line(masses=repeat(Inertia(J=1.0), 3), springs=repeat(Spring(c=1.0), 2)))
    assert flow_sets(flat) == {
        frozenset({("masses[0].b.tau", 1), ("springs[0].a.tau", 1)}),
        frozenset({("masses[1].b.tau", 1), ("springs[1].a.tau", 1)}),
        frozenset({("masses[1].a.tau", 1), ("springs[0].b.tau", 1)}),
        frozenset({("masses[2].a.tau", 1), ("springs[1].b.tau", 1)}),
        frozenset({("masses[0].a.tau", 1), ("wall.flange.tau", 1)}),
    }


class FanOut(Component):
    """One output read by two gains, one of which feeds the other model's output."""

    source: Constant
    gains: tuple[Gain, Gain]
    y: Output = Output()

    def connections(self) -> Connections:
        first, second = self.gains
        return connect(self.source.y, first.u, second.u), connect(second.y, self.y)


def test_one_output_to_many_inputs() -> None:
    model = FanOut(source=Constant(k=3.0), gains=(Gain(k=2.0), Gain(k=-5.0)))
    assert flow_sets(flatten(model)) == set()
    values = values_without_states(model)
    assert [float(values[name]) for name in ("gains[0].u.value", "gains[0].y.value", "y.value")] == [3.0, 6.0, -15.0]


def test_an_open_flow_is_zero() -> None:
    flat = flatten(Line(masses=repeat(Inertia(J=1.0), 2), springs=repeat(Spring(c=1.0), 1)))
    merged = merge(flat)
    zero = {flat.node_name(node) for node in np.flatnonzero(merged.representative == ZERO).tolist()}
    # The wall holds the first mass and so its angle; the free end of the last one passes no torque.
    assert zero == {"masses[1].b.tau", "wall.flange.phi", "masses[0].a.phi", "masses[0].b.phi", "springs[0].a.phi"}


class Pair(Component):
    """Whatever `join` joins."""

    r: Resistor
    mass: Mass
    gains: tuple[Gain, Gain]
    masses: Parts[Inertia]
    springs: Parts[Spring]
    case: str

    def connections(self) -> Connections:
        return (CASES[self.case][0](self),)


CASES: dict[str, tuple[Any, str]] = {
    "kinds": (lambda m: connect(m.r.p, m.mass.a), r"r\.p is a Pin and mass\.a a Flange; only .* Put a component"),
    "counts": (
        lambda m: connect(m.masses[:].b, m.springs[:].a),
        r"masses\[0\]\.b and springs\[0\]\.a stand for 3 and 2 ports\. Select equally many",
    ),
    "part": (lambda m: connect(m.r, m.r.p), r"two or more ports, got \(Resistor, Pin\)\. Name the port"),
    "alone": (lambda m: connect(m.r.p), r"two or more ports, got \(Pin\)"),
    "signal to pin": (lambda m: connect(m.gains[0].y, m.r.p), r"gains\[0\]\.y is a Output and r\.p a Pin"),
}


@pytest.mark.parametrize("case", CASES)
def test_mismatched_ports(case: str) -> None:
    model = Pair(
        r=Resistor(R=1.0),
        mass=Mass(m=1.0),
        gains=(Gain(k=1.0), Gain(k=1.0)),
        masses=repeat(Inertia(J=1.0), 3),
        springs=repeat(Spring(c=1.0), 2),
        case=case,
    )
    with pytest.raises(ModelError, match="Pair: .*" + CASES[case][1]):
        flatten(model)


class Deaf(Component):
    gain: Gain


class Rack(Component):
    deaf: Deaf


def test_open_input() -> None:
    with pytest.raises(ModelError, match=r"deaf\.gain\.u is not connected: it needs a connection"):
        simulate(Rack(deaf=Deaf(gain=Gain(k=1.0))), 1.0)
