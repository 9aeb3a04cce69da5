"""Symbols of rotational components."""

from acausal import Symbol

from .._drawing import SHORT_SPRING, at, circle, head, rect, with_port
from .._mechanical_symbols import ENDS, FLANGE, SHARED, multi_sensor

COLOUR = "#d55e00"  # of lines and parts of this domain


def _source(letter: str, **inputs: tuple[int, int]) -> Symbol:
    """A drive with the shaft on the right."""
    lead = "M0 20h4" if "u" in inputs else ""
    return Symbol(
        60,
        40,
        {"flange": (60, 20), **inputs},
        circle(20, 20, 16) + "M36 20h24" + lead + "M48 10a6 12 0 0 1 0 20",
        solid=head(47, 31, -0.8, 0.6, 6),
        texts=((20, 20, letter, 13.0 if len(letter) < 3 else 10.0),),
    )


def _sensor(letter: str, **outputs: tuple[int, int]) -> Symbol:
    return Symbol(
        60, 40, {**FLANGE, **outputs}, circle(30, 20, 15) + "M0 20h15M45 20h15", texts=((30, 20, letter, 13),)
    )


def _between(letter: str, **outputs: tuple[int, int]) -> Symbol:
    """A sensor between two shafts."""
    return Symbol(
        60, 40, {**ENDS, **outputs}, circle(30, 20, 15) + "M0 20h15M45 20h15M30 0v5", texts=((30, 20, letter, 13),)
    )


def _bearing() -> Symbol:
    """A shaft between two blocks on the ground."""
    blocks = rect(12, 8, 20, 6) + rect(12, 26, 20, 6)
    return Symbol(
        40,
        40,
        FLANGE,
        "M0 20h36" + blocks + at(12, 8, "m4 0l4-5m1 5l4-5m1 5l4-5") + at(12, 32, "m0 5l4-5m1 5l4-5m1 5l4-5"),
    )


def _gear(more: str = "") -> Symbol:
    wheels = circle(15, 20, 10) + circle(41, 20, 16) + circle(15, 20, 1.5) + circle(41, 20, 1.5)
    return Symbol(60, 40, ENDS, wheels + "M0 20h13.5M42.5 20h17.5" + more) + with_port("support", 30, 40, "v-8")


def _plates(more: str = "", solid: str = "") -> Symbol:
    """The plates of a clutch, pressed together by the signal."""
    return Symbol(
        60,
        40,
        {**ENDS, "u": (30, 0)},
        "M0 20h26v-13v26M60 20h-26v-13v26" + more,
        dashed="M30 0v10",
        solid=head(26, 12, 1, 0, 0) + solid,
    )


PLANETS = circle(30, 30, 24) + circle(30, 30, 8) + circle(30, 14, 8) + circle(30, 46, 8)
STAGE = Symbol(
    60,
    60,
    {"sun": (0, 30), "carrier": (60, 30), "ring": (30, 0)},
    PLANETS + "M0 30h22M30 0v6M60 30h-16v-16h-14M44 30v16h-14",
    solid=circle(30, 14, 1.5) + circle(30, 46, 1.5),
)
TYRE = Symbol(
    60,
    40,
    {"shaft": (0, 20), "rod": (60, 20)},
    circle(30, 18, 15)
    + circle(30, 18, 9)
    + "M0 20h21M39 20h21M10 33h40M14 33l-4 5M22 33l-4 5M30 33l-4 5M38 33l-4 5M46 33l-4 5",
)
BELT = Symbol(
    60, 40, ENDS, circle(15, 20, 8) + circle(42, 20, 14) + "M0 20h13M44 20h16M13.3 12.2l25.8-5.9M13.3 27.8l25.8 5.9"
)
BRAKE = Symbol(
    40,
    40,
    {**FLANGE, "u": (20, 0)},
    "M0 20h18M18 6v28M24 8v24M24 20h6M30 8v24M30 12l6-4M30 18l6-4M30 24l6-4M30 30l6-4",
    dashed="M20 0v6",
) + with_port("support", 30, 40, "v-8")
GEAR, BEARING = _gear(), _bearing() + with_port("support", 20, 40, "v-8")
SPEED_LOAD = _source("τ(ω)")

SYMBOLS = {
    **SHARED,
    "ToGround": _bearing(),
    "ShaftFriction": BEARING,
    "CouplingFriction": Symbol(60, 40, ENDS, "M0 20h26v-13v26M60 20h-26v-13v26"),
    "DryFriction": BEARING,
    "Pressed": Symbol(40, 40, {"u": (20, 0)}, rect(4, 8, 32, 24)),
    "Inertia": Symbol(60, 40, ENDS, rect(18, 3, 24, 34) + "M0 20h18M42 20h18", texts=((30, 20, "J", 13),)),
    "ElastoBacklash": Symbol(
        60, 40, ENDS, "M0 20h22M22 20h12M34 12v16M26 6h-2M26 6h20v28h-20M46 20h14M26 6v8M26 34v-8"
    ),
    "FlexibleCoupling": Symbol(
        60,
        40,
        ENDS,
        rect(10, 6, 8, 28)
        + rect(42, 6, 8, 28)
        + "M0 20h10M50 20h10"
        + at(18, 12, "h4" + SHORT_SPRING + "h4")
        + at(18, 28, "h4" + SHORT_SPRING + "h4"),
    ),
    "Disc": Symbol(60, 40, ENDS, "M0 20h27v-12v24M60 20h-27v-12v24M27 8h6M27 32h6"),
    "HardStop": Symbol(
        60,
        40,
        FLANGE,
        "M0 20h40M30 20v-10M14 10v-7h6v7M42 10v-7h6v7"
        + "M10 3h44"
        + "M12 3l4-3M20 3l4-3M28 3l4-3M36 3l4-3M44 3l4-3"
        + circle(30, 20, 4),
    ),
    "IdealGear": GEAR,
    "LossyGear": GEAR + Symbol(0, 0, {}, texts=((41, 30, "η", 10),)),
    "WormGear": Symbol(
        60,
        40,
        {"worm": (0, 20), "wheel": (60, 20)},
        rect(10, 11, 18, 18)
        + "M12 29l4-18M18 29l4-18M24 29l4-18M0 20h10M45.5 20h14.5"
        + circle(44, 20, 14)
        + circle(44, 20, 1.5),
    ),
    "PlanetaryGear": STAGE,
    "PlanetaryGearbox": STAGE,
    "PlanetaryTrain": Symbol(
        60,
        60,
        {"a": (0, 30), "b": (60, 30), "support": (30, 60)},
        STAGE.lines.replace("M30 0v6", "M30 60v-6"),
        solid=STAGE.solid,
    ),
    "IdealGearR2T": Symbol(
        60,
        40,
        {"shaft": (0, 20), "rod": (60, 30)},
        circle(22, 20, 10)
        + circle(22, 20, 1.5)
        + "M0 20h20.5M6 30h54M6 37h44v-7M6 37v-7"
        + "M10 30v3M16 30v3M22 30v3M28 30v3M34 30v3M40 30v3",
    ),
    "LossyGearR2T": Symbol(
        60,
        40,
        {"shaft": (0, 20), "rod": (60, 20)},
        "M0 20h8" + rect(8, 14, 34, 12) + "M12 26l4-12M18 26l4-12M36 26l4-12" + rect(22, 8, 12, 24) + "M34 11h14v9h12",
    ),
    "IdealRollingWheel": Symbol(
        60,
        40,
        {"shaft": (0, 20), "rod": (60, 20)},
        circle(30, 18, 15)
        + circle(30, 18, 1.5)
        + "M0 20h15M45 20h15M10 33h40M14 33l-4 5M22 33l-4 5M30 33l-4 5M38 33l-4 5M46 33l-4 5",
    ),
    "MagicFormula": TYRE,
    "Tyre": TYRE,
    "TransientTyre": TYRE + Symbol(0, 0, {}, texts=((30, 18, "σ", 11),)),
    "Belt": BELT,
    "FrictionBelt": BELT + Symbol(0, 0, {}, texts=((42, 20, "μ", 11),)),
    "SynchronousBelt": BELT + Symbol(0, 0, {}, dashed="M13.3 14.2l25.8-5.9M13.3 25.8l25.8 5.9"),
    "Clutch": _plates(solid=head(25, 10, 1, 0, 6) + head(35, 10, -1, 0, 6)),
    "OneWayClutch": _plates("M10 26l8-6-8-6z"),
    "Brake": BRAKE,
    "SpringAppliedBrake": BRAKE + Symbol(0, 0, {}, "M24 2h6l1-2 2 4 2-4 2 4 1-2"),
    "EddyCurrentBrake": Symbol(
        40,
        40,
        FLANGE,
        "M0 20h19" + rect(17, 8, 4, 28) + rect(6, 4, 8, 10) + rect(24, 4, 8, 10) + "M10 4v-3h18v3",
    )
    + with_port("heat", 20, 40, "v-4"),
    "IronLoss": _bearing() + with_port("heat", 20, 40, "v-8"),
    "ViscousFriction": _bearing(),
    "ConstantTorque": _source("τ"),
    "SignalTorque": _source("τ", u=(0, 20)),
    "SignalTorque2": _between("τ", u=(30, 0)),
    "LinearSpeedDependentTorque": SPEED_LOAD,
    "QuadraticSpeedDependentTorque": SPEED_LOAD,
    "ConstantSpeed": _source("ω"),
    "SignalSpeed": _source("ω", u=(0, 20)),
    "SignalAngle": _source("φ", u=(0, 20)),
    "SignalAcceleration": _source("α", u=(0, 20)),
    "AngleSensor": _sensor("φ", y=(60, 20)),
    "SpeedSensor": _sensor("ω", y=(60, 20)),
    "AccelerationSensor": _sensor("α", y=(60, 20)),
    "Encoder": Symbol(
        60,
        40,
        {**FLANGE, "angle": (60, 10), "speed": (60, 30)},
        rect(14, 4, 34, 32) + "M0 20h14M48 10h12M48 30h12M18 26h4v-12h4v12h4v-12h4v12h4v-12h4",
    ),
    "TorqueSensor": _between("τ", y=(30, 0)),
    "PowerSensor": _between("P", y=(30, 0)),
    "RelativeAngleSensor": _between("Δφ", y=(30, 0)),
    "RelativeSpeedSensor": _between("Δω", y=(30, 0)),
    "MultiSensor": multi_sensor("ω τ P", "speed", "torque", "power"),
    "ReleaseBearing": Symbol(
        60,
        40,
        {"a": (0, 20), "b": (60, 20), "shaft": (30, 40)},
        "M0 20h22M22 6v28M38 6v28M38 20h22M30 36v4" + circle(30, 12, 6) + circle(30, 28, 6),
    ),
    "CrankSlider": Symbol(
        60,
        40,
        {"shaft": (0, 20), "slider": (60, 20)},
        circle(16, 20, 12) + "M0 20h16l6-10 20 10" + rect(36, 13, 14, 14) + "M50 20h10M32 31h22",
        solid=circle(16, 20, 2) + circle(22, 10, 2) + circle(42, 20, 2),
    ),
    "Cam": Symbol(
        60,
        40,
        {"shaft": (0, 20), "follower": (60, 20)},
        "M0 20h16M16 8a12 12 0 0 0 0 24q8 0 18-12q-10-12-18-12zM34 6v28M34 20h26",
        solid=circle(16, 20, 2),
    ),
}
