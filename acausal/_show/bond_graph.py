"""`bond_graph`: a model as junctions, elements and bonds, with causality, poles and the energy of its modes."""

import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import scipy
from jaxtyping import Complex, Float

from .._analyse.power_ports import equilibrated
from .._declare.component import Component
from .._errors import ModelError
from .._extras import Axes

RANK = 1e-11  # relative size of a singular value that counts as zero


class BondNode(NamedTuple):
    """A node of a bond graph.

    `kind`: "0" (one effort, flows add up to zero), "1" (one flow, efforts add up to zero), "I", "C", "R", "Se" and "Sf"
    (elements of one port), "TF" and "GY" (of two), "field" (of several, unresolved). `name`: its component,
    empty for a junction. `value`: I: p = I f; C: q = C e; R: e = R f; TF from the bond to it, 1, to the one
    from it, 2: e1 = m e2, f2 = m f1; GY: e1 = r f2, e2 = r f1; effort or flow of a source, None if a signal
    sets it.
    """

    kind: str
    name: str = ""
    value: float | None = None
    domain: str = ""


class Bond(NamedTuple):
    """A bond. Power is positive from the place `tail` to the place `head`."""

    tail: int
    head: int
    domain: str


@dataclasses.dataclass(frozen=True)
class BondGraph:
    """A bond graph: places and bonds. `print` shows a list, `plot()` the picture.

    `strokes`: for each bond, the place of its causal stroke, the end that receives the effort and determines the flow.
    `derivative`: names of stores with derivative causality.
    """

    name: str
    places: tuple[BondNode, ...]
    bonds: tuple[Bond, ...]
    strokes: tuple[int, ...]
    derivative: tuple[str, ...]

    @property
    def poles(self) -> Complex[np.ndarray, " n"]:
        """Poles in 1/s, in ascending order of magnitude, from the equations of the graph alone.

        They equal those of `linearise` unless the graph omits a stiffness, such as that of a loaded curved cam or
        lever.
        """
        return self._modes()[0]

    @property
    def energy(self) -> dict[str, Float[np.ndarray, " n"]]:
        """The share of each store in the energy of each mode, in the order of `poles`."""
        shapes = self._modes()[1]
        stores = self._stores()
        amounts = np.abs(shapes[: len(stores)]) ** 2 / np.array([abs(value) for _, _, value in stores])[:, None]
        totals = np.sum(amounts, axis=0)
        shares = amounts / np.where(totals > 0.0, totals, 1.0)
        return {f"{self.places[i].kind} {self.places[i].name}": shares[k] for k, (i, _, _) in enumerate(stores)}

    def _stores(self) -> list[tuple[int, int, float]]:
        """Node, bond and value of each I and C."""
        found = []
        for number, place in enumerate(self.places):
            if place.kind in ("I", "C"):
                assert place.value is not None
                found.append((number, self.at(number)[0], place.value))
        return found

    def at(self, place: int) -> list[int]:
        """The numbers of the bonds at a place."""
        return [i for i, bond in enumerate(self.bonds) if place in (bond.tail, bond.head)]

    def _modes(self) -> tuple[np.ndarray, np.ndarray]:
        """Finite generalised eigenvalues of the graph's equations in stored p and q, efforts and flows."""
        strange = [place.name for place in self.places if place.kind == "field"]
        if strange:
            raise ModelError(f"{strange[0]} is drawn as a field without inner structure: it has no law here.")
        stores, n = self._stores(), len(self.bonds)
        rows: list[dict[int, float]] = []
        rates: list[dict[int, float]] = []

        def effort(bond: int) -> int:
            return len(stores) + bond

        def flow(bond: int) -> int:
            return len(stores) + n + bond

        for k, (i, bond, value) in enumerate(stores):
            law, drive = (flow, effort) if self.places[i].kind == "I" else (effort, flow)
            rows += [{k: 1.0, law(bond): -value}, {drive(bond): 1.0}]
            rates += [{}, {k: 1.0}]
        for number, place in enumerate(self.places):
            for row in self._laws(number, place, effort, flow):
                rows.append(row)
                rates.append({})
        size = len(stores) + 2 * n
        A, E = np.zeros((len(rows), size)), np.zeros((len(rows), size))
        for matrix, lines in ((A, rows), (E, rates)):
            for i, line in enumerate(lines):
                for j, value in line.items():
                    matrix[i, j] += value
        return _finite(A, E, len(stores))

    def _laws(self, number: int, place: BondNode, effort: Any, flow: Any) -> Iterator[dict[int, float]]:
        bonds = self.at(number)
        signs = [1.0 if self.bonds[i].head == number else -1.0 for i in bonds]
        value = place.value if place.value is not None else 0.0
        if place.kind in ("0", "1"):
            common, added = (effort, flow) if place.kind == "0" else (flow, effort)
            yield from ({common(bonds[0]): 1.0, common(i): -1.0} for i in bonds[1:])
            yield {added(i): sign for i, sign in zip(bonds, signs, strict=True)}
        elif place.kind == "TF":
            first, second = sorted(bonds, key=lambda bond: self.bonds[bond].head != number)
            yield {flow(second): 1.0, flow(first): -value}
            yield {effort(first): 1.0, effort(second): -value}
        elif place.kind == "GY":
            first, second = bonds
            yield {effort(first): 1.0, flow(second): -value}
            yield {effort(second): 1.0, flow(first): -value}
        elif place.kind == "R":
            yield {effort(bonds[0]): 1.0, flow(bonds[0]): -value}
        elif place.kind in ("Se", "Sf"):
            yield {(effort if place.kind == "Se" else flow)(bonds[0]): 1.0}

    def __str__(self) -> str:
        return "\n".join(
            f"{self.label(bond.tail)} {'--->|' if stroke == bond.head else '|--->'} {self.label(bond.head)}"
            for bond, stroke in zip(self.bonds, self.strokes, strict=True)
        )

    def label(self, place: int) -> str:
        """Kind and name of a place; a junction has its number."""
        found = self.places[place]
        return f"{found.kind}:{found.name or place}"

    def plot(self, ax: Axes | None = None, *, colours: Mapping[str, str] | None = None) -> Axes:
        """Draw it with half arrows and causal strokes, power from left to right; returns the matplotlib axes.

        Bonds have the colour of their domain in `colours`, so that pictures side by side can share theirs; any other
        domain has one of its own.
        """
        from .bond_plot import plot_bond_graph

        return plot_bond_graph(self, ax, colours or {})


def _finite(A: np.ndarray, E: np.ndarray, stores: int) -> tuple[np.ndarray, np.ndarray]:
    """Finite s and vectors of A x = s E x, by elimination of variables without a rate."""
    dynamic, static = np.flatnonzero(np.any(E != 0.0, axis=1)), np.flatnonzero(~np.any(E != 0.0, axis=1))
    _, columns = equilibrated(np.concatenate([A, E[dynamic]]))
    basis = scipy.linalg.null_space(_rows(A[static] * columns), rcond=RANK)
    rates = E[dynamic] * columns @ basis
    sizes = np.maximum(np.max(np.abs(rates), axis=1, initial=0.0), 1e-300)[:, None]
    rates, drives = rates / sizes, (A[dynamic] * columns @ basis) / sizes
    # Dependent stores add constraints instead of rates.
    left, values, _ = np.linalg.svd(rates)
    rank = int(np.sum(values > RANK * values[0])) if len(values) else 0
    free = scipy.linalg.null_space(_rows(left[:, rank:].T @ drives), rcond=RANK)
    square = np.linalg.solve(left[:, :rank].T @ rates @ free, left[:, :rank].T @ drives @ free)
    balanced, change = scipy.linalg.matrix_balance(square)
    poles, vectors = np.linalg.eig(balanced)
    order = np.lexsort((-np.imag(poles), np.abs(poles).round(9)))
    shapes = columns[:, None] * (basis @ free @ change @ vectors)
    return poles[order], shapes[:stores, order]


def _rows(matrix: np.ndarray) -> np.ndarray:
    """A matrix with rows of norm one."""
    return matrix / np.maximum(np.max(np.abs(matrix), axis=1, initial=0.0), 1e-300)[:, None]


def bond_graph(model: Component, *, at: Any = None) -> BondGraph:
    """The bond graph of a model, drawn from the equations of its components at an operating point.

    Connected electrical or hydraulic ports become a 0-junction, mechanical ones a 1-junction (torque and force are
    efforts, speeds flows; temperature and flow of heat make pseudo bonds). The elements of a component follow from its
    linearised equations: transformer, gyrator, inertia, compliance, resistance, sources, or several of
    them. Grounded places and bonds without power are omitted. Causality is assigned in the usual sequence:
    sources, then stores with integral causality, then the rest (Karnopp, Margolis, Rosenberg, `System Dynamics`,
    ch. 5). A component with any other law is drawn as one `field`.

    - `at`: a view of the model, such as `sol.final`, at which nonlinear equations are linearised; by default the
      model's start values.

    Raises `ModelError` for other objects, for arrays of components, and for a causal conflict, such as
    two sources of one voltage.
    """
    from .bond_building import built

    if not isinstance(model, Component):
        raise ModelError(f"{model!r} is no component: draw a model.")
    places, bonds = built(model, at)
    strokes, derivative = causality(places, bonds)
    return BondGraph(type(model).__name__, tuple(places), tuple(bonds), tuple(strokes), tuple(derivative))


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
