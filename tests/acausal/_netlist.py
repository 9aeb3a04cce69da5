"""Networks as plain data, and the models that they stand for."""

import importlib
from collections.abc import Mapping
from typing import Any, NamedTuple

from acausal import Component, Connections, connect, replace
from components.blocks import Sine

Node = tuple[str, int]  # a domain and a number
ACROSS = {"electrical": "v", "rotational": "phi", "translational": "s"}
THROUGH = {"electrical": "i", "rotational": "tau", "translational": "f"}

_TWO_PORT = {"p1": "electrical", "n1": "electrical", "p2": "electrical", "n2": "electrical"}
_OTHERS: dict[str, dict[str, str]] = {
    "electrical.Ground": {"p": "electrical"},
    "electrical.EMF": {"p": "electrical", "n": "electrical", "shaft": "rotational"},
    "electrical.TranslationalEMF": {"p": "electrical", "n": "electrical", "rod": "translational"},
    "rotational.IdealGearR2T": {"shaft": "rotational", "rod": "translational"},
    "rotational.PlanetaryGear": {"sun": "rotational", "ring": "rotational", "carrier": "rotational"},
} | {
    f"electrical.{name}": _TWO_PORT
    for name in ("IdealTransformer", "Transformer", "Gyrator", "VCV", "VCC", "CCV", "CCC")
}
TO_GROUND = ("Fixed", "ConstantTorque", "ConstantForce", "ConstantSpeed")  # and all that a signal drives


class Part(NamedTuple):
    """An element: the name of its class and package, its nodes in the order of `ports_of`, and its parameters.

    An element that a signal drives has the parameters of a sine.
    """

    kind: str
    nodes: tuple[Node, ...]
    values: dict[str, Any]

    @property
    def name(self) -> str:
        return self.kind.partition(".")[2]

    @property
    def driven(self) -> bool:
        return self.name.startswith("Signal")


Netlist = tuple[Part, ...]


def element(kind: str, *nodes: str, **values: Any) -> Part:
    """A part between nodes such as `e1`, `r0` or `t2`."""
    domains = {domain[0]: domain for domain in ACROSS}
    return Part(kind, tuple((domains[node[0]], int(node[1:])) for node in nodes), values)


def resistor(a: str, b: str, R: float = 1.0) -> Part:
    return element("electrical.Resistor", a, b, R=R)


GROUND = element("electrical.Ground", "e0")


def ports_of(kind: str) -> dict[str, str]:
    """The domains of an element's ports by name."""
    domain, _, name = kind.partition(".")
    if kind in _OTHERS:
        return _OTHERS[kind]
    if domain == "electrical":
        return {"p": domain, "n": domain}
    if name in TO_GROUND or name.startswith("Signal"):
        return {"flange": domain}
    return {"a": domain, "b": domain}


class Network(Component):
    """Parts joined at nodes, each a tuple of (number of a part, name of its port); signals drive the parts named."""

    nodes: tuple[tuple[tuple[int, str], ...], ...]
    driven: tuple[int, ...]
    parts: tuple[Component, ...]
    signals: tuple[Sine, ...]

    def connections(self) -> Connections:
        return tuple(
            connect(*(getattr(self.parts[i], port) for i, port in node)) for node in self.nodes if len(node) > 1
        ) + tuple(connect(sine.y, self._driven(i).u) for sine, i in zip(self.signals, self.driven, strict=True))

    def _driven(self, i: int) -> Any:
        return self.parts[i]


def model_of(netlist: Netlist, starts: Mapping[str, float] | None = None) -> Network:
    """The network, with start values by name, such as `parts[2].v`."""
    nodes: dict[Node, list[tuple[int, str]]] = {}
    for i, part in enumerate(netlist):
        for port, node in zip(ports_of(part.kind), part.nodes, strict=True):
            nodes.setdefault(node, []).append((i, port))
    driven = tuple(i for i, part in enumerate(netlist) if part.driven)
    network = Network(
        nodes=tuple(tuple(node) for node in nodes.values()),
        driven=driven,
        parts=tuple(_component(part) for part in netlist),
        signals=tuple(Sine(**netlist[i].values) for i in driven),
    )
    return replace(network, starts or {})


def _component(part: Part) -> Component:
    package, _, name = part.kind.partition(".")
    cls = getattr(importlib.import_module(f"components.{package}"), name)
    return cls() if part.driven else cls(**part.values)
