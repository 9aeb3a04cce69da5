"""Symbols of hydraulic components, after ISO 1219."""

from acausal import Symbol

from .._drawing import circle, head, rect, with_port
from ._valve_symbols import VALVES

COLOUR = "#cc79a7"  # of lines and parts of this domain

FLOW = {"a": (0, 20), "b": (60, 20)}


def _heated(x: int, y: int, lead: str) -> Symbol:
    return with_port("heat", x, y, lead)


def _throttle(pieces: str, more: str = "", **ports: tuple[int, int]) -> Symbol:
    """A restriction in a line. A signal or a rod that adjusts it acts from above."""
    return Symbol(60, 40, {**FLOW, **ports}, "M0 20h60" + pieces + more) + LOSS


def _cylinder(pieces: str, ports: dict[str, tuple[int, int]]) -> Symbol:
    return Symbol(110, 40, ports, rect(4, 4, 76, 32) + pieces)


def _accumulator(inside: str) -> Symbol:
    return Symbol(
        40, 60, {"port": (20, 60)}, "M6 18a14 14 0 0 1 28 0v20a14 14 0 0 1-28 0zM20 60v-8" + inside
    ) + _heated(40, 30, "h-6")


def _meter(
    port: dict[str, tuple[int, int]], inside: str, output: tuple[int, int], leads: str, solid: str = ""
) -> Symbol:
    return Symbol(60, 40, {**port, "y": output}, circle(30, 20, 15) + leads + inside, solid=solid)


ARCS = "M18 11q12 7 24 0M18 29q12-7 24 0"  # a restriction whose drop depends on the viscosity
EDGES = "M24 10l6 7 6-7M24 30l6-7 6 7"  # an orifice
ADJUSTED = Symbol(60, 40, {}, "M16 35L43 6", solid=head(46, 3, 0.7, -0.7))
PUMP = Symbol(  # a circle with a triangle at the outlet, and the shaft on the left
    60,
    60,
    {"shaft": (0, 30), "a": (30, 60), "b": (30, 0)},
    circle(30, 30, 20) + "M30 60V50M30 0v10M0 28h10M0 32h10",
    solid="M30 10l8 13h-16z",
)
VARIED = PUMP + Symbol(60, 60, {}, "M10 50L48 12", solid=head(51, 9, 0.7, -0.7))
COMPENSATED = VARIED + Symbol(60, 60, {}, dashed="M30 4h26v46h-46")
HEAT, INPUT = _heated(60, 40, "h-13"), with_port("u", 60, 20, "h-12")
WARM = _heated(40, 20, "h-5")
WALLS = with_port("heat_a", 20, 40, "v-4") + with_port("heat_b", 60, 40, "v-4")
LOSS = _heated(30, 40, "v-10")
ROD = "M28 18h74M28 22h74M28 4v32"  # the piston and its rod
PUSHED = {"rod": (110, 20), "port": (0, 20)}
PIPE = Symbol(
    80,
    20,
    {"a": (0, 10), "b": (80, 10)},
    "M0 10h12M68 10h12M14 4h52M14 16h52M14 4a3 6 0 0 0 0 12a3 6 0 0 0 0-12M66 4a3 6 0 0 1 0 12",
) + _heated(40, 20, "v-4")
SOURCE = circle(20, 20, 15) + "M20 35v5"
DIAMOND = "M30 2l18 18-18 18-18-18zM0 20h12M48 20h12"

SYMBOLS = VALVES | {
    "MixedPart": Symbol(60, 40, {}, rect(12, 8, 36, 24)) + _heated(30, 40, "v-8"),
    "TwoPort": Symbol(60, 40, FLOW, rect(12, 8, 36, 24) + "M0 20h12M48 20h12") + _heated(30, 40, "v-8"),
    "Resistance": _throttle(ARCS),
    "LaminarResistance": _throttle(ARCS),
    "AnnularGap": _throttle("M14 14h32M14 26h32"),
    "DrilledPassage": _throttle("M14 8v8h32v-8M14 32v-8h32v8"),
    "LocalLoss": _throttle(ARCS),
    "Orifice": _throttle(EDGES),
    "LiquidOrifice": _throttle(EDGES),
    "VariableOrifice": _throttle(EDGES, u=(30, 0)) + ADJUSTED + Symbol(60, 0, {}, leads={"u": "M30 0v11"}),
    "MeteringEdge": _throttle(EDGES, "M30 0v10", rod=(30, 0)) + ADJUSTED,
    "EndCushion": _throttle(ARCS, "M30 0v11", rod=(30, 0)) + ADJUSTED,
    "DecelerationValve": _throttle(EDGES, "M30 7v5" + circle(30, 4, 4), rod=(30, 0)) + ADJUSTED,
    "Pump": PUMP + HEAT,
    "StickingPump": PUMP,
    "FixedPump": PUMP + HEAT,
    "LiquidPump": PUMP + HEAT,
    "RipplingPump": PUMP + HEAT,
    "VariablePump": VARIED + HEAT + INPUT,
    "ServoPump": VARIED + INPUT,
    "PressureCompensatedPump": COMPENSATED + HEAT,
    "PowerLimitedPump": COMPENSATED + HEAT,
    "LoadSensingPump": VARIED + HEAT + Symbol(60, 60, {"load": (60, 20)}, dashed="M60 20h-8v30h-42"),
    "Tank": Symbol(20, 20, {"port": (10, 0)}, "M10 0v12M1 6v12h18v-12", is_reference=True) + _heated(10, 20, "v-2"),
    "LevelTank": Symbol(60, 40, {"port": (30, 40)}, "M4 4v28h52v-28M4 12h52M26 17h8M28 21h4M30 32v8")
    + _heated(60, 20, "h-4"),
    "BootstrapTank": Symbol(
        60,
        60,
        {"port": (30, 60), "pilot": (30, 0)},
        rect(8, 26, 44, 26) + rect(22, 8, 16, 18) + "M30 52v8M30 0v8M8 36h44M22 16h16M28 16v20M32 16v20",
    ),
    "Source": Symbol(40, 40, {"port": (20, 40)}, SOURCE) + WARM,
    "ConstantPressure": Symbol(40, 40, {"port": (20, 40)}, SOURCE, solid="M20 35l-8-13h16z") + WARM,
    "SignalPressure": Symbol(40, 40, {"port": (20, 40), "u": (0, 20)}, SOURCE + "M0 20h5", solid="M20 35l-8-13h16z")
    + WARM,
    "ConstantFlow": Symbol(40, 40, {"port": (20, 40)}, SOURCE + "M20 9v14", solid=head(20, 29, 0, 1, 9)) + WARM,
    "SignalFlow": Symbol(
        40, 40, {"port": (20, 40), "u": (0, 20)}, SOURCE + "M20 9v14M0 20h5", solid=head(20, 29, 0, 1, 9)
    )
    + WARM,
    "Accumulator": _accumulator("M6 28h28"),
    "GasAccumulator": _accumulator("M6 28h28M20 21l-6-9h12z"),
    "ThermalAccumulator": _accumulator("M6 28h28M20 21l-6-9h12z"),
    "SpringAccumulator": _accumulator("M6 30h28M20 30l-7-3 14-5-14-5 14-5-7-3"),
    "Chamber": Symbol(
        40,
        40,
        {"port": (20, 40)},
        "M20 34v6M12 6h16q8 0 8 8v12q0 8-8 8h-16q-8 0-8-8v-12q0-8 8-8z",
        texts=((20, 20, "V", 13),),
    )
    + _heated(40, 20, "h-4"),
    "Volume": Symbol(
        40,
        40,
        {"port": (20, 40)},
        "M20 34v6M12 6h16q8 0 8 8v12q0 8-8 8h-16q-8 0-8-8v-12q0-8 8-8z",
        texts=((20, 20, "V", 13),),
    )
    + _heated(40, 20, "h-4"),
    "Segments": PIPE,
    "Pipe": PIPE,
    "UnsteadyFrictionPipe": PIPE,
    "CharacteristicLine": PIPE,
    "Line": Symbol(
        60, 20, {"a": (0, 10), "b": (60, 10)}, "M0 10h8q22 14 44 0h8", solid=circle(8, 10, 2.5) + circle(52, 10, 2.5)
    )
    + _heated(30, 20, "v-3"),
    "PipeWall": Symbol(
        80,
        20,
        {"inside": (40, 0), "outside": (40, 20)},
        rect(10, 6, 60, 8) + "M40 0v6M40 14v6M20 6l-6 8M40 6l-6 8M60 6l-6 8",
    ),
    "PilotStage": Symbol(
        40, 40, {"u": (0, 20), "y": (40, 20)}, rect(0, 0, 40, 40) + "M7 7v26h26M7 33c5 0 5-24 10-24s4 10 8 10 4-3 8-3"
    ),
    "TJunction": Symbol(
        60, 40, {"a": (0, 20), "b": (60, 20), "c": (30, 40)}, "M0 20h60M30 20v20", solid=circle(30, 20, 4)
    ),
    "Filter": Symbol(60, 40, {"a": (0, 20), "b": (60, 20)}, DIAMOND, dashed="M30 2v36"),
    "Vessel": Symbol(60, 40, {"ports": (30, 40)}, "M4 4v28h52v-28M4 12h52M26 17h8M28 21h4M30 32v8")
    + _heated(60, 20, "h-4"),
    "CirculationPump": Symbol(60, 40, FLOW, circle(30, 20, 16) + "M0 20h14M46 20h14M22 6l24 14-24 14")
    + _heated(30, 40, "v-4"),
    "FlowVolume": Symbol(60, 40, FLOW, circle(30, 20, 16) + "M0 20h14M46 20h14") + _heated(30, 40, "v-4"),
    "Radiator": Symbol(
        60, 40, {**FLOW, "room": (30, 0)}, rect(10, 6, 40, 28) + "M0 20h10M50 20h10M20 6v28M30 0v34M40 6v28"
    )
    + _heated(40, 40, "v-6"),
    "ThermostaticValve": Symbol(
        60,
        40,
        {**FLOW, "sensor": (30, 0)},
        "M0 20h14v-9l32 18v-18l-32 18v-9M46 20h14M30 20v-6M30 4v-4" + circle(30, 9, 5),
    )
    + _heated(40, 40, "v-14"),
    "HeatExchanger": Symbol(
        60,
        60,
        {"a_1": (0, 20), "b_1": (60, 20), "a_2": (60, 40), "b_2": (0, 40)},
        rect(10, 6, 40, 48) + "M0 20h20l5-6 10 12 5-6h20M0 40h20l5-6 10 12 5-6h20",
    )
    + Symbol(
        60, 60, {"outlet_1": (30, 0), "outlet_2": (30, 60)}, leads={"outlet_1": "M30 0v6", "outlet_2": "M30 60v-6"}
    ),
    "Cooler": Symbol(
        60,
        40,
        {"a": (0, 20), "b": (60, 20), "oil": (30, 0), "coolant": (30, 40)},
        DIAMOND + "M30 14V6M30 26v8M12 20h36",
        solid=head(30, 3, 0, -1) + head(30, 37, 0, 1),
    )
    + _heated(50, 40, "v-20"),
    "SingleActingCylinder": _cylinder(ROD + "M102 18v4M10 36v4M102 20h8", {"port": (10, 40), "flange": (110, 20)})
    + _heated(20, 40, "v-4"),
    "DoubleActingCylinder": _cylinder(
        ROD + "M102 18v4M10 36v4M70 36v4M102 20h8", {"a": (10, 40), "b": (70, 40), "flange": (110, 20)}
    )
    + WALLS,
    "HydraulicCylinder": _cylinder(
        ROD + "M102 18v4M10 36v4M70 36v4M102 20h8", {"a": (10, 40), "b": (70, 40), "flange": (110, 20)}
    ),
    "TandemCylinder": Symbol(
        180,
        40,
        {"a1": (10, 40), "b1": (70, 40), "a2": (90, 40), "b2": (150, 40), "flange": (180, 20)},
        rect(4, 4, 152, 32)
        + "M80 4v32M28 18h144M28 22h144M28 4v32M104 4v32M172 18v4M10 36v4M70 36v4M90 36v4M150 36v4M172 20h8",
    ),
    "SlaveCylinder": _cylinder(ROD + "M102 18v4M0 20h4M102 20h8", PUSHED) + _heated(20, 40, "v-4"),
    "StoppedCylinder": _cylinder(ROD + "M102 18v4M0 20h4M102 20h8M10 4v8M74 4v8M10 36v-8M74 36v-8", PUSHED),
    "MasterCylinder": Symbol(
        110,
        40,
        {"rod": (0, 20), "port": (110, 20)},
        rect(30, 4, 76, 32) + "M82 18h-74M82 22h-74M82 4v32M8 18v4M0 20h8M106 20h4",
    )
    + _heated(90, 40, "v-4"),
    "RotaryVaneActuator": Symbol(
        60,
        40,
        {"a": (10, 40), "b": (50, 40), "flange": (60, 20)},
        "M6 34a24 24 0 0 1 48 0zM30 34v-24M10 34v6M50 34v6M48 20h12",
        solid=circle(30, 34, 3),
    )
    + with_port("heat_a", 20, 40, "v-6")
    + with_port("heat_b", 40, 40, "v-6"),
    "PressureSensor": Symbol(
        60,
        40,
        {"port": (30, 40), "y": (60, 20)},
        circle(30, 20, 15) + "M30 35v5M45 20h15M22 28L35 15",
        solid=head(38, 12, 0.7, -0.7),
    ),
    "FlowSensor": Symbol(
        60,
        40,
        {"a": (0, 20), "b": (60, 20), "y": (30, 0)},
        circle(30, 20, 15) + "M0 20h60M18 11q12 7 24 0M18 29q12-7 24 0M30 0v5",
    ),
}
