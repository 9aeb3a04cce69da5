"""Components and connections as a graph, and its picture."""

import re
from pathlib import Path
from xml.etree import ElementTree

import jax
import jax.numpy as jnp
import pytest
from _models import rc

from acausal import Array as Parts
from acausal import Component, Connections, ModelError, connect, diagram, repeat, simulate
from components.electrical import ConstantVoltage, DCMotor, Ground
from components.rotational import Inertia, SpringDamper
from docs.drive import drive

SPACE = "{http://www.w3.org/2000/svg}"


def test_boxes_and_joints() -> None:
    found = diagram(drive)
    assert found.boxes["motor"] == "DCMotor"
    assert len(found.boxes) == 7
    seen = {(joint.domain, joint.ports) for joint in found.joints}
    assert ("electrical", (("motor", "p"), ("supply", "p"))) in seen
    assert ("electrical", (("ground", "p"), ("motor", "n"), ("supply", "n"))) in seen
    assert ("rotational", (("gear", "a"), ("motor", "shaft"))) in seen
    assert len(seen) == len(found.joints) == 6


def test_all_levels() -> None:
    """Parts that are connected through the ports of a composite count as connected."""
    found = diagram(drive, depth=None)
    assert found.boxes.keys() >= {"motor.resistor", "motor.emf", "gear"}
    assert "motor" not in found.boxes
    seen = {joint.ports for joint in found.joints}
    assert (("motor.resistor", "p"), ("supply", "p")) in seen
    assert (("gear", "a"), ("motor.rotor", "b")) in seen
    assert diagram(drive, depth=2) == found


def test_domains_have_colours() -> None:
    found = diagram(drive)
    assert list(found.colours) == ["electrical", "rotational"]
    assert found.colours == {"electrical": "#0072b2", "rotational": "#d55e00"}  # in every model
    assert found.colour_of("supply") == found.colours["electrical"]
    assert found.colour_of("motor") not in found.colours.values()  # it is in both


class Chain(Component):
    """Inertias with springs between them."""

    inertias: Parts[Inertia]
    springs: Parts[SpringDamper]

    def connections(self) -> Connections:
        return (
            connect(self.inertias[:-1].b, self.springs[:].a),
            connect(self.springs[:].b, self.inertias[1:].a),
        )


def test_arrays_are_one_box() -> None:
    found = diagram(Chain(inertias=repeat(Inertia(J=1.0), 5), springs=repeat(SpringDamper(c=jnp.ones(4), d=0.1), 4)))
    assert found.boxes == {"inertias[]": "5 × Inertia", "springs[]": "4 × SpringDamper"}
    # Connections join the two sides of an inertia, whose angles are one only by its equation.
    assert {joint.boxes for joint in found.joints} == {("inertias[]", "springs[]")}


def test_a_component_without_parts() -> None:
    found = diagram(Inertia(J=1.0))
    assert (found.boxes, found.joints) == ({"Inertia": "Inertia"}, ())
    assert texts(found.svg) == ["J", "Inertia"]


def test_text_for_graphviz() -> None:
    lines = str(diagram(rc())).splitlines()
    assert lines[0] == 'graph "RC" {'
    assert lines[-1] == "}"
    assert sum("shape=box" in line for line in lines) == 4
    assert any(re.search(r'"r" -- "source" \[color="#\w+", taillabel="p", headlabel="p"\];', line) for line in lines)


def texts(svg: str) -> list[str]:
    """The words of a picture."""
    return [found.text or "" for found in ElementTree.fromstring(svg).iter(f"{SPACE}text")]


def tooltips(svg: str) -> dict[str, list[str]]:
    """The lines of tooltips by path."""
    found = [(title.text or "").split("\n") for title in ElementTree.fromstring(svg).iter(f"{SPACE}title")]
    return {head.partition(":")[0]: [head, *rest] for head, *rest in found}


def test_schematic_shows_each_component() -> None:
    svg = diagram(drive, depth=None).svg
    assert {"motor.resistor", "supply", "spring"} <= set(texts(svg))
    assert tooltips(svg).keys() == diagram(drive, depth=None).boxes.keys()
    assert diagram(drive)._repr_svg_() == diagram(drive).svg


def test_tooltips_show_parameters_in_display_units() -> None:
    assert tooltips(diagram(drive).svg)["load"] == ["load: Inertia", "J = 50000 g.cm2"]
    assert tooltips(diagram(drive).svg)["spring"][0] == "spring: SpringDamper"


def test_tooltips_of_a_solution_show_values() -> None:
    solution = simulate(rc(), 1.0)
    lines = tooltips(diagram(solution).svg)["c"]
    assert lines[:2] == ["c: Capacitor", "C = 0.001 F"]
    shown = next(line for line in lines if line.startswith("v: "))
    assert re.fullmatch(r"v: 4\.99\d* V at the end, from 0 V to 4\.99\d* V", shown)
    assert any(line.startswith("p.i: ") for line in lines)


def test_a_batch_of_runs() -> None:
    batch = jax.vmap(lambda R: simulate(rc(R=R), 1.0))(jnp.array([100.0, 200.0]))
    with pytest.raises(ModelError, match="The solution is a batch: select one run"):
        diagram(batch)


def test_links_lead_to_the_reference() -> None:
    links = {
        found.get("href") for found in ElementTree.fromstring(diagram(drive, links="library/").svg).iter(f"{SPACE}a")
    }
    assert {"library/electrical.html#DCMotor", "library/rotational.html#IdealGear"} <= links
    assert "<a " not in diagram(drive).svg


def test_save(tmp_path: Path) -> None:
    found = diagram(rc())
    found.save(tmp_path / "rc.svg")
    assert (tmp_path / "rc.svg").read_text(encoding="utf-8") == found.svg
    with pytest.raises(ModelError, match=r"saved as SVG: name the file rc\.svg, not rc\.png"):
        found.save("rc.png")


def test_ports_of_the_model_are_terminals() -> None:
    found = diagram(drive.motor)
    assert {"p", "n", "shaft"} <= found.boxes.keys()
    assert any(("p", "") in joint.ports for joint in found.joints)
    assert {"p", "n", "shaft"} <= set(texts(found.svg))


class Deep(Component):
    """A connection to a port of a part of a part."""

    motor: DCMotor
    brake: Inertia
    supply: ConstantVoltage
    ground: Ground = Ground()

    def connections(self) -> Connections:
        return (
            connect(self.motor.rotor.a, self.brake.a),
            connect(self.supply.p, self.motor.p),
            connect(self.supply.n, self.motor.n, self.ground.p),
        )


def test_a_box_shows_inner_ports_that_are_connected() -> None:
    model = Deep(motor=DCMotor(R=1.0, k=1.0, J=1.0), brake=Inertia(J=1.0), supply=ConstantVoltage(V=1.0))
    assert {"DCMotor", "rotor.a"} <= set(texts(diagram(model).svg))


@pytest.mark.parametrize("depth", [0, -1, 1.5, True])
def test_bad_depth(depth: int) -> None:
    with pytest.raises(ModelError, match="depth must be a positive integer, or None for all levels"):
        diagram(drive, depth=depth)


def test_no_component() -> None:
    with pytest.raises(ModelError, match=r"^3 is no component: draw a model\."):
        diagram(3)  # pyright: ignore[reportArgumentType]
