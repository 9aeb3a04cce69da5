"""Symbols of electrical components, after IEC 60617."""

from acausal import Symbol

from .._drawing import at, circle, head, rect
from ._machine_symbols import CAPACITOR_PATH, DOWN, FOUR, MACHINES, PINS

COLOUR = "#0072b2"  # of lines and parts of this domain


_RESISTOR = "h12m0-6h36v12h-36zm36 6h12"
_COIL = "h9a7 7 0 0 1 14 0a7 7 0 0 1 14 0a7 7 0 0 1 14 0h9"
_UP = DOWN.replace("0 0 1 0", "0 0 0 0")


def _two_pin(path: str) -> Symbol:
    return Symbol(60, 20, {"p": (0, 10), "n": (60, 10)}, at(0, 10, path))


def _with_port(path: str, name: str, more: Symbol | None = None) -> Symbol:
    """An element with one more port: `u` above, with a dashed line to it, or `heat` below."""
    ports = {**PINS, name: (30, 0) if name == "u" else (30, 40)}
    symbol = Symbol(60, 40, ports, at(0, 20, path), leads={name: "M30 0v10" if name == "u" else "M30 40v-11"})
    return symbol + more if more else symbol


def _source(path: str, solid: str = "") -> Symbol:
    lines = at(0, 20, "h14m32 0h14") + circle(30, 20, 16) + path + at(4, 10, "h6m-3-3v6")
    return Symbol(60, 40, PINS, lines, solid=solid)


def _meter(letter: str, **outputs: tuple[int, int]) -> Symbol:
    lines = at(0, 20, "h15m30 0h15") + circle(30, 20, 15)
    leads = {name: f"M{x} {y}V{35 if y else 5 if x == 30 else 9}" for name, (x, y) in outputs.items()}
    return Symbol(60, 40, {**PINS, **outputs}, lines, texts=((30, 20, letter, 13),), leads=leads)


def _switch(contact: str) -> Symbol:
    lines = at(0, 20, "h18") + circle(20, 20, 2) + at(42, 20, "h18") + circle(40, 20, 2) + contact
    return Symbol(60, 40, {**PINS, "u": (30, 0)}, lines, leads={"u": "M30 0v12"})


def _controlled(control: str, source: str) -> Symbol:
    """A controlled source, drawn as a diamond."""
    return Symbol(60, 60, FOUR, control + "M60 10H42v6l12 14-12 14v6H60" + "M42 16l-12 14 12 14" + source)


VOLTAGE, CURRENT = "M14 20h32", "M30 4v32"
SENSED_VOLTAGE, SENSED_CURRENT = "M0 10h10M0 50h10" + circle(12, 10, 2) + circle(12, 50, 2), "M0 10h12v40h-12"
ADJUSTABLE = Symbol(60, 40, {}, "M16 34L43 7", solid=head(46, 4, 0.7, -0.7))
DIODE = _two_pin("h60M20 1v18l20-9zM40 1v18")
COILS = "M0 10h20" + DOWN + "h-20M60 10h-20" + _UP + "h20"
SOLENOID = Symbol(
    60,
    60,
    {"p": (20, 0), "n": (20, 60), "rod": (60, 30)},
    rect(8, 12, 24, 36) + "M8 48L32 12M20 0v12M20 48v12M32 30h28",
)
AMPLIFIER = Symbol(
    60,
    60,
    {"p": (0, 20), "n": (0, 40), "out": (60, 30)},
    "M10 2V58L54 30zM0 20h10M0 40h10M54 30h6M15 20h8M19 16v8M15 40h8",
)
RESISTOR, INDUCTOR, CAPACITOR = _two_pin(_RESISTOR), _two_pin(_COIL), _two_pin(CAPACITOR_PATH)
OUTPUT = {"y": (30, 0)}
CONTROL = Symbol(60, 40, {"u": (30, 0)}, leads={"u": "M30 0v4"})

SYMBOLS = {
    **MACHINES,
    "TwoPin": Symbol(60, 20, {"p": (0, 10), "n": (60, 10)}, at(0, 10, "h12m36 0h12") + rect(12, 1, 36, 18)),
    "TwoPort": Symbol(60, 60, FOUR, rect(10, 0, 40, 60) + "M0 10h10M0 50h10M60 10h-10M60 50h-10"),
    "Ground": Symbol(20, 20, {"p": (10, 0)}, "M10 0v8M0 8h20M4 13h12M8 18h4", is_reference=True),
    "Resistor": RESISTOR,
    "Conductor": Symbol(60, 20, RESISTOR.ports, RESISTOR.lines, texts=((30, 10, "G", 10),)),
    "NegativeResistor": Symbol(60, 20, RESISTOR.ports, RESISTOR.lines, texts=((30, 10, "−R", 10),)),
    "HeatingResistor": _with_port(_RESISTOR, "heat"),
    "VariableResistor": _with_port(_RESISTOR, "u", ADJUSTABLE),
    "Potentiometer": Symbol(
        60,
        40,
        {**PINS, "u": (20, 0), "contact": (30, 40)},
        at(0, 20, _RESISTOR) + "M30 40v-8",
        dashed="M20 0v8L29 33",
        solid=head(30, 26, 0, -1),
    ),
    "Inductor": INDUCTOR,
    "SaturatingInductor": INDUCTOR + Symbol(0, 0, {}, "M10 0h40"),
    "VariableInductor": _with_port(_COIL, "u", ADJUSTABLE),
    "Capacitor": CAPACITOR,
    "VariableCapacitor": _with_port(CAPACITOR_PATH, "u", ADJUSTABLE),
    "Cable": _two_pin("h60M16 4h28a4 6 0 0 1 0 12h-28a4 6 0 0 1 0-12"),
    "BrushDrop": _with_port("h22m14 0h24M36 8a20 20 0 0 1 0 24", "heat") + Symbol(0, 0, {}, solid=rect(22, 14, 14, 12)),
    "Battery": _with_port("h27m0-13v26m6-20v14m0-7h27M17 9h6m-3-3v6", "heat"),
    "ConstantVoltage": _source(VOLTAGE),
    "SignalVoltage": _source(VOLTAGE) + CONTROL,
    "ConstantCurrent": _source(CURRENT, head(54, 20, 1, 0)),
    "SignalCurrent": _source(CURRENT, head(54, 20, 1, 0)) + CONTROL,
    "Diode": DIODE,
    "IdealDiode": DIODE,
    "IdealClosingSwitch": _switch("M21 19L38 8"),
    "IdealOpeningSwitch": _switch("M22 20L44 14M40 18v-7"),
    "IdealCommutingSwitch": Symbol(
        60,
        40,
        {"p": (0, 20), "n1": (60, 10), "n2": (60, 30), "u": (20, 0)},
        at(0, 20, "h18")
        + circle(20, 20, 2)
        + "M60 10h-18M60 30h-18"
        + circle(40, 10, 2)
        + circle(40, 30, 2)
        + "M22 19L38 11",
        dashed="M20 0v14l6 3",
    ),
    "IdealOpAmp": AMPLIFIER + Symbol(0, 0, {}, texts=((34, 30, "∞", 13),)),
    "OpAmp": AMPLIFIER,
    "VoltageComparator": AMPLIFIER + Symbol(0, 0, {}, "M26 36h9v-12M30 36v-12h9"),
    "Transformer": Symbol(60, 60, FOUR, COILS + "M28 12v36M32 12v36"),
    "IdealTransformer": Symbol(60, 60, FOUR, COILS, solid=circle(20, 5, 2) + circle(40, 5, 2)),
    "Gyrator": Symbol(60, 60, FOUR, "M0 10h16a14 20 0 0 1 0 40h-16M60 10h-16a14 20 0 0 0 0 40h16"),
    "VCV": _controlled(SENSED_VOLTAGE, "M42 16v28"),
    "CCV": _controlled(SENSED_CURRENT, "M42 16v28"),
    "VCC": _controlled(SENSED_VOLTAGE, "M30 30h24"),
    "CCC": _controlled(SENSED_CURRENT, "M30 30h24"),
    "Solenoid": SOLENOID,
    "DataSheetSolenoid": SOLENOID,
    "VoltageSensor": _meter("V", **OUTPUT),
    "CurrentSensor": _meter("A", **OUTPUT),
    "PowerSensor": _meter("W", **OUTPUT, reference=(30, 40)),
    "DqCurrentSensor": _meter("A", y_d=(20, 0), y_q=(40, 0)),
}
