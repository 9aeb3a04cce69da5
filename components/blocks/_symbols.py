"""Symbols of signal blocks: boxes with the law or the curve of the block."""

import dataclasses

from acausal import Symbol

from .._drawing import circle, head, rect, with_port

COLOUR = "#009e73"  # of lines and parts of this domain

ONE = {"u": (0, 20), "y": (40, 20)}
TWO = {"u1": (0, 10), "u2": (0, 30), "y": (40, 20)}
AXES = "M8 20h24M20 6v28"
ERROR = {"u_s": (0, 20), "u_m": (20, 40), "y": (40, 20)}


def _box(ports: dict[str, tuple[int, int]], text: str = "", curve: str = "", width: int = 40) -> Symbol:
    places = {port: (x * width // 40 if x == 40 else x, y) for port, (x, y) in ports.items()}
    size = 14.0 if len(text) < 3 else 11.0
    words = ((width / 2, 20.0, text, size),) if text else ()
    return Symbol(width, 40, places, rect(0, 0, width, 40) + curve, texts=words)


def _source(curve: str = "", text: str = "") -> Symbol:
    return _box({"y": (40, 20)}, text, curve)


def _fraction(above: str, below: str, width: int = 60) -> Symbol:
    words = ((width / 2, 11.0, above, 11.0), (width / 2, 30.0, below, 11.0))
    return Symbol(
        width, 40, {"u": (0, 20), "y": (width, 20)}, rect(0, 0, width, 40) + f"M6 20H{width - 6}", texts=words
    )


def _round(text: str) -> Symbol:
    return Symbol(40, 40, TWO, circle(20, 20, 14) + "M0 10h10M0 30h10M34 20h6", texts=((20, 20, text, 14),))


GAIN = Symbol(40, 40, ONE, "M4 3v34L36 20zM0 20h4M36 20h4", texts=((15, 20, "k", 13),))
STAIRS = "M7 32h6v-8h7v-8h7v-7h6"
LIMIT = "M58 28h5l8-16h5"
DIGITAL = "M54 28h5v-5h5v-5h5v-6h5"
CHANGEOVER = {"u1": (0, 10), "u2": (0, 30), "control": (20, 40), "y": (40, 20)}
LIMITED = _box(ERROR, curve=LIMIT, width=80) + with_port("u_ff", 60, 40, "v-4")
SMOOTH = "M6 22l4-8 4 10 4-13 4 17 4-12 4 7 4-6"
SPIKES = "M6 24h4v-9h4v13h4v-18h4v12h4v-7h4v11h4"
PULSES = "M6 30h5v-20h6v20h5v-20h6v20h5"

_SYMBOLS = {
    "SISO": _box(ONE),
    "SI2SO": _box(TWO),
    "SignalSource": _source(),
    "LimitedController": LIMITED,
    "Constant": _source(text="k"),
    "Clock": _source(circle(20, 20, 14) + "M20 10v10l6 5"),
    "Step": _source("M7 30h11v-19h15"),
    "Ramp": _source("M7 30h8l10-19h8"),
    "Sine": _source("M7 20c4-18 9-18 13 0s9 18 13 0"),
    "ChirpSine": _source("M6 20c3-18 8-18 11 0s5 18 8 0s3-14 5 0s2 10 4 0"),
    "ExpSine": _source("M6 20c4-22 8-22 12 0s6 14 9 0s4-8 7 0"),
    "Exponentials": _source("M7 31q3-20 13-21q3 18 13 21"),
    "Pulse": _source(PULSES),
    "SawTooth": _source("M6 31l9-20v20l9-20v20l9-20v20"),
    "Trapezoid": _source("M6 31h3l5-20h8l5 20h6"),
    "Staircase": _source(STAIRS),
    "TimeSeries": _source(
        "M7 31l7-14 7 6 6-13 6 5",
    ),
    "TimeFunction": _source(text="f(t)"),
    "Gain": GAIN,
    "Sum": Symbol(
        40,
        40,
        {"u1": (0, 20), "u2": (20, 40), "y": (40, 20)},
        circle(20, 20, 12) + "M0 20h8M20 40v-8M32 20h8",
        texts=((20, 20, "Σ", 13),),
    ),
    "Product": _round("×"),
    "Division": _round("÷"),
    "Maximum": _box(TWO, "max"),
    "Minimum": _box(TWO, "min"),
    "Function": _box(ONE, "f(u)"),
    "Table1D": _box(ONE, curve="M7 32q4-18 13-14t13-9M7 8v25h26"),
    "Table2D": _box(TWO, curve=rect(9, 9, 22, 22) + "M9 16.3h22M9 23.6h22M16.3 9v22M23.6 9v22"),
    "Integrator": _box(ONE, "∫"),
    "Derivative": _box(ONE, "d/dt"),
    "FirstOrder": _box(ONE, curve="M7 7v26h26M7 33q3-19 26-20"),
    "SecondOrder": _box(ONE, curve="M7 7v26h26M7 33c5 0 5-24 10-24s4 10 8 10 4-3 8-3"),
    "TransferFunction": _fraction("b(s)", "a(s)"),
    "PI": _box(ONE, "PI"),
    "PID": _box(ONE, "PID"),
    "LimPI": LIMITED + Symbol(0, 0, {}, texts=((28, 20, "PI", 13),)),
    "LimPID": LIMITED + Symbol(0, 0, {}, texts=((28, 20, "PID", 13),)),
    "SampledPI": _box(ERROR, curve=DIGITAL, width=80) + Symbol(0, 0, {}, texts=((26, 20, "PI", 13),)),
    "TwoPointController": _box(ERROR, curve="M8 30h18v-20M14 30v-20h18"),
    "LeadLag": _fraction("1 + T1 s", "1 + T2 s"),
    "Notch": _box(ONE, curve="M7 7v26h26M7 12h9q3 0 4 18q1-18 4-18h9"),
    "FixedDelay": _box(ONE, "T"),
    "PadeDelay": _box(ONE, "e⁻ˢᵀ"),
    "TransportDelay": Symbol(
        40, 40, {**ONE, "rate": (20, 40)}, rect(0, 0, 40, 40) + "M8 14h24M8 26h24M12 20h14", solid=head(30, 20, 1, 0)
    ),
    "SampledDelay": _box(ONE, "z⁻ⁿ"),
    "MovingAverage": _box(ONE, "Σ/n"),
    "SampledController": _box(ERROR, curve=DIGITAL, width=80),
    "SampledP": _box(ERROR, curve=DIGITAL, width=80) + Symbol(0, 0, {}, texts=((26, 20, "P", 13),)),
    "SampledPID": _box(ERROR, curve=DIGITAL, width=80) + Symbol(0, 0, {}, texts=((26, 20, "PID", 13),)),
    "UniformNoise": _source(SPIKES),
    "NormalNoise": _source(SPIKES),
    "BandLimitedNoise": _source(SMOOTH),
    "And": _box(TWO, "&"),
    "Or": _box(TWO, "≥1"),
    "Xor": _box(TWO, "=1"),
    "Not": Symbol(40, 40, ONE, rect(0, 0, 34, 40) + circle(37, 20, 3), texts=((17, 20, "1", 14),)),
    "Comparator": _box(TWO, ">"),
    "Hysteresis": _box(ONE, curve="M8 30h18v-20M14 30v-20h18"),
    "Latch": Symbol(
        40,
        40,
        {"set": (0, 10), "reset": (0, 30), "y": (40, 20)},
        rect(0, 0, 40, 40),
        texts=((10, 10, "S", 12), (10, 30, "R", 12)),
    ),
    "Monostable": _box(ONE, curve="M6 30h9v-20h12v20h7"),
    "OnDelay": _box(ONE, curve="M6 24h14v-14h14M8 33h12M8 30v6M20 30v6"),
    "Timer": _box(ONE, curve=circle(20, 20, 14) + "M20 10v10l6 5"),
    "Counter": Symbol(
        40, 40, {"u": (0, 20), "reset": (20, 40), "y": (40, 20)}, rect(0, 0, 40, 40), texts=((20, 20, "123", 11),)
    ),
    "Limiter": _box(ONE, curve=AXES + "M8 29h7l10-18h7"),
    "DeadZone": _box(ONE, curve=AXES + "M8 30l7-10h10l7-10"),
    "Play": _box(ONE, curve=AXES + "M10 31h11l8-22M11 31l8-22h11"),
    "SlewRateLimiter": _box(ONE, curve="M8 31l16-22h8M8 31h4"),
    "SampleHold": _box(ONE, curve=STAIRS),
    "PWM": _box(ONE, curve=PULSES),
    "PWMAverage": Symbol(
        60,
        40,
        {"duty": (0, 10), "supply": (0, 30), "y": (60, 20)},
        rect(0, 0, 60, 40) + "M14 30h5v-20h7v20h6v-20h7v20h7",
        dashed="M12 19h36",
    ),
    "Switch": _box(
        CHANGEOVER, curve="M0 10h11M0 30h11M40 20h-9M13 11l18 9" + circle(12, 10, 1.5) + circle(12, 30, 1.5)
    ),
    "SmoothSwitch": _box(CHANGEOVER, curve="M0 10h9M0 30h9M9 10c12 0 8 10 22 10h9M9 30c12 0 8-10 22-10"),
}
# Mirrored curves would be those of other blocks.
SYMBOLS = {name: dataclasses.replace(symbol, can_turn=False) for name, symbol in _SYMBOLS.items()}
