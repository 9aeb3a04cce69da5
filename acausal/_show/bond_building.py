"""From components and connections to the places and bonds of a bond graph, without bonds that carry no power."""

import itertools
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from .._analyse.operating_point import operating_point
from .._analyse.power_ports import RATES, SAME, Local, PowerPort, Series, TwoPort, power_ports, series, two_port
from .._declare.array import Array
from .._declare.component import Component
from .._declare.layout import complete, rebuilt
from .._declare.node import Node, leaves_of
from .._errors import ModelError
from .._evaluate.building import system_of
from .._reduce.flatten import children, flatten
from .bond_graph import Bond, BondNode
from .diagram import _joined_ports


def built(model: Component, at: Any) -> tuple[list[BondNode], list[Bond]]:
    """Places and bonds of a model at a point, simplified."""
    whole = _at_point(model, at)
    parts = dict(_parts(whole, ""))
    ports = {path: list(power_ports(part)) for path, part in parts.items()}
    builder = _Builder()
    for joined in _joined_ports(flatten(model)):
        builder.connect(joined, ports)
    for path, part in parts.items():
        if ports[path]:
            builder.add(path, part, ports[path])
    return simplified(builder.places, builder.bonds)


def _at_point(model: Component, at: Any) -> Any:
    """The model with the values of all its variables at the point."""
    next(_parts(model, ""), None)
    system = system_of(model)
    system = system if system.solved is None else system.solved
    point = operating_point(model, system, at, None)
    leaves = system.flat.leaves
    values = dict(zip((leaf.path for leaf in leaves), point.read(range(len(leaves)), point.y), strict=True))
    return rebuilt(complete(model), lambda path, declaration, value: values[path])


def _parts(node: Node, path: str) -> Iterator[tuple[str, Component]]:
    """All components with equations, by path."""
    if isinstance(node, Array):
        raise ModelError(f"{path or 'The model'} is an array of components, which a bond graph cannot show.")
    if isinstance(node, Component) and type(node).equations is not Component.equations:
        yield path, node
    for here, part in children(node, path):
        if isinstance(part, Component | Array):
            yield from _parts(part, here)


class _Builder:
    """Places and bonds of a graph under construction."""

    def __init__(self) -> None:
        self.places: list[BondNode] = []
        self.bonds: list[Bond] = []
        self.nodes: dict[str, int] = {}  # junction of each port by path

    def place(self, kind: str, name: str = "", value: float | None = None, domain: str = "") -> int:
        self.places.append(BondNode(kind, name, value, domain))
        return len(self.places) - 1

    def bond(self, tail: int, head: int, domain: str) -> None:
        self.bonds.append(Bond(tail, head, domain))

    def connect(self, joined: Sequence[str], ports: Mapping[str, list[PowerPort]]) -> None:
        """Create the junction of connected ports."""
        known = {f"{path}.{port.name}" if path else port.name: port for path, found in ports.items() for port in found}
        chosen = [path for path in joined if path in known]
        if chosen:
            port = known[chosen[0]]
            junction = self.place("1" if port.of_flow else "0", domain=port.domain)
            self.nodes |= dict.fromkeys(chosen, junction)

    def _node(self, path: str, port: PowerPort) -> int:
        """The junction of a port; a new one if the port is not connected."""
        if path not in self.nodes:
            self.nodes[path] = self.place("1" if port.of_flow else "0", domain=port.domain)
        return self.nodes[path]

    def add(self, path: str, part: Component, ports: list[PowerPort]) -> None:
        """Add a component as the elements of its equations."""
        name = path or type(part).__name__
        local = Local(part, ports)
        anchors = {i: self._node(f"{path}.{port.name}" if path else port.name, port) for i, port in enumerate(ports)}
        domains = {i: port.domain for i, port in enumerate(ports)}
        reversible: set[int] = set()
        while len(anchors) > 1 and (pair := self._merged(local, anchors, domains)) is not None:
            reversible.add(anchors[pair[0]])
            del anchors[pair[1]]
        left = list(anchors)
        parameters = [
            float(leaf.value)
            for leaf in leaves_of(part)
            if leaf.declaration.role == "param" and not np.ndim(leaf.value)
        ]
        if len(left) == 1 and self._one_port(name, local, left[0], anchors[left[0]], domains[left[0]], reversible):
            return
        if len(left) == 2 and (found := two_port(local, left[0], left[1], parameters)) is not None:
            self._two_port(name, found, [anchors[i] for i in left], [domains[i] for i in left])
            return
        if len(left) == 3 and (found := weighted(local, left)) is not None:
            self._weighted(name, found, [anchors[i] for i in left], [domains[i] for i in left])
            return
        field = self.place("field", name)
        for i in left:
            self.bond(anchors[i], field, domains[i])

    def _merged(self, local: Local, anchors: dict[int, int], domains: Mapping[int, str]) -> tuple[int, int] | None:
        """Join two ports of a component with a common flow or effort at a new junction."""
        for i, j in itertools.combinations(anchors, 2):
            if domains[i] != domains[j]:
                continue
            shares = {kind: local.ratio(kind, i, j) for kind in ("f", "e")}
            if is_lossless(local, i, j, shares):
                continue
            for kind, junction in (("f", "1"), ("e", "0")):
                ratio = shares[kind]
                if ratio is None or abs(abs(ratio) - 1.0) > SAME:
                    continue
                sign = 1.0 if ratio > 0.0 else -1.0
                # A reversed bond changes the sign of its flow at a 0-junction, of its effort at a 1-junction.
                turns = self.places[anchors[j]].kind != junction
                if (sign < 0.0 and not turns) or not local.merge(i, j, kind, sign):
                    continue
                here = self.place(junction, domain=domains[i])
                self.bond(anchors[i], here, domains[i])
                self.bond(*((anchors[j], here) if sign > 0.0 else (here, anchors[j])), domains[j])
                anchors[i] = here
                return i, j
        return None

    def _one_port(self, name: str, local: Local, i: int, anchor: int, domain: str, reversible: set[int]) -> bool:
        impedance, admittance = (local.law(("e", i), ("f", i)), local.law(("f", i), ("e", i)))
        if impedance is not None and not len(impedance):
            self._source(name, "Se", _value(local, ("e", i)), anchor, domain, anchor in reversible)
        elif admittance is not None and not len(admittance):
            self._source(name, "Sf", _value(local, ("f", i)), anchor, domain, anchor in reversible)
        elif impedance is not None and (admittance is None or len(impedance) <= len(admittance)):
            self._elements(name, impedance, True, anchor, domain)
        elif admittance is not None:
            self._elements(name, admittance, False, anchor, domain)
        else:
            return False
        return True

    def _source(self, name: str, kind: str, value: float | None, anchor: int, domain: str, reversible: bool) -> None:
        """Add a source; power counts out of it."""
        if reversible:
            self.bonds = [
                Bond(bond.head, bond.tail, bond.domain) if anchor in (bond.tail, bond.head) else bond
                for bond in self.bonds
            ]
        flips = (self.places[anchor].kind == "1") == (kind == "Se")
        sign = -1.0 if flips != reversible else 1.0
        value = None if value is None else sign * value + 0.0
        self.bond(self.place(kind, name, value, domain), anchor, domain)

    def _elements(self, name: str, law: Series, of_efforts: bool, anchor: int, domain: str) -> None:
        """Add the terms of an impedance at a 1-junction, or of an admittance at a 0-junction."""
        if not len(law):
            return
        kind = "1" if of_efforts else "0"
        if len(law) > 1 and self.places[anchor].kind != kind:
            junction = self.place(kind, domain=domain)
            self.bond(anchor, junction, domain)
            anchor = junction
        terms = (
            (("I", law.inertia), ("R", law.resistance), ("C", _inverse(law.stiffness)))
            if of_efforts
            else (("C", law.inertia), ("R", _inverse(law.resistance)), ("I", _inverse(law.stiffness)))
        )
        for element, value in terms:
            if value != 0.0:
                self.bond(anchor, self.place(element, name, value, domain), domain)

    def _two_port(self, name: str, found: TwoPort, anchors: list[int], domains: list[str]) -> None:
        """Add junctions with the elements at each side, and the transformer or gyrator between them."""
        first, second = anchors
        sides = []
        for anchor, law, of_efforts, domain, tail in (
            (first, found.first, found.first_of_efforts, domains[0], True),
            (second, found.second, found.second_of_efforts, domains[1], False),
        ):
            if not len(law):
                sides.append(anchor)
                continue
            junction = self.place("1" if of_efforts else "0", domain=domain)
            self.bond(*((anchor, junction) if tail else (junction, anchor)), domain)
            self._elements(name, law, of_efforts, junction, domain)
            sides.append(junction)
        turned = self.places[second].kind == "1"
        modulus = -found.modulus if turned != (found.kind == "GY") else found.modulus
        if found.kind == "TF" and abs(modulus - 1.0) < SAME:
            self.bond(sides[0], sides[1], domains[0])
            return
        # Reversing both bonds changes the sign of the modulus if the two junctions differ.
        alike = self.places[first].kind == self.places[second].kind
        if modulus < 0.0 and alike == (found.kind == "GY"):
            modulus = -modulus if found.kind == "GY" else -1.0 / modulus
            sides, domains = sides[::-1], domains[::-1]
        middle = self.place(found.kind, name, modulus)
        self.bond(sides[0], middle, domains[0])
        self.bond(middle, sides[1], domains[1])

    def _weighted(self, name: str, found: Any, anchors: list[int], domains: list[str]) -> None:
        """Add flows whose weighted sum is zero: a 0-junction behind a transformer for each, with the elements of each
        side.
        """
        weights, laws = found
        middle = self.place("0", domain=domains[0])
        for weight, law, anchor, domain in zip(weights, laws, anchors, domains, strict=True):
            turned = weight < 0.0 and self.places[anchor].kind == "1"
            if len(law):
                junction = self.place("1", domain=domain)
                self.bond(*((junction, anchor) if turned else (anchor, junction)), domain)
                self._elements(name, law, True, junction, domain)
                anchor = junction
            value = 1.0 / abs(weight) if turned else weight
            ends = (middle, anchor) if turned else (anchor, middle)
            if abs(value - 1.0) < SAME:
                self.bond(*ends, domain)
                continue
            transformer = self.place("TF", name, value)
            self.bond(ends[0], transformer, domain)
            self.bond(transformer, ends[1], domain)


def _value(local: Local, column: Any) -> float | None:
    """The value of a source; None if a signal sets it."""
    return None if local.is_driven else local.offset(column)


def _inverse(value: float) -> float:
    return 1.0 / value if value else 0.0


def is_lossless(local: Local, i: int, j: int, shares: Mapping[str, float | None]) -> bool:
    """Whether two ports have proportional efforts and proportional flows without losses, as in a transformer."""
    if local.is_driven or any(ratio is None for ratio in shares.values()):
        return False
    return all(
        ratio is not None and abs(local.offset((kind, j)) - ratio * local.offset((kind, i))) < SAME
        for kind, ratio in shares.items()
    )


def weighted(local: Local, ports: Sequence[int]) -> tuple[np.ndarray, list[Series]] | None:
    """Weights of the flows of three ports, and the impedance of each: e_i = Z_i f_i + weight_i effort."""
    flows, efforts = [("f", i) for i in ports], [("e", i) for i in ports]
    found = local.relations(flows)
    if len(found) != 1 or np.min(np.abs(found[0])) < SAME * np.max(np.abs(found[0])):
        return None
    weights = found[0] / found[0][np.argmin(np.abs(found[0]))]
    basis = np.linalg.svd(weights[None])[2][1:]
    away = np.eye(3) - np.outer(weights, weights) / (weights @ weights)
    values = []
    for which in range(len(RATES)):
        rows = local.relations([*efforts, *flows], which)
        lines, targets = [], []
        for motion in basis:
            pushed = np.linalg.lstsq(rows[:, :3], -rows[:, 3:] @ motion, rcond=1e-10)[0]
            if np.max(np.abs(rows[:, :3] @ pushed + rows[:, 3:] @ motion)) > SAME * np.max(np.abs(rows)):
                return None
            lines.append(away * motion)
            targets.append(away @ pushed)
        left, right = np.concatenate(lines), np.concatenate(targets)
        solution = np.linalg.lstsq(left, right, rcond=1e-10)[0]
        size = np.max(np.abs(right), initial=0.0)
        if np.max(np.abs(left @ solution - right), initial=0.0) > SAME * size:
            return None
        values.append(np.where(np.abs(solution) < SAME * size, 0.0, solution))
    laws = [series(column) for column in np.array(values).T]
    return None if any(law is None for law in laws) else (weights, [law for law in laws if law is not None])


def simplified(places: Sequence[BondNode], bonds: Sequence[Bond]) -> tuple[list[BondNode], list[Bond]]:
    """The remaining places and bonds, renumbered."""
    graph = _Graph(list(places), list(bonds))
    while graph.without_zero() or graph.without_end() or graph.without_passage() or graph.without_twin():
        pass
    kept = [i for i in range(len(graph.places)) if graph.around(i)]
    number = {place: i for i, place in enumerate(kept)}
    return (
        [graph.places[i] for i in kept],
        [Bond(number[bond.tail], number[bond.head], bond.domain) for bond in graph.bonds],
    )


class _Graph:
    """Places, which are never removed, and bonds, which are."""

    def __init__(self, places: list[BondNode], bonds: list[Bond]) -> None:
        self.places, self.bonds = places, bonds

    def around(self, place: int) -> list[Bond]:
        return [bond for bond in self.bonds if place in (bond.tail, bond.head)]

    def _zero(self, kind: str, at: int, domain: str) -> None:
        self.places.append(BondNode(kind, "", 0.0, domain))
        self.bonds.append(Bond(len(self.places) - 1, at, domain))

    def without_zero(self) -> bool:
        """Remove a source of zero and propagate the zeros; returns whether there was one."""
        for number, place in enumerate(self.places):
            if place.kind in ("Se", "Sf") and place.value == 0.0 and (found := self.around(number)):
                (bond,) = found
                self.bonds.remove(bond)
                self._nothing(place.kind, bond.tail if bond.head == number else bond.head)
                return True
        return False

    def _nothing(self, kind: str, place: int) -> None:
        """A bond with no effort ("Se") or no flow ("Sf") was removed from a place."""
        here, around = self.places[place].kind, self.around(place)
        if here in ("0", "1"):
            # No effort at a 0-junction, or no flow at a 1-junction: no power at any of its bonds.
            if (here == "0") != (kind == "Se"):
                return
            self.bonds = [bond for bond in self.bonds if bond not in around]
            for bond in around:
                self._nothing(kind, bond.tail if bond.head == place else bond.head)
        elif here in ("TF", "GY") and around:
            (bond,) = around
            self.bonds.remove(bond)
            beyond = kind if here == "TF" else {"Se": "Sf", "Sf": "Se"}[kind]
            self._zero(beyond, bond.tail if bond.head == place else bond.head, bond.domain)

    def without_end(self) -> bool:
        """Remove a junction with one bond, which has no flow (0-junction) or no effort (1-junction)."""
        for number, place in enumerate(self.places):
            found = self.around(number)
            if place.kind in ("0", "1") and len(found) == 1:
                self.bonds.remove(found[0])
                beyond = found[0].tail if found[0].head == number else found[0].head
                self._zero("Sf" if place.kind == "0" else "Se", beyond, found[0].domain)
                return True
        return False

    def without_passage(self) -> bool:
        """Remove a junction with one bond to it and one from it."""
        for number, place in enumerate(self.places):
            found = self.around(number)
            if place.kind in ("0", "1") and len(found) == 2:
                ins = [bond for bond in found if bond.head == number]
                outs = [bond for bond in found if bond.tail == number]
                if len(ins) == 1 and ins[0].tail != outs[0].head:
                    self.bonds = [bond for bond in self.bonds if bond not in found]
                    self.bonds.append(Bond(ins[0].tail, outs[0].head, outs[0].domain))
                    return True
        return False

    def without_twin(self) -> bool:
        """Merge two junctions of one kind with a single bond between them."""
        for bond in self.bonds:
            kinds = {self.places[bond.tail].kind, self.places[bond.head].kind}
            twice = sum({other.tail, other.head} == {bond.tail, bond.head} for other in self.bonds) > 1
            if kinds in ({"0"}, {"1"}) and not twice:
                self.bonds.remove(bond)
                self.bonds = [
                    other._replace(
                        tail=bond.tail if other.tail == bond.head else other.tail,
                        head=bond.tail if other.head == bond.head else other.head,
                    )
                    for other in self.bonds
                ]
                return True
        return False
