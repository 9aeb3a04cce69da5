"""Random hydraulic circuits with a unique solution, and an independent calculation of their flows."""

from random import Random
from typing import NamedTuple

import numpy as np

from acausal import Component, Connections, connect
from components.blocks import Constant
from components.hydraulic import (
    CheckValve,
    ConstantFlow,
    LaminarResistance,
    OnOffValve,
    Orifice,
    Pump,
    ReliefValve,
    Tank,
)
from components.rotational import ConstantSpeed

DENSITY = 860.0
Way = tuple[str, int, int]  # an element from one node to another; node 0 is the tank


class Layout(NamedTuple):
    """The elements between the tank and further nodes."""

    nodes: int
    ways: tuple[Way, ...]


class Network(Component):
    """Parts joined at nodes, each a tuple of (number of a part, name of its port); node 0 is the tank."""

    nodes: tuple[tuple[tuple[int, str], ...], ...]
    parts: tuple[Component, ...]
    pumps: tuple[int, ...]
    drives: tuple[ConstantSpeed, ...]
    valves: tuple[int, ...]
    openings: tuple[Constant, ...]
    tank: Tank = Tank()

    def connections(self) -> Connections:
        ports = [[getattr(self.parts[i], port) for i, port in node] for node in self.nodes]
        ports[0].append(self.tank.port)
        driven = zip(self.drives, self.pumps, strict=True)
        opened = zip(self.openings, self.valves, strict=True)
        return (
            *(connect(*node) for node in ports if len(node) > 1),
            *(connect(drive.flange, getattr(self.parts[i], "shaft")) for drive, i in driven),  # noqa: B009
            *(connect(opening.y, getattr(self.parts[i], "u")) for opening, i in opened),  # noqa: B009
        )


def random_layout(random: Random) -> Layout:
    """Each node has a supply with its relief valve, or a resistance to an earlier node; more elements are random."""
    n, ways = random.randint(2, 5), list[Way]()
    for node in range(1, n + 1):
        if node == n or random.random() < 0.5:
            ways += [(random.choice(("pump", "flow")), 0, node), ("relief", node, 0)]
        else:
            ways.append((random.choice(("orifice", "laminar")), node, random.randrange(node)))
    kinds = ("orifice", "laminar", "relief", "check", "check", "onoff", "onoff")
    for _ in range(random.randint(1, n + 2)):
        a, b = random.sample(range(n + 1), 2)
        ways.append((random.choice(kinds), a, b))
    return Layout(n, tuple(ways))


def random_network(layout: Layout, random: Random) -> Network:
    """A circuit with random parameters."""
    nodes: list[list[tuple[int, str]]] = [[] for _ in range(layout.nodes + 1)]
    for i, (kind, a, b) in enumerate(layout.ways):
        if kind == "flow":
            nodes[b].append((i, "port"))
        else:
            nodes[a].append((i, "a"))
            nodes[b].append((i, "b"))
    pumps, valves = (tuple(i for i, way in enumerate(layout.ways) if way[0] == kind) for kind in ("pump", "onoff"))
    return Network(
        nodes=tuple(tuple(node) for node in nodes),
        parts=tuple(_part(kind, random) for kind, _, _ in layout.ways),
        pumps=pumps,
        drives=tuple(ConstantSpeed(speed=random.choice((0.0, _spread(random, 1.0, 300.0)))) for _ in pumps),
        valves=valves,
        openings=tuple(Constant(k=random.choice((0.0, 0.0, 1.0))) for _ in valves),
    )


def _spread(random: Random, low: float, high: float) -> float:
    return float(np.exp(random.uniform(np.log(low), np.log(high))))


def _part(kind: str, random: Random) -> Component:
    match kind:
        case "orifice":
            return Orifice(area=_spread(random, 1e-8, 1e-4), density=DENSITY)
        case "onoff":
            return OnOffValve(area=_spread(random, 1e-7, 1e-4), density=DENSITY)
        case "laminar":
            return LaminarResistance(resistance=_spread(random, 1e7, 1e12))
        case "relief":
            return ReliefValve(conductance=_spread(random, 1e-10, 1e-7), cracking_pressure=_spread(random, 1e5, 5e7))
        case "check":
            return CheckValve(conductance=_spread(random, 1e-9, 1e-7))
        case "pump":
            return Pump(displacement=_spread(random, 1e-7, 1e-5), leakage=random.choice((0.0, 1e-14, 1e-12)))
        case _:
            return ConstantFlow(flow=_spread(random, 1e-6, 1e-3))


def lack(layout: Layout, network: Network, pressures: np.ndarray) -> np.ndarray:
    """The flow that is missing at each node but the tank, as a share of the flows that meet there, or of a million
    times what a change of pressures by a 1e-12th makes of them.
    """
    total, size = np.zeros(layout.nodes + 1), np.zeros(layout.nodes + 1)
    speeds = {i: float(drive.speed) for i, drive in zip(network.pumps, network.drives, strict=True)}
    openings = {i: float(opening.k) for i, opening in zip(network.valves, network.openings, strict=True)}
    for i, (_, a, b) in enumerate(layout.ways):
        dp, blur = pressures[a] - pressures[b], 1e-12 * (abs(pressures[a]) + abs(pressures[b]))
        q, beside = (_flow(network.parts[i], x, speeds.get(i, 0.0), openings.get(i, 1.0)) for x in (dp, dp + blur))
        total += q * (np.arange(layout.nodes + 1) == b) - q * (np.arange(layout.nodes + 1) == a)
        size += (abs(q) + 1e6 * abs(beside - q)) * np.isin(np.arange(layout.nodes + 1), (a, b))
    return (total / (size + 1e-12))[1:]


def _flow(part: Component, dp: float, speed: float, opening: float) -> float:
    """The law of each element; an on/off valve is shut or wide open."""
    match part:
        case Orifice() | OnOffValve():
            area = float(part.area) * opening
            return 0.61 * area * np.sqrt(2.0 / DENSITY) * dp / (dp**2 + 100.0**2) ** 0.25
        case LaminarResistance():
            return dp / float(part.resistance)
        case ReliefValve() | CheckValve():
            width, cracking = float(part.transition_pressure), float(part.cracking_pressure)
            rounded = np.logaddexp(0.0, (dp - cracking) / width) - np.logaddexp(0.0, -cracking / width)
            return float(part.conductance) * (width * rounded + float(part.leakage) * dp)
        case Pump():
            return float(part.displacement) * speed + float(part.leakage) * dp
        case ConstantFlow():
            return float(part.flow)
        case _:
            raise AssertionError(part)
