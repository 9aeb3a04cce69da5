"""Simplification of a bond graph: removal of bonds without power and of redundant junctions."""

from collections.abc import Sequence

from .bond_graph import Bond, BondNode


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
