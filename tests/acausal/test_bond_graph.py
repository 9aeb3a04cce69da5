"""Bond graphs against textbook causality (Karnopp, Margolis, Rosenberg, `System Dynamics`), closed forms and poles."""

import dataclasses

import matplotlib.pyplot as plt
import numpy as np
import pytest
from _models import rc
from matplotlib.axes import Axes
from test_diagram import Chain

from acausal import BondGraph, Component, Connections, ModelError, bond_graph, connect, linearise, repeat, replace
from acausal._show.bond_graph import Bond, BondNode, causality
from components.electrical import Capacitor, ConstantVoltage, Ground, Inductor, Resistor
from components.rotational import Cam, EccentricDisc, Inertia, SpringDamper
from components.translational import Fixed, Mass, Spring
from docs.drive import drive


class Series(Component):
    """A source, a resistor, an inductor and a capacitor in series."""

    source: ConstantVoltage
    resistor: Resistor
    inductor: Inductor
    capacitor: Capacitor
    ground: Ground = Ground()

    def connections(self) -> Connections:
        return (
            connect(self.source.p, self.resistor.p),
            connect(self.resistor.n, self.inductor.p),
            connect(self.inductor.n, self.capacitor.p),
            connect(self.capacitor.n, self.source.n, self.ground.p),
        )


def strokes(graph: BondGraph) -> dict[tuple[str, str], bool]:
    """For each element whether the stroke of its bond is at it: it is told the effort, and sets the flow."""
    found = {}
    for bond, stroke in zip(graph.bonds, graph.strokes, strict=True):
        for end in bond[:2]:
            place = graph.places[end]
            if place.kind in ("I", "C", "R", "Se", "Sf"):
                found[place.kind, place.name] = stroke == end
    return found


@pytest.mark.thorough
def test_series_circuit() -> None:
    """One junction of common flow; the source and the stores decide, so that the resistor takes the flow."""
    model = Series(
        source=ConstantVoltage(V=5.0), resistor=Resistor(R=2.0), inductor=Inductor(L=0.1), capacitor=Capacitor(C=1e-3)
    )
    graph = bond_graph(model)
    kinds = sorted(place.kind for place in graph.places)
    assert kinds == ["1", "C", "I", "R", "Se"]
    values = {place.kind: place.value for place in graph.places}
    assert {kind: values[kind] for kind in "RICS" if kind in values} == pytest.approx({"R": 2.0, "I": 0.1, "C": 1e-3})
    assert values["Se"] == pytest.approx(5.0)
    assert strokes(graph) == {
        ("Se", "source"): False, ("R", "resistor"): False, ("I", "inductor"): True, ("C", "capacitor"): False,
    }  # fmt: skip
    assert graph.derivative == ()
    np.testing.assert_allclose(graph.poles, np.sort_complex(np.roots([0.1, 2.0, 1e3]))[::-1], rtol=1e-9)


@pytest.mark.thorough
def test_motor_with_gear() -> None:
    """Two inertias behind a rigid gear have one freedom: the second has derivative causality."""
    graph = bond_graph(drive)
    assert graph.derivative == ("load",)
    named = {(place.kind, place.name): place.value for place in graph.places if place.name}
    expected = {
        ("Se", "supply"): 12.0, ("R", "motor.resistor"): 0.3, ("I", "motor.inductor"): 1e-4, ("GY", "motor.emf"): 0.04,
        ("I", "motor.rotor"): 5e-5, ("TF", "gear"): 1.0 / 20.0, ("I", "load"): 5e-3, ("R", "spring"): 0.1,
        ("C", "spring"): 0.1,
    }  # fmt: skip
    assert named == pytest.approx(expected)
    assert strokes(graph) == {
        ("Se", "supply"): False, ("R", "motor.resistor"): False, ("I", "motor.inductor"): True,
        ("I", "motor.rotor"): True, ("I", "load"): False, ("R", "spring"): False, ("C", "spring"): False,
    }  # fmt: skip
    system = linearise(drive)
    np.testing.assert_allclose(graph.poles, system.poles, rtol=1e-9)
    for name in ("motor.inductor", "motor.rotor", "load"):
        np.testing.assert_allclose(graph.energy[f"I {name}"], system.energy[name], rtol=1e-6)
    np.testing.assert_allclose(graph.energy["C spring"], system.energy["spring"], rtol=1e-6)


class Valve(Component):
    """An inertia turns a cam, whose follower pushes a mass against a spring."""

    inertia: Inertia
    cam: Cam
    mass: Mass
    spring: Spring
    wall: Fixed = Fixed()

    def connections(self) -> Connections:
        return (
            connect(self.inertia.b, self.cam.shaft),
            connect(self.cam.follower, self.mass.a),
            connect(self.mass.b, self.spring.a),
            connect(self.spring.b, self.wall.flange),
        )


@pytest.mark.thorough
def test_transformer_of_a_cam_is_its_slope() -> None:
    disc = EccentricDisc(eccentricity=5e-3, radius=20e-3)
    model = Valve(inertia=Inertia(J=1e-4), cam=Cam(profile=disc), mass=Mass(m=0.2), spring=Spring(c=1e3))
    graph = bond_graph(replace(model, {"cam.shaft.phi": 1.0}))
    (ratio,) = [place.value for place in graph.places if place.kind == "TF"]
    assert ratio == pytest.approx(float(disc.slope(1.0)), rel=1e-9)
    assert len(graph.derivative) == 1


def test_what_is_refused() -> None:
    with pytest.raises(ModelError, match="is no component"):
        bond_graph(3)  # pyright: ignore[reportArgumentType]
    chain = Chain(inertias=repeat(Inertia(J=1.0), 3), springs=repeat(SpringDamper(c=1.0, d=0.1), 2))
    with pytest.raises(ModelError, match="inertias is an array of components"):
        bond_graph(chain)
    places = [BondNode("0"), BondNode("Se", "one"), BondNode("Se", "two")]
    with pytest.raises(ModelError, match="one, two"):
        causality(places, [Bond(1, 0, ""), Bond(2, 0, "")])


def test_picture() -> None:
    graph = bond_graph(rc())
    ax = graph.plot()
    assert {text.get_text() for text in ax.texts} >= {"1", "R", "C"}
    assert len([line for line in str(graph).splitlines() if "|" in line]) == len(graph.bonds)
    plt.close("all")


@pytest.mark.parametrize("swapped", [False, True])
def test_power_is_drawn_from_left_to_right(swapped: bool) -> None:
    """From a source, however the parts are declared."""
    graph = bond_graph(rc())
    order = list(range(len(graph.places)))[:: -1 if swapped else 1]
    place = {old: new for new, old in enumerate(order)}
    mirrored = dataclasses.replace(
        graph,
        places=tuple(graph.places[old] for old in order),
        bonds=tuple(bond._replace(tail=place[bond.tail], head=place[bond.head]) for bond in graph.bonds),
        strokes=tuple(place[stroke] for stroke in graph.strokes),
    )
    ax = mirrored.plot()
    at = {text.get_text(): text.get_position()[0] for text in ax.texts}
    assert at["Se"] < max(at["R"], at["C"])
    plt.close("all")


def _colours(ax: Axes) -> dict[str, str]:
    return {str(line.get_label()): str(line.get_color()) for line in ax.get_lines()}


@pytest.mark.thorough
def test_pictures_share_colours() -> None:
    """A domain has the colour that is asked for, and no other domain has it."""
    chosen = {"electrical": "#0072b2"}
    found = _colours(bond_graph(rc()).plot(colours=chosen))
    assert found["electrical"] == "#0072b2"
    disc = EccentricDisc(eccentricity=5e-3, radius=20e-3)
    model = Valve(inertia=Inertia(J=1e-4), cam=Cam(profile=disc), mass=Mass(m=0.2), spring=Spring(c=1e3))
    found = _colours(bond_graph(model).plot(colours={"translational": "#0072b2"}))
    assert found["translational"] == "#0072b2" != found["rotational"]
    plt.close("all")
