"""Causal strokes by the sequential procedure (Karnopp, Margolis, Rosenberg, `System Dynamics`, ch. 5)."""

from collections.abc import Sequence
from typing import Any

from .._errors import ModelError


def causality(places: Sequence[Any], bonds: Sequence[Any]) -> tuple[list[int], list[str]]:
    """The place of the causal stroke of each bond, and the names of stores with derivative causality."""
    search = _Strokes(places, bonds)
    for kind in ("Se", "Sf", "I", "C", "R"):
        for number, place in enumerate(places):
            if place.kind == kind:
                search.prefer(number, kind)
    for bond in range(len(bonds)):
        if search.strokes[bond] is None:
            search.set(bond, bonds[bond].head)
    return [stroke for stroke in search.strokes if stroke is not None], search.derivative


class _Strokes:
    """The known strokes, and the propagation of each."""

    def __init__(self, places: Sequence[Any], bonds: Sequence[Any]) -> None:
        self.places, self.bonds = places, bonds
        self.strokes: list[int | None] = [None] * len(bonds)
        self.derivative: list[str] = []
        self.around = [[i for i, bond in enumerate(bonds) if n in (bond.tail, bond.head)] for n in range(len(places))]

    def prefer(self, place: int, kind: str) -> None:
        """Set the preferred causality: effort out of Se, C and R; flow out of Sf and I."""
        (bond,) = self.around[place]
        wanted = self.other(bond, place) if kind in ("Se", "C", "R") else place
        if self.strokes[bond] is None:
            self.set(bond, wanted)
        elif self.strokes[bond] != wanted and kind in ("I", "C"):
            self.derivative.append(self.places[place].name)
        elif self.strokes[bond] != wanted and kind in ("Se", "Sf"):
            self._conflict(place)

    def other(self, bond: int, place: int) -> int:
        ends = self.bonds[bond]
        return ends.head if ends.tail == place else ends.tail

    def set(self, bond: int, place: int) -> None:
        """Set a stroke, and all that follow from it."""
        waiting = [(bond, place)]
        while waiting:
            bond, place = waiting.pop()
            if self.strokes[bond] == place:
                continue
            if self.strokes[bond] is not None:
                self._conflict(place)
            self.strokes[bond] = place
            for end in self.bonds[bond][:2]:
                waiting += self._follows(end)

    def _follows(self, place: int) -> list[tuple[int, int]]:
        kind, around = self.places[place].kind, self.around[place]
        here = [bond for bond in around if self.strokes[bond] == place]
        away = [bond for bond in around if self.strokes[bond] not in (None, place)]
        free = [bond for bond in around if self.strokes[bond] is None]
        if kind in ("0", "1"):
            # One bond sets the effort of a 0-junction or the flow of a 1-junction.
            one, many = (here, away) if kind == "0" else (away, here)
            if len(one) > 1 or (not free and not one):
                self._conflict(place)
            single = (lambda bond: place) if kind == "0" else (lambda bond: self.other(bond, place))
            rest = (lambda bond: self.other(bond, place)) if kind == "0" else (lambda bond: place)
            if one:
                return [(bond, rest(bond)) for bond in free]
            return [(free[0], single(free[0]))] if len(free) == 1 and len(many) == len(around) - 1 else []
        if kind in ("TF", "GY") and len(free) == 1:
            same = bool(here) if kind == "GY" else not here
            return [(free[0], place if same else self.other(free[0], place))]
        if kind in ("TF", "GY") and not free and (len(here) == 1) != (kind == "TF"):
            self._conflict(place)
        return []

    def _conflict(self, place: int) -> None:
        near = {end for bond in self.around[place] for end in self.bonds[bond][:2]}
        ends = {end for other in near for bond in self.around[other] for end in self.bonds[bond][:2]}
        names = sorted({self.places[end].name for end in ends} - {""})
        raise ModelError(
            f"The bond graph has no causality around {', '.join(names) or 'a junction'}: two elements set the same "
            "effort or the same flow."
        )
