"""Symbols of translational components."""

from acausal import Symbol

from .._drawing import at, circle, head, rect, with_port
from .._mechanical_symbols import ENDS, FLANGE, SHARED, multi_sensor

COLOUR = "#8a6d00"  # of lines and parts of this domain

WALL = "M46 4v32M46 10l6-4M46 17l6-4M46 24l6-4M46 31l6-4"
FLOOR = "M6 32h48M12 32l-5 5M20 32l-5 5M28 32l-5 5M36 32l-5 5M44 32l-5 5M52 32l-5 5"


def _source(letter: str, **inputs: tuple[int, int]) -> Symbol:
    """A drive that pushes the flange on the right."""
    lead = "M0 20h4" if "u" in inputs else ""
    return Symbol(
        60,
        40,
        {"flange": (60, 20), **inputs},
        rect(4, 6, 30, 28) + "M34 20h26" + lead,
        solid=head(52, 20, 1, 0, 10),
        texts=((19, 20, letter, 13.0 if len(letter) < 3 else 10.0),),
    )


def _sensor(letter: str) -> Symbol:
    return Symbol(
        60, 40, {**FLANGE, "y": (60, 20)}, rect(14, 7, 32, 26) + "M0 20h14M46 20h14", texts=((30, 20, letter, 13),)
    )


def _between(letter: str, **ports: tuple[int, int]) -> Symbol:
    """A sensor or a force between two rods."""
    return Symbol(
        60, 40, {**ENDS, **ports}, rect(14, 7, 32, 26) + "M0 20h14M46 20h14M30 0v7", texts=((30, 20, letter, 13),)
    )


def _to_wall(path: str, solid: str = "") -> Symbol:
    return Symbol(60, 40, FLANGE, path + WALL, solid=solid)


def _sliding() -> Symbol:
    """A body on a surface."""
    return Symbol(60, 40, FLANGE, "M0 20h14" + rect(14, 10, 32, 22) + FLOOR)


MASS = Symbol(60, 40, ENDS, rect(12, 5, 36, 30) + "M0 20h12M48 20h12", texts=((30, 20, "m", 13),))
FRICTION = _sliding() + with_port("support", 30, 40, "v-8") + Symbol(0, 0, {}, texts=((30, 21, "μ", 13),))
SPEED_LOAD = _source("f(v)")
SPRING_TO_WALL = _to_wall(at(0, 20, "h8l3-8 6 16 6-16 6 16 6-16 3 8h8"))

SYMBOLS = {
    **SHARED,
    "ToGround": _sliding(),
    "DryFriction": FRICTION,
    "Mass": MASS,
    "SlidingMass": MASS,
    "MassWithStopAndFriction": Symbol(
        80,
        40,
        {"a": (0, 20), "b": (80, 20)},
        rect(24, 8, 32, 24)
        + "M0 20h24M56 20h24M10 32h60M12 32v-8M68 32v-8"
        + "M18 32l-5 5M28 32l-5 5M38 32l-5 5M48 32l-5 5M58 32l-5 5M68 32l-5 5",
        texts=((40, 20, "m", 13),),
    ),
    "Rod": Symbol(60, 20, {"a": (0, 10), "b": (60, 10)}, "M0 10h6M54 10h6" + rect(6, 7, 48, 6)),
    "DualRateSpring": Symbol(
        60,
        20,
        {"a": (0, 10), "b": (60, 10)},
        at(0, 10, "h6l3-8 5 16 5-16 5 16 5-16 2 8 2 5 3-10 3 10 3-10 3 10 3-10 2 5h10"),
    ),
    "DiscSpring": Symbol(60, 40, ENDS, "M0 20h14M46 20h14" + "M14 8l8 24 8-24 8 24 8-24M14 32l8-24 8 24 8-24 8 24"),
    "ElastoGap": Symbol(
        60,
        40,
        ENDS,
        "M0 20h14M14 8v24M22 8v24M22 12h10"
        + at(32, 12, "l2-5 4 10 4-10 2 5")
        + "M44 12h6M22 28h14M36 24v8M30 22h14v12h-14M44 28h6M50 12v16M50 20h10",
    ),
    "ClutchSpring": SPRING_TO_WALL,
    "TabulatedSpring": SPRING_TO_WALL + Symbol(0, 0, {}, "M8 34L36 6", solid=head(38, 4, 0.7, -0.7)),
    "DiaphragmClutch": _to_wall("M0 20h10M10 8v24M10 8q14-2 22 12q-8 14-22 12M32 6v28M36 6v28M36 20h10"),
    "HardStop": Symbol(60, 40, FLANGE, "M0 20h14" + rect(14, 14, 24, 12) + WALL + "M6 30v8M6 38h40M6 30v-4M38 20h2"),
    "Lever": Symbol(
        60,
        40,
        {"a": (0, 10), "b": (60, 30), "fulcrum": (30, 40)},
        "M0 10h12M60 30h-12M14 3L46 37M30 20l-6 12h12z",
        solid=circle(12, 10, 2) + circle(48, 30, 2) + circle(30, 20, 2),
    ),
    "Brake": Symbol(
        60,
        40,
        {**FLANGE, "u": (30, 0)},
        "M0 20h54" + rect(18, 9, 24, 6) + rect(18, 25, 24, 6) + "M18 31l4 4M26 31l4 4M34 31l4 4",
        dashed="M30 0v4",
        solid=head(30, 9, 0, 1, 6),
    )
    + with_port("support", 30, 40, "v-9"),
    "RigidContact": Symbol(60, 40, ENDS, "M0 20h12" + rect(12, 8, 14, 24) + rect(34, 8, 14, 24) + "M48 20h12"),
    "Rope": Symbol(60, 20, {"a": (0, 10), "b": (60, 10)}, "M0 10h8q11-9 22 0t22 0h8"),
    "Tackle": Symbol(
        60,
        40,
        ENDS,
        "M14 2h36M18 2l4-2M28 2l4-2M38 2l4-2M32 2v2M0 20h16l10-10M26 10v16M38 10v16M32 26v11h16v-17h12"
        + circle(32, 10, 6)
        + circle(32, 26, 6),
    ),
    "Vehicle": Symbol(
        60,
        40,
        FLANGE,
        "M0 20h8M8 28v-10l10-2 6-8h16l8 8 6 2v10M8 28h4M24 28h14M50 28h4M2 35h56"
        + circle(18, 28, 6)
        + circle(44, 28, 6),
    )
    + with_port("grade", 30, 40, "v-5"),
    "Driver": Symbol(
        80,
        40,
        {"u_s": (0, 20), "u_m": (20, 40), "traction": (80, 10), "y": (80, 20), "brake": (80, 30)},
        rect(0, 0, 80, 40) + circle(40, 20, 14) + circle(40, 20, 4) + "M26.5 17l9.5 2M53.5 17l-9.5 2M40 24v10",
    )
    + with_port("u_ff", 60, 40, "v-4"),
    "ViscousFriction": _sliding(),
    "ConstantForce": _source("F"),
    "SignalForce": _source("F", u=(0, 20)),
    "SignalForce2": _between("F", u=(30, 0)),
    "LinearSpeedDependentForce": SPEED_LOAD,
    "QuadraticSpeedDependentForce": SPEED_LOAD,
    "ConstantSpeed": _source("v"),
    "SignalSpeed": _source("v", u=(0, 20)),
    "SignalPosition": _source("s", u=(0, 20)),
    "SignalAcceleration": _source("a", u=(0, 20)),
    "PositionSensor": _sensor("s"),
    "SpeedSensor": _sensor("v"),
    "AccelerationSensor": _sensor("a"),
    "ForceSensor": _between("F", y=(30, 0)),
    "PowerSensor": _between("P", y=(30, 0)),
    "RelativePositionSensor": _between("Δs", y=(30, 0)),
    "RelativeSpeedSensor": _between("Δv", y=(30, 0)),
    "MultiSensor": multi_sensor("v F P", "speed", "force", "power"),
}
