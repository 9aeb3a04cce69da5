"""Symbols of planar components."""

from acausal import Symbol

from .._drawing import SHORT_SPRING, at, circle, head, rect, with_port

COLOUR = "#5b5b9a"  # of lines and parts of this domain

ENDS = {"a": (0, 20), "b": (60, 20)}
FRAME = {"frame": (0, 20)}
PINS = circle(8, 20, 4) + circle(52, 20, 4)


def _force(letter: str, **inputs: tuple[int, int]) -> Symbol:
    """A drive that pushes the frame on the right."""
    leads = "".join(f"M{x} {y}{'h6' if x == 0 else ''}" for x, y in inputs.values())
    return Symbol(
        60,
        40,
        {"frame": (60, 20), **inputs},
        rect(6, 4, 28, 32) + "M34 20h26" + leads,
        solid=head(52, 20, 1, 0, 10),
        texts=((20, 20, letter, 11),),
    )


def _sensor(letters: str, *outputs: str) -> Symbol:
    ports = {name: (60, 10 + 10 * i) for i, name in enumerate(outputs)}
    leads = "".join(f"M46 {10 + 10 * i}h14" for i in range(len(outputs)))
    return Symbol(60, 40, {**FRAME, **ports}, rect(14, 3, 32, 34) + "M0 20h14" + leads, texts=((30, 20, letters, 11),))


def _between(letters: str, *outputs: str) -> Symbol:
    ports = {name: (20 + 10 * i, 0) if len(outputs) > 1 else (30, 0) for i, name in enumerate(outputs)}
    leads = "".join(f"M{x} 0v7" for x, _ in ports.values())
    return Symbol(
        60, 40, {**ENDS, **ports}, rect(14, 7, 32, 26) + "M0 20h14M46 20h14" + leads, texts=((30, 20, letters, 11),)
    )


SYMBOLS = {
    "AtFrame": Symbol(60, 40, FRAME, rect(12, 8, 36, 24) + "M0 20h12"),
    "TwoFrames": Symbol(60, 40, ENDS, rect(12, 8, 36, 24) + "M0 20h12M48 20h12"),
    "Line": Symbol(60, 40, ENDS, PINS + "M0 20h4M56 20h4M12 20h36"),
    "Fixed": Symbol(
        20, 30, {"frame": (10, 0)}, "M10 0v12M0 24h20M10 12l-7 12M10 12l7 12M3 24l-4 5M9 24l-4 5M15 24l-4 5"
    ),
    "Body": Symbol(
        60,
        40,
        FRAME,
        circle(32, 20, 15) + "M0 20h17M32 5v30M17 20h30",
        solid="M32 20h15a15 15 0 0 0-15-15zM32 20h-15a15 15 0 0 0 15 15z",
    ),
    "Bar": Symbol(
        60, 40, ENDS, rect(4, 13, 52, 14) + "M0 20h4M56 20h4" + circle(30, 20, 2), texts=((18, 20, "m", 11),)
    ),
    "FixedTranslation": Symbol(60, 20, {"a": (0, 10), "b": (60, 10)}, "M0 10h60M4 5v10M56 5v10"),
    "Revolute": Symbol(60, 40, ENDS, circle(30, 20, 10) + circle(30, 20, 3) + "M0 20h20M40 20h20")
    + with_port("shaft", 30, 40, "v-10"),
    "Prismatic": Symbol(60, 40, ENDS, "M14 12h30v16h-30z" + "M0 20h14M22 20h38M22 16v8")
    + with_port("rod", 30, 40, "v-12"),
    "ConstantForce": _force("F"),
    "SignalForce": _force("F", fx=(0, 10), fy=(0, 20), tau=(0, 30)),
    "Spring": Symbol(60, 40, ENDS, PINS + "M0 20h4M56 20h4M12 20h8" + at(20, 20, SHORT_SPRING + "h4") + "M36 20h12"),
    "Damper": Symbol(60, 40, ENDS, PINS + "M0 20h4M56 20h4M12 20h18M30 13v14M23 10h15v20h-15M38 20h10"),
    "LineForce": Symbol(60, 40, ENDS, PINS + "M0 20h4M56 20h4M12 20h9M39 20h9" + rect(21, 13, 18, 14))
    + with_port("rod", 30, 40, "v-13"),
    "PositionSensor": _sensor("x y φ", "x", "y", "phi"),
    "SpeedSensor": _sensor("v w", "vx", "vy", "w"),
    "DistanceSensor": _between("L", "reading"),
    "ForceSensor": _between("F M", "fx", "fy", "tau"),
}
