"""Random networks that have a solution.

Each grows from its references: a new node hangs by an element that fixes what is across (or a compliance, on which no
force is one too); further elements between nodes that are there fix no more than what flows.
"""

from random import Random
from typing import Any

from _netlist import Netlist, Node, Part

SPAN = {"amplitude": (0.5, 2.0), "frequency": (0.1, 0.5), "phase": (0.0, 6.0)}
CHANCE_OF_NEGATIVE = 0.3


class Growing:
    """A network in the making."""

    def __init__(self, random: Random) -> None:
        self.random = random
        self.parts: list[Part] = []
        self.nodes: dict[str, list[Node]] = {"electrical": [], "rotational": [], "translational": []}

    def new(self, domain: str) -> Node:
        node = (domain, len(self.nodes[domain]))
        self.nodes[domain].append(node)
        return node

    def old(self, domain: str) -> Node:
        return self.random.choice(self.nodes[domain])

    def add(self, kind: str, *nodes: Node, **values: float) -> None:
        self.parts.append(Part(kind, nodes, values))

    def number(self, low: float = 0.5, high: float = 2.0) -> float:
        return round(self.random.uniform(low, high), 3)

    def signed(self) -> float:
        return self.number() * (-1.0 if self.random.random() < CHANCE_OF_NEGATIVE else 1.0)

    def sine(self) -> dict[str, float]:
        return {name: self.number(*bounds) for name, bounds in SPAN.items()}

    def either_way(self, a: Node, b: Node) -> tuple[Node, Node]:
        return (a, b) if self.random.random() < 0.5 else (b, a)


def random_netlist(random: Random, size: int, domains: tuple[str, ...]) -> Netlist:
    """About `size` elements; two-ports that couple domains come as soon as both are there."""
    net = Growing(random)
    for domain in domains:
        START[domain](net)
    while len(net.parts) < size:
        domain = random.choice(domains)
        random.choice(GROW[domain] if random.random() < 0.55 else CLOSE[domain])(net)
    return tuple(net.parts)


def _start_circuit(net: Growing) -> None:
    net.add("electrical.Ground", net.new("electrical"))


def _start_shafts(net: Growing) -> None:
    _anchor(net, "rotational", net.new("rotational"))


def _start_rods(net: Growing) -> None:
    if net.nodes["rotational"] and net.random.random() < 0.5:
        net.add("rotational.IdealGearR2T", net.old("rotational"), net.new("translational"), ratio=net.signed())
    else:
        _anchor(net, "translational", net.new("translational"))


def _anchor(net: Growing, domain: str, node: Node) -> None:
    """Held, moved, or free with a mass."""
    way = net.random.choice(("held", "moved", "moved", "free", "free", "free"))
    if way == "held":
        net.add(f"{domain}.Fixed", node)
    elif way == "free":
        _body(net, domain, node, net.new(domain))
    else:
        position = "SignalAngle" if domain == "rotational" else "SignalPosition"
        kind = net.random.choice(("ConstantSpeed", "SignalSpeed", position))
        net.add(f"{domain}.{kind}", node, **({"speed": net.signed()} if kind == "ConstantSpeed" else net.sine()))


def _body(net: Growing, domain: str, a: Node, b: Node) -> None:
    if domain == "rotational":
        net.add("rotational.Inertia", *net.either_way(a, b), J=net.number())
    else:
        net.add("translational.Mass", *net.either_way(a, b), m=net.number())


# Electrical: a new node, or one more element between two that are there.


def _branch(net: Growing, kinds: tuple[str, ...], a: Node, b: Node) -> None:
    kind = net.random.choice(kinds)
    letters = {"Resistor": "R", "Conductor": "G", "Inductor": "L", "Capacitor": "C"}
    letters |= {"ConstantVoltage": "V", "ConstantCurrent": "I"}
    values: dict[str, Any] = {}
    if kind.startswith("Signal"):
        values = net.sine()
    elif kind in letters:
        values = {letters[kind]: net.signed() if kind.startswith("Constant") else net.number()}
    net.add(f"electrical.{kind}", *net.either_way(a, b), **values)


def _new_branch(net: Growing) -> None:
    kinds = ("Resistor", "Conductor", "Inductor", "Capacitor") * 3
    kinds += ("ConstantVoltage", "SignalVoltage", "CurrentSensor")
    _branch(net, kinds, net.old("electrical"), net.new("electrical"))


def _chord(net: Growing) -> None:
    kinds = ("Resistor", "Conductor", "Inductor", "Capacitor") * 2
    kinds += ("ConstantCurrent", "SignalCurrent", "VoltageSensor")
    a, b = net.old("electrical"), net.old("electrical")
    if a != b:
        _branch(net, kinds, a, b)


def _new_ground(net: Growing) -> None:
    """A circuit of its own, or one that is joined later by two-ports."""
    net.add("electrical.Ground", net.new("electrical"))


def _two_port(net: Growing) -> None:
    """One port hangs a new node, the other stands between old ones."""
    kind = net.random.choice(("IdealTransformer", "Transformer", "Gyrator", "VCV", "VCC", "CCV", "CCC"))
    a, b = net.old("electrical"), net.old("electrical")
    hang, between = (net.old("electrical"), net.new("electrical")), (a, b)
    if kind in ("VCV", "VCC"):
        ports = (between, hang)
    elif kind == "CCC":
        ports = (hang, between)
    else:
        ports = (hang, between) if net.random.random() < 0.5 else (between, hang)
    values = {
        "IdealTransformer": {"n": net.signed()},
        "Transformer": {"L1": net.number(1.0), "L2": net.number(1.0), "M": 0.4 * net.signed()},
        "Gyrator": {"G": net.signed()},
        "VCV": {"gain": net.signed()},
        "VCC": {"G": net.signed()},
        "CCV": {"R": net.signed()},
        "CCC": {"gain": net.signed()},
    }[kind]
    net.add(f"electrical.{kind}", *ports[0], *ports[1], **values)


def _machine(net: Growing) -> None:
    """Its winding hangs a new node, its shaft or rod is one that is there."""
    domains = [domain for domain in ("rotational", "translational") if net.nodes[domain]]
    if domains:
        domain = net.random.choice(domains)
        kind = "EMF" if domain == "rotational" else "TranslationalEMF"
        pins = net.either_way(net.old("electrical"), net.new("electrical"))
        net.add(f"electrical.{kind}", *pins, net.old(domain), k=net.signed())


# Mechanical.


def _compliance(net: Growing, domain: str, a: Node, b: Node) -> None:
    kind = net.random.choice(("Spring", "Damper", "SpringDamper"))
    values = {"Spring": "c", "Damper": "d", "SpringDamper": "cd"}[kind]
    net.add(f"{domain}.{kind}", *net.either_way(a, b), **{name: net.number() for name in values})


def _new_end(net: Growing, domain: str) -> None:
    """By a compliance, through a body, or by an offset."""
    a, b = net.old(domain), net.new(domain)
    way = net.random.choice(("compliance", "compliance", "body", "body", "offset"))
    if way == "compliance":
        _compliance(net, domain, a, b)
    elif way == "body":
        _body(net, domain, a, b)
    elif domain == "rotational":
        net.add("rotational.Disc", *net.either_way(a, b), delta_phi=net.signed())
    else:
        net.add("translational.Rod", *net.either_way(a, b), L=net.signed())


def _new_body(net: Growing, domain: str) -> None:
    """A body on a node that is there, its other end free."""
    _body(net, domain, net.old(domain), net.new(domain))


def _between(net: Growing, domain: str) -> None:
    a, b = net.old(domain), net.old(domain)
    if a != b:
        _compliance(net, domain, a, b)


def _load(net: Growing, domain: str) -> None:
    name = "torque" if domain == "rotational" else "force"
    if net.random.random() < 0.5:
        net.add(f"{domain}.Constant{name.title()}", net.old(domain), **{name: net.signed()})
    else:
        net.add(f"{domain}.Signal{name.title()}", net.old(domain), **net.sine())


def _second_anchor(net: Growing, domain: str) -> None:
    """A train of its own."""
    _anchor(net, domain, net.new(domain))


def _gear(net: Growing) -> None:
    nodes = net.either_way(net.old("rotational"), net.new("rotational"))
    net.add("rotational.IdealGear", *nodes, ratio=net.signed())


def _planetary(net: Growing) -> None:
    a, b = net.old("rotational"), net.old("rotational")
    if a != b:
        nodes = [a, b, net.new("rotational")]
        net.random.shuffle(nodes)
        net.add("rotational.PlanetaryGear", *nodes, ring_to_sun=net.number(1.5, 3.0))


def _rack(net: Growing) -> None:
    if net.nodes["rotational"]:
        net.add("rotational.IdealGearR2T", net.old("rotational"), net.new("translational"), ratio=net.signed())


def _of(domain: str, *ways: Any) -> tuple[Any, ...]:
    return tuple(lambda net, way=way: way(net, domain) for way in ways)


START = {"electrical": _start_circuit, "rotational": _start_shafts, "translational": _start_rods}
GROW = {
    "electrical": (_new_branch,) * 8 + (_two_port, _machine, _machine, _new_ground),
    "rotational": (*_of("rotational", *((_new_end,) * 5), _second_anchor), _gear, _gear, _planetary),
    "translational": (*_of("translational", *((_new_end,) * 5), _second_anchor), _rack),
}
CLOSE = {
    "electrical": (_chord,),
    "rotational": _of("rotational", _between, _between, _new_body, _new_body, _load),
    "translational": _of("translational", _between, _between, _new_body, _new_body, _load),
}
