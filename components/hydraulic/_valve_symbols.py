"""Symbols of valves, after ISO 1219."""

from acausal import Symbol

from .._drawing import at, circle, head, rect, with_port

FLOW = {"a": (0, 30), "b": (60, 30)}
CHECK = {"a": (0, 20), "b": (60, 20)}
HEAT, BEHIND = with_port("heat", 40, 60, "v-15"), with_port("heat", 160, 30, "h-8")
SPRING = "l-5-2 10-3-10-4 10-3-5-2"  # 14 high, upwards


def _check(more: str = "", dashed: str = "", **ports: tuple[int, int]) -> Symbol:
    """A ball on a seat, which the flow from a to b lifts."""
    lines = "M0 20h18M30 9L18 20l12 11M39 20h21" + circle(31, 20, 8) + more
    return Symbol(60, 40, {**CHECK, **ports}, lines, dashed=dashed) + with_port("heat", 20, 40, "v-18")


def _pressure(arrow: float, dashed: str, more: str = "", **ports: tuple[int, int]) -> Symbol:
    """A square with an arrow beside the line of a closed valve, or in that of an open one, and a spring above."""
    lines = rect(15, 15, 30, 30) + at(30, 15, SPRING) + f"M0 30h15M45 30h15M17 {arrow:g}h20" + more
    return Symbol(60, 60, {**FLOW, **ports}, lines, dashed=dashed, solid=head(43, arrow, 1, 0)) + HEAT


def _stop(more: str = "", dashed: str = "", **ports: tuple[int, int]) -> Symbol:
    """A shut-off valve: two triangles, with its drive above."""
    lines = "M0 20h14v-9l32 18v-18l-32 18v-9M46 20h14" + more
    return Symbol(60, 40, {**CHECK, **ports}, lines, dashed=dashed) + with_port("heat", 40, 40, "v-14")


def _closed(x: float, y: float, down: int) -> str:
    return at(x, y, f"v{8 * down}m-4 0h8")


def _spool(positions: list[str], solid: str, ports: dict[str, tuple[int, int]], width: int = 40) -> Symbol:
    """Squares for the positions, between the lines of a valve that throttles, with drives on both sides."""
    length = width * len(positions)
    lines = "".join(rect(20 + width * i, 10, width, 40) + position for i, position in enumerate(positions))
    drives = rect(8, 20, 12, 20) + "M8 40l12-20" + rect(20 + length, 20, 12, 20) + f"M{20 + length} 20l12 20"
    edges = f"M20 6h{length}M20 54h{length}"
    return Symbol(40 + length, 60, ports, lines + drives + edges, solid=solid)


def _up_and_down(x: float, left: int, right: int, crossed: bool) -> tuple[str, str]:
    """The arrows of a position with two paths, from x on: from p to a and b to t, or crossed."""
    a, b = x + left, x + right
    if crossed:
        slope = (right - left, 34.0)
        size = (slope[0] ** 2 + slope[1] ** 2) ** 0.5
        way = (slope[0] / size, slope[1] / size)
        return f"M{a} 50L{b} 10M{a} 10L{b} 50", head(b, 10, (b - a) / size, -40 / size) + head(b, 50, way[0], way[1])
    return f"M{a} 50V14M{b} 10V46", head(a, 10, 0, -1) + head(b, 50, 0, 1)


def _four_way(control: dict[str, tuple[int, int]], lead: str) -> Symbol:
    parallel, crossed = _up_and_down(20, 10, 30, crossed=False), _up_and_down(100, 10, 30, crossed=True)
    middle = _closed(70, 10, 1) + _closed(90, 10, 1) + _closed(70, 50, -1) + _closed(90, 50, -1)
    middle += "M70 10V0M90 10V0M70 50v10M90 50v10" + lead
    ports = {**control, "a": (70, 0), "b": (90, 0), "p": (70, 60), "t": (90, 60)}
    return _spool([parallel[0], middle, crossed[0]], parallel[1] + crossed[1], ports)


def _three_way() -> Symbol:
    middle = _closed(80, 10, 1) + _closed(70, 50, -1) + _closed(90, 50, -1) + "M80 10V0M70 50v10M90 50v10M0 30h8"
    ports = {"u": (0, 30), "a": (80, 0), "p": (70, 60), "t": (90, 60)}
    return (
        _spool(
            ["M30 50L40 14" + _closed(50, 50, -1), middle, "M120 10L129 46" + _closed(110, 50, -1)],
            head(40, 10, 0.25, -0.97) + head(130, 50, 0.25, 0.97),
            ports,
        )
        + BEHIND
    )


def _six_way() -> Symbol:
    parallel, crossed = _up_and_down(20, 10, 50, crossed=False), _up_and_down(140, 10, 50, crossed=True)
    side = [_closed(x, 10, 1) + _closed(x, 50, -1) for x in (50, 170)]
    middle = _closed(90, 10, 1) + _closed(130, 10, 1) + _closed(90, 50, -1) + _closed(130, 50, -1) + "M110 50V10"
    middle += "M90 10V0M110 10V0M130 10V0M90 50v10M110 50v10M130 50v10M0 30h8"
    ports = {
        "u": (0, 30),
        "a": (90, 0),
        "d": (110, 0),
        "b": (130, 0),
        "p": (90, 60),
        "c": (110, 60),
        "t": (130, 60),
    }
    return _spool(
        [parallel[0] + side[0], middle, crossed[0] + side[1]],
        parallel[1] + crossed[1] + head(110, 10, 0, -1),
        ports,
        60,
    ) + with_port("heat", 220, 30, "h-8")


def _solenoid_valve(is_open: bool) -> Symbol:
    """A 2/2 valve: a coil pulls it out of the position in which the spring holds it, on the right."""
    at_rest = "M90 50V14" if is_open else _closed(90, 10, 1) + _closed(90, 50, -1)
    pulled = _closed(50, 10, 1) + _closed(50, 50, -1) if is_open else "M50 50V14"
    lines = (
        rect(30, 10, 40, 40)
        + rect(70, 10, 40, 40)
        + at_rest
        + pulled
        + rect(12, 14, 18, 32)
        + "M12 46l18-32M0 20h12M0 40h12M90 10V0M90 50v10"
    )
    lines += at(110, 30, "l2-5 4 10 4-10 4 10 2-5")
    ports = {"p": (0, 20), "n": (0, 40), "a": (90, 60), "b": (90, 0)}
    return Symbol(130, 60, ports, lines, solid=head(90 if is_open else 50, 10, 0, -1))


INLET, OUTLET, DRAIN = "M8 30v24h22v-9", "M52 30v24h-22v-9", "M30 15h22v-12"
RELIEF = _pressure(37, INLET, "M22 12L38 2")
CHECK_SPRING = "M39 20l2-4 3 8 3-8 3 8 2-4"
PILOT = {"pilot": (30, 60)}

VALVES = {
    "CheckValve": _check(CHECK_SPRING),
    "IdealCheckValve": _check(),
    "PilotCheckValve": _check(dashed="M30 40v-12", pilot=(30, 40)),
    "ShuttleValve": Symbol(
        60,
        40,
        {"a": (0, 20), "b": (60, 20), "c": (30, 0)},
        rect(10, 8, 40, 24) + "M0 20h10M50 20h10M30 0v8M18 12l-8 8 8 8M42 12l8 8-8 8" + circle(22, 20, 6),
    )
    + with_port("heat", 30, 40, "v-8"),
    "PurgeValve": Symbol(
        60,
        40,
        {"a": (0, 20), "b": (60, 20), "c": (30, 40)},
        rect(10, 8, 40, 24) + "M0 20h10M50 20h10M30 40v-8M18 12l-8 8 8 8M42 12l8 8-8 8" + circle(30, 20, 6),
    )
    + with_port("heat", 40, 40, "v-8"),
    "SpringLoadedValve": RELIEF,
    "ReliefValve": RELIEF,
    "SnapReliefValve": RELIEF,
    "LaggingValve": RELIEF,
    "PilotedValve": RELIEF,
    "PilotReliefValve": RELIEF + Symbol(0, 0, {}, solid="M24 54h8l-4-7z"),
    "SequenceValve": _pressure(37, INLET + DRAIN, "M22 12L38 2"),
    "ExternallyPilotedValve": _pressure(37, "M30 60v-15", "M22 12L38 2", **PILOT),
    "UnloadingValve": _pressure(37, "M30 60v-15", "M22 12L38 2", **PILOT),
    "ChargingValve": _pressure(37, "M30 60v-15", "M22 12L38 2", **PILOT),
    "CounterbalanceValve": _pressure(37, "M30 60v-15M8 30v24h22", "M22 12L38 2", **PILOT),
    "BypassCompensator": _pressure(37, INLET + "M50 0v10h-20", load=(50, 0)),
    "PressureReducingValve": _pressure(30, OUTLET + DRAIN, "M22 12L38 2"),
    "FlowControlValve": Symbol(
        60,
        40,
        {"a": (0, 20), "b": (60, 20)},
        rect(8, 2, 44, 36) + "M0 20h60M18 11q12 7 24 0M18 29q12-7 24 0M14 34v-20M20 34L43 8",
        solid=head(14, 8, 0, -1) + head(46, 5, 0.7, -0.7),
    )
    + with_port("heat", 30, 40, "v-2"),
    "OnOffValve": _stop("M30 20v-8" + rect(22, 4, 16, 8) + "M22 12l16-8M30 4v-4", u=(30, 0)),
    "LiftValve": _stop("M30 20v-20", rod=(30, 0)),
    "PoppetValve": _stop("M30 20v-20", rod=(30, 0)),
    "SolenoidValve": _solenoid_valve(is_open=False),
    "HoldingValve": _solenoid_valve(is_open=True),
    "ThreeWayValve": _three_way(),
    "TwoEdges": _three_way(),
    "ProportionalReducingValve": _three_way(),
    "Spool": _three_way(),
    "FourEdges": _four_way({"u": (0, 30)}, "M0 30h8") + BEHIND,
    "FourWayValve": _four_way({"u": (0, 30)}, "M0 30h8") + BEHIND,
    "DrivenValve": _four_way({"u": (0, 30)}, "M0 30h8"),
    "FourWaySpool": _four_way({"rod": (0, 30)}, "M0 28h8M0 32h8"),
    "SixWayValve": _six_way(),
}
