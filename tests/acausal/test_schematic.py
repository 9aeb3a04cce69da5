"""Schematic of schematics: symbols, labels and lines keep apart, for models and for random graphs."""

import itertools
from random import Random

import pytest

from acausal import Component, Connections, ModelError, Symbol, connect, diagram
from acausal._show.diagram_svg import schematic
from acausal._show.schematic.graph import Graph, Rect, graph_of
from acausal._show.schematic.layout import Schematic, layout
from acausal._show.schematic.places import least_lengths
from acausal._show.schematic.symbols import Point, Turned
from components.electrical import Capacitor, ConstantVoltage, Diode, Ground, Resistor
from docs.drive import drive
from studies.actuators import ehs_sticking, ema_fise
from studies.architectures._hydrostatic import servo_pump
from studies.architectures._stored import automated_gearbox

PART = Symbol(60, 40, {"a": (0, 20), "b": (60, 20), "top": (30, 0), "below": (30, 40)})
ELEMENT = Symbol(60, 20, {"a": (0, 10), "b": (60, 10)})
TANK = Symbol(20, 20, {"port": (10, 0)}, is_reference=True)
WALL = Symbol(10, 20, {"port": (0, 10)}, is_reference=True)


def random_graph(random: Random) -> Graph:
    """Symbols with ports on all sides, joined at random, some of them to references."""
    symbols = {f"part_{i}": random.choice([PART, ELEMENT]) for i in range(random.randint(2, 14))}
    ends = [(name, port) for name, symbol in symbols.items() for port in symbol.ports]
    random.shuffle(ends)
    joints = []
    for reference, symbol in (("tank", TANK), ("wall", WALL)):
        symbols[reference] = symbol
        joints.append([(reference, "port"), *(ends.pop() for _ in range(random.randint(1, 2)))])
    while len(ends) > 1:
        joints.append([ends.pop() for _ in range(min(len(ends), random.choice([2, 2, 2, 3, 4])))])
    return graph_of(symbols, joints)


def rects(found: Schematic) -> list[list[Rect]]:
    """The rectangles of each glyph and its label."""
    pairs = zip(found.graph.glyphs, found.corners, strict=True)
    return [[rect.moved(*corner) for rect in glyph.rects] for glyph, corner in pairs]


def ports(found: Schematic) -> list[set[Point]]:
    """The places of the ports of each net."""
    nets = []
    for net in found.graph.nets:
        corners = [found.corners[end.glyph] for end in net]
        places = [found.graph.glyphs[end.glyph].turned.port(end.port) for end in net]
        nets.append({(a + x, b + y) for (a, b), (x, y) in zip(corners, places, strict=True)})
    return nets


def check(found: Schematic) -> None:
    """Nothing overlaps, each net is one connected set of lines between its ports, and nets only cross."""
    glyphs = rects(found)
    assert not any(a.meets(b) for p, q in itertools.combinations(glyphs, 2) for a, b in itertools.product(p, q))
    symbols = {point for rects_of in glyphs for rect in rects_of[:-1] for point in rect.points()}
    for wire, ends in zip(found.wires, ports(found), strict=True):
        points = {point for edge in wire.edges for point in edge}
        assert ends <= points
        assert points & symbols == ends, "a line touches a symbol"
        reached, todo = set(), [min(points)]
        while todo:
            point = todo.pop()
            reached.add(point)
            todo += [b for edge in wire.edges if point in edge for b in edge if b not in reached]
        assert reached == points
        assert sum(len(range(a[0], b[0])) + len(range(a[1], b[1])) for a, b in wire.runs()) == len(wire.edges)
    for one, other in itertools.combinations(found.wires, 2):
        assert not one.edges & other.edges
        assert not set(one.junctions()) & {point for edge in other.edges for point in edge}


@pytest.mark.parametrize("seed", range(12))
def test_random_graphs(seed: int) -> None:
    check(layout(random_graph(Random(seed))))


class Rectifier(Component):
    """A bridge of diodes with a capacitor and a load."""

    source: ConstantVoltage
    diodes: tuple[Diode, ...]
    store: Capacitor
    load: Resistor
    ground: Ground = Ground()

    def connections(self) -> Connections:
        a, b, c, d = self.diodes
        return (
            connect(self.source.p, a.p, b.n),
            connect(self.source.n, c.p, d.n),
            connect(a.n, c.n, self.store.p, self.load.p),
            connect(b.p, d.p, self.store.n, self.load.n, self.ground.p),
        )


MODELS = {
    "drive": lambda: drive,
    "electromechanical actuator": ema_fise,
    "hydraulic actuator": ehs_sticking,
    "closed circuit": servo_pump,
    "servo of 31 parts": automated_gearbox,
    "rectifier": lambda: Rectifier(
        source=ConstantVoltage(V=1.0), diodes=(Diode(),) * 4, store=Capacitor(C=1.0), load=Resistor(R=1.0)
    ),
}


@pytest.mark.parametrize("name", MODELS)
def test_models(name: str) -> None:
    found = schematic(diagram(MODELS[name](), depth=None if name == "drive" else 1))
    check(found)
    assert all(
        glyph.turned == Turned(glyph.turned.symbol) for glyph in found.graph.glyphs if not glyph.turned.symbol.can_turn
    )


def test_a_curve_is_never_mirrored() -> None:
    curve = Symbol(40, 40, {"u": (0, 20), "y": (40, 20)}, can_turn=False)
    joints = [[("part", "a"), ("curve", "y")], [("part", "b"), ("curve", "u")]]
    glyphs = layout(graph_of({"part": PART, "curve": curve}, joints, signals={0, 1})).graph.glyphs
    assert glyphs[1].turned == Turned(curve)


def test_ports_close_together() -> None:
    tight = Symbol(60, 40, {f"{i}": (10 * i, 40) for i in range(1, 6)})
    joints = [[("one", f"{i}"), ("other", f"{6 - i}")] for i in range(1, 6)]
    check(layout(graph_of({"one": tight, "other": tight}, joints)))


def test_a_chain_runs_from_left_to_right() -> None:
    """A part whose port faces away is mirrored, and the reference at the end turns to the port."""
    joints = [[("first", "b"), ("second", "b")], [("second", "a"), ("third", "a")], [("third", "b"), ("wall", "port")]]
    found = layout(graph_of({"first": ELEMENT, "second": ELEMENT, "third": ELEMENT, "wall": WALL}, joints))
    assert [glyph.turned.is_mirrored for glyph in found.graph.glyphs] == [False, True, False]
    (left, y), (middle, _), (right, _) = found.corners
    assert left < middle < right
    assert found.corners == ((left, y), (middle, y), (right, y))
    assert [len(list(wire.runs())) for wire in found.wires] == [1, 1]
    assert found.graph.glyphs[2].hangers[0].turned == Turned(WALL)


def test_an_element_to_a_tank_stands_upright() -> None:
    joints = [[("first", "b"), ("second", "a")], [("second", "b"), ("tank", "port")]]
    second = graph_of({"first": ELEMENT, "second": ELEMENT, "tank": TANK}, joints).glyphs[1]
    assert second.turned.side("a") == (0, -1)
    assert second.hangers[0].rect == Rect(0, 7, 2, 9)


def test_sources_stand_between_the_branches_of_a_loop() -> None:
    joints = [[("source", "a"), ("one", "a")], [("one", "b"), ("two", "b")], [("source", "b"), ("two", "a")]]
    found = layout(graph_of(dict.fromkeys(["source", "one", "two"], ELEMENT), joints))
    check(found)
    assert sum(glyph.turned.is_turned for glyph in found.graph.glyphs) <= 1


def test_components_without_lines() -> None:
    found = layout(graph_of({"alone": PART, "other": ELEMENT}, []))
    check(found)
    assert found.wires == ()


def test_least_lengths() -> None:
    assert least_lengths(3, [(0, 1, 0.0, 1.0), (1, 2, 4.0, 1.0)], [(0, 1, 2.0)]).tolist() == [0, 2, 6]


@pytest.mark.parametrize("place", [(0, 0), (5, 0), (30, 20), (70, 10)])
def test_bad_places_of_ports(place: Point) -> None:
    with pytest.raises(ModelError, match=r"Port 'a' of a symbol is at .*: place it at a multiple of 10 on one edge"):
        Symbol(60, 40, {"a": place})
