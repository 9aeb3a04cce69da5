"""Networks with one thing wrong: always a diagnosis that names a part; and networks that only look wrong, solved."""

from random import Random
from typing import Any

import pytest
from _descriptor import Descriptor, SingularError
from _netlist import GROUND, Netlist, Part, element, model_of, resistor
from _random_networks import random_netlist
from _tableau import Tableau
from test_networks import COUPLED, assert_agree

from acausal import ModelError, SimulationError, StructureError, check, simulate

pytestmark = pytest.mark.slow

SOURCE = element("electrical.ConstantVoltage", "e1", "e0", V=2.0)
SHAFT = element("rotational.Inertia", "r0", "r1", J=1.0)
GEAR = element("rotational.IdealGear", "r1", "r2", ratio=2.0)
INDUCTOR = element("electrical.Inductor", "e1", "e2", L=0.5)
CURRENT = element("electrical.ConstantCurrent", "e2", "e0", I=1.0)
HELD = element("translational.Fixed", "t0")
LOAD = element("rotational.Inertia", "r2", "r3", J=2.0)


BROKEN: dict[str, tuple[Netlist, str]] = {
    "voltage sources in parallel": ((GROUND, SOURCE, SOURCE, resistor("e1", "e0")), r"parts\[[12]\]"),
    "a source shorted": ((GROUND, SOURCE, element("electrical.CurrentSensor", "e1", "e0")), r"parts\[[12]\]"),
    "no ground": ((SOURCE, resistor("e1", "e2"), resistor("e2", "e0")), r"parts\[\d\].*Ground"),
    "two grounds at a node": ((GROUND, GROUND, SOURCE, resistor("e1", "e0")), r"parts\[[01]\]"),
    "current sources in series": (
        (GROUND, resistor("e1", "e0"), element("electrical.ConstantCurrent", "e1", "e2", I=2.0), CURRENT),
        r"parts\[[23]\]",
    ),
    "a current source that ends nowhere": (
        (GROUND, resistor("e1", "e0"), element("electrical.ConstantCurrent", "e1", "e2", I=2.0)),
        r"parts\[2\]",
    ),
    "like gears in parallel": ((SHAFT, GEAR, GEAR, LOAD), r"parts\[[12]\]"),
    "a gear beside two that make up its ratio": (
        (
            SHAFT,
            element("rotational.IdealGear", "r1", "r2", ratio=0.3),
            element("rotational.IdealGear", "r1", "r4", ratio=0.1),
            element("rotational.IdealGear", "r4", "r2", ratio=3.0),
            LOAD,
        ),
        r"parts\[[123]\]",
    ),
    "a speed given twice": (
        (
            element("rotational.ConstantSpeed", "r0", speed=1.0),
            SHAFT,
            element("rotational.ConstantSpeed", "r1", speed=1.0),
        ),
        r"parts\[[02]\]",
    ),
    "a position given twice": (
        (HELD, element("translational.Rod", "t0", "t1", L=1.0), element("translational.Fixed", "t1")),
        r"parts\[[012]\]",
    ),
    "a torque on nothing": (
        (
            SHAFT,
            element("rotational.Spring", "r2", "r3", c=1.0),
            element("rotational.ConstantTorque", "r3", torque=1.0),
        ),
        r"parts\[[12]\]",
    ),
    "resistances of zero in parallel": (
        (GROUND, SOURCE, resistor("e1", "e2"), resistor("e2", "e0", 0.0), resistor("e2", "e0", 0.0)),
        r"parts\[[34]\]",
    ),
    "a source across a resistance of zero": ((GROUND, SOURCE, resistor("e1", "e0", 0.0)), r"parts\[[12]\]"),
}


def capacitor(a: str, b: str, C: float = 1.0) -> Part:
    return element("electrical.Capacitor", a, b, C=C)


LEGAL: dict[str, tuple[Netlist, dict[str, float]]] = {
    "capacitors in a loop": (
        (GROUND, resistor("e1", "e0"), capacitor("e1", "e0"), capacitor("e0", "e1", 2.0)),
        {"parts[2].v": 1.0},
    ),
    "capacitor across a source": ((GROUND, SOURCE, capacitor("e1", "e0"), resistor("e1", "e0")), {}),
    "capacitor across a source off the ground": (
        (
            GROUND,
            resistor("e1", "e0"),
            resistor("e2", "e0"),
            element("electrical.ConstantVoltage", "e1", "e2", V=1.5),
            capacitor("e1", "e2"),
        ),
        {},
    ),
    "inductors in series": (
        (GROUND, SOURCE, INDUCTOR, element("electrical.Inductor", "e2", "e0", L=1.0)),
        {"parts[2].i": 1.0},
    ),
    "inductor in series with a current source": ((GROUND, SOURCE, INDUCTOR, CURRENT), {}),
    "inductors as the only ways between two parts of a circuit": (
        (
            GROUND,
            SOURCE,
            INDUCTOR,
            element("electrical.Inductor", "e3", "e0", L=1.0),
            resistor("e2", "e3"),
            resistor("e2", "e3", 2.0),
        ),
        {"parts[2].i": 1.0},
    ),
    "a shaft locked by gears in parallel": (
        (
            SHAFT,
            GEAR,
            GEAR._replace(values={"ratio": 3.0}),
            LOAD,
            element("rotational.ConstantTorque", "r0", torque=1.0),
        ),
        {},
    ),
    "a damper with a free end": (
        (SHAFT, element("rotational.Damper", "r1", "r2", d=1.0)),
        {"parts[0].w": 1.0, "parts[0].a.phi": 0.5, "parts[1].phi_rel": 0.3},
    ),
    "a gear with a free end": ((SHAFT, GEAR), {"parts[0].w": 1.0, "parts[0].a.phi": 0.5}),
}


@pytest.mark.parametrize("name", LEGAL)
def test_legal(name: str) -> None:
    assert_agree(*LEGAL[name])


@pytest.mark.parametrize("name", BROKEN)
def test_diagnosis(name: str) -> None:
    netlist, culprit = BROKEN[name]
    with pytest.raises(SingularError):
        Descriptor(Tableau(netlist))
    model = model_of(netlist)
    with pytest.raises((ModelError, SimulationError), match=f"(?s){culprit}"):
        simulate(model, 1.0)
    found = check(model)
    assert not found
    assert "parts[" in found.problems[0]


def test_open_input() -> None:
    whole = model_of((GROUND, element("electrical.SignalVoltage", "e1", "e0", amplitude=1.0, frequency=1.0, phase=0.0)))
    model = type(whole)(nodes=whole.nodes, parts=whole.parts, signals=(), driven=())
    with pytest.raises(ModelError, match=r"parts\[1\]\.u"):
        simulate(model, 1.0)
    assert "parts[1].u" in check(model).problems[0]


def apart(netlist: Netlist, random: Random) -> Netlist:
    """One terminal is taken from its node."""
    i = random.randrange(len(netlist))
    part = netlist[i]
    k = random.randrange(len(part.nodes))
    alone = (part.nodes[k][0], 1000)
    return (*netlist[:i], part._replace(nodes=(*part.nodes[:k], alone, *part.nodes[k + 1 :])), *netlist[i + 1 :])


def doubled(netlist: Netlist, random: Random) -> Netlist:
    return (*netlist, random.choice(netlist))


def without(netlist: Netlist, random: Random) -> Netlist:
    i = random.randrange(len(netlist))
    return (*netlist[:i], *netlist[i + 1 :])


def is_singular(netlist: Netlist) -> bool:
    try:
        Descriptor(Tableau(netlist))
    except SingularError:
        return True
    return False


@pytest.mark.parametrize("change", [apart, doubled, without])
def test_change_that_makes_a_random_network_singular(change: Any) -> None:
    random, refused = Random(0), 0
    while refused < 8:
        netlist = random_netlist(random, 12, COUPLED)
        if is_singular(netlist) or not is_singular(changed := change(netlist, random)):
            continue
        with pytest.raises((StructureError, SimulationError), match=r"parts\["):
            simulate(model_of(changed), 1.0)
        assert any("parts[" in problem for problem in check(model_of(changed)).problems)
        refused += 1
