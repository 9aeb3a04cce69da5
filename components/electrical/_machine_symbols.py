"""Symbols of converters, machines and three-phase parts, after IEC 60617."""

from acausal import Symbol

from .._drawing import at, circle, head, rect

PINS = {"p": (0, 20), "n": (60, 20)}
FOUR = {"p1": (0, 10), "n1": (0, 50), "p2": (60, 10), "n2": (60, 50)}
MACHINE = {"p": (30, 0), "n": (30, 60), "shaft": (60, 30)}
CAPACITOR_PATH = "h27m0-11v22m6 0v-22m0 11h27"
DOWN = "a6.67 6.67 0 0 1 0 13.33a6.67 6.67 0 0 1 0 13.33a6.67 6.67 0 0 1 0 13.33"


def _converter(left: str, right: str, ports: dict[str, tuple[int, int]]) -> Symbol:
    """A converter: a square with a diagonal, and the kinds of current on both sides."""
    ends = "".join(at(x, y, "h10" if x == 0 else "h-10") for x, y in ports.values() if x in (0, 60))
    ends += "".join(at(x, y, "v10") for x, y in ports.values() if y == 0)
    return Symbol(
        60, 60, ports, rect(10, 10, 40, 40) + "M10 50L50 10" + ends, texts=((20, 20, left, 13), (40, 41, right, 13))
    )


def _machine(letters: str, left: str = "") -> Symbol:
    """A machine with brushes, its shaft on the right, and one more port on the left."""
    ports = {**MACHINE, left: (0, 30)} if left else MACHINE
    brushes = rect(26, 8, 8, 4) + rect(26, 48, 8, 4)
    words = ((30, 30, letters, 13 if len(letters) < 3 else 10),)
    lines = circle(30, 30, 18) + "M30 0v8M30 52v8M48 30h12"
    return Symbol(60, 60, ports, lines, solid=brushes, texts=words, leads={left: "M0 30h12"})


LEG = Symbol(
    60,
    60,
    {"p": (20, 0), "n": (20, 60), "out": (60, 20), "duty": (0, 30), "heat": (50, 60)},
    "M20 0v10M20 24v12M20 50v10M20 30h24v-10h16" + rect(14, 10, 12, 14) + rect(14, 36, 12, 14),
    leads={"duty": "M0 30h10", "heat": "M50 60V43H26"},
)
CHOPPER = Symbol(
    60,
    40,
    {**PINS, "heat": (30, 40)},
    at(0, 20, "h16m-4-6l14-6m-2 12h4m0-6h24v12h-24zm24 6h8"),
    leads={"heat": "M30 40v-14"},
)
PHASE_PLACES = (("a", 20), ("b", 40), ("c", 60))
PHASE_IMPEDANCE = (
    at(0, 10, "h10m0-5h22v10h-22zm22 5h4a6 6 0 0 1 12 0a6 6 0 0 1 12 0h20") + "M2 14l3-8M4 14l3-8M6 14l3-8"
)
VOICE_COIL = Symbol(
    60,
    60,
    {"p": (20, 0), "n": (20, 60), "rod": (60, 30)},
    "M20 0v10" + DOWN + "v10M6 10h-2v40h2M27 30h33",
    solid=head(54, 30, 1, 0),
)
THREE_PHASES = circle(30, 30, 19) + "M0 30h11M49 30h11"

MACHINES = {
    "AveragedBridge": _converter("=", "=", {**FOUR, "duty": (30, 0)}),
    "HBridge": _converter("=", "=", {**FOUR, "duty": (30, 0)}),
    "CurrentLimitedBridge": _converter("=", "=", {**FOUR, "duty": (30, 0)}),
    "CurrentControlledBridge": _converter("=", "=", {**FOUR, "u": (30, 0)}),
    "Inverter": _converter("=", "≈", {"p": (0, 20), "n": (0, 40), "machine": (60, 30), "u_d": (20, 0), "u_q": (40, 0)}),
    "Leg": LEG,
    "HalfBridge": LEG + Symbol(0, 0, {}, "M32 38h4v-6h6v6h4"),
    "AveragedHalfBridge": LEG + Symbol(0, 0, {}, "M32 36h14"),
    "PhaseModulator": Symbol(
        60,
        80,
        {
            **{f"u_{x}": (0, y) for x, y in PHASE_PLACES},
            **{f"d_{x}": (60, y) for x, y in PHASE_PLACES},
        },
        rect(0, 0, 60, 80) + "M10 52h6v-24h8v24h6v-24h12v24h8M10 40c10-28 12-28 20 0s12 28 20 0",
    ),
    "PhaseInverter": _converter(
        "=",
        "≈",
        {"p": (0, 20), "n": (0, 40), "phases": (60, 30), "heat": (30, 60)}
        | {"u_a": (20, 0), "u_b": (30, 0), "u_c": (40, 0)},
    )
    + Symbol(0, 0, {}, leads={"heat": "M30 60v-10"}),
    "DiodeBridge": _converter("≈", "=", {"phases": (0, 30), "p": (60, 20), "n": (60, 40)}),
    "Chopper": CHOPPER,
    "BrakeChopper": CHOPPER + Symbol(0, 0, {}, "M7 4v5h3v-5h4v5h3"),
    "AveragedBrakeChopper": CHOPPER + Symbol(0, 0, {}, "M6 7h11"),
    "PhasePins": Symbol(
        40,
        60,
        {"phases": (0, 30), "a": (40, 10), "b": (40, 30), "c": (40, 50)},
        "M0 30h40M10 30L24 10h16M10 30L24 50h16",
    ),
    "StarPoint": Symbol(
        40, 40, {"phases": (0, 20), "n": (40, 20)}, "M0 20h8M20 20L12 8M20 20L12 32M20 20h20", solid=circle(20, 20, 2)
    ),
    "ThreePhaseSource": Symbol(
        60,
        60,
        {"phases": (60, 30), "n": (0, 30)},
        THREE_PHASES + "M18 30c4-12 8-12 12 0s8 12 12 0",
        texts=((30, 42, "3", 10),),
    ),
    "PhaseImpedance": Symbol(80, 20, {"p": (0, 10), "n": (80, 10)}, PHASE_IMPEDANCE),
    "PhaseCapacitor": Symbol(
        60, 20, {"phases": (0, 10), "n": (60, 10)}, at(0, 10, CAPACITOR_PATH) + "M10 14l4-8M13 14l4-8M16 14l4-8"
    ),
    "DqTerminals": Symbol(
        60,
        60,
        {"phases": (0, 30), "machine": (60, 30), "shaft": (30, 60)},
        rect(10, 10, 40, 40) + "M10 50L50 10M0 30h10M50 30h10M30 50v10",
        texts=((21, 21, "abc", 10), (39, 41, "dq", 11)),
    ),
    "EMF": _machine("EMF", "support"),
    "MagnetEMF": _machine("EMF", "heat"),
    "DCMotor": _machine("M"),
    "BrushedMotor": _machine("M", "ambient"),
    "PMSM": Symbol(
        60,
        60,
        {"terminals": (0, 30), "shaft": (60, 30)},
        THREE_PHASES,
        texts=((30, 25, "M", 12), (30, 38, "3~", 10)),
    ),
    "PMSMDrive": Symbol(
        120,
        60,
        {"p": (0, 20), "n": (0, 40), "u": (30, 0), "shaft": (120, 30)},
        rect(10, 10, 40, 40)
        + "M10 50L50 10M0 20h10M0 40h10M30 0v10M50 22h16M50 30h11M50 38h16M99 30h21"
        + circle(80, 30, 19),
        texts=((20, 20, "=", 13), (40, 41, "≈", 13), (80, 25, "M", 12), (80, 38, "3~", 10)),
    ),
    "InductionMachine": Symbol(
        60,
        60,
        {"phases": (0, 30), "shaft": (60, 30)},
        THREE_PHASES + circle(30, 30, 15),
        texts=((30, 25, "M", 11), (30, 36, "3~", 9)),
    ),
    "StepperMotor": Symbol(
        60,
        60,
        {"A_p": (20, 0), "A_n": (40, 0), "B_p": (0, 20), "B_n": (0, 40), "shaft": (60, 30)},
        circle(30, 30, 17) + "M20 0v16M40 0v16M0 20h16M0 40h16M47 30h13M22 36h5v-5h5v-5h5",
    ),
    "LinearSynchronousMotor": Symbol(
        60,
        60,
        {"terminals": (0, 30), "rod": (60, 30)},
        rect(10, 16, 40, 20) + rect(10, 38, 40, 6) + "M0 30h10M50 30h10M20 38v6M30 38v6M40 38v6",
        texts=((30, 26, "M 3~", 11),),
    ),
    "VoiceCoil": VOICE_COIL + Symbol(0, 0, {}, rect(2, 2, 46, 56)),
    "CurrentSetpoints": Symbol(
        60,
        60,
        {"torque": (0, 10), "w": (0, 30), "v_dc": (0, 50), "i_d": (60, 20), "i_q": (60, 40)},
        rect(0, 0, 60, 60),
        texts=((14, 30, "T", 13), (44, 30, "i", 13)),
    ),
    "FieldOrientedController": Symbol(
        80,
        80,
        {"i_d_set": (0, 20), "i_q_set": (0, 40), "w": (0, 60), "i_d": (20, 80), "i_q": (40, 80), "v_dc": (60, 80)}
        | {"u_d": (80, 20), "u_q": (80, 40)},
        rect(0, 0, 80, 80),
        texts=((40, 30, "FOC", 14), (40, 50, "PI", 13)),
    ),
    "RotorToPhases": Symbol(
        60,
        60,
        {"u_d": (0, 20), "u_q": (0, 40), "phi": (30, 60), "y_a": (60, 10), "y_b": (60, 30), "y_c": (60, 50)},
        rect(0, 0, 60, 60) + "M0 60L60 0",
        texts=((16, 16, "dq", 11), (42, 46, "abc", 10)),
    ),
    "TranslationalEMF": VOICE_COIL,
}
