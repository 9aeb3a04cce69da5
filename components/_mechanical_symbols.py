"""Symbols that rotational and translational components share."""

from acausal import Symbol

from ._drawing import SPRING, at, head, rect

ENDS = {"a": (0, 20), "b": (60, 20)}
FLANGE = {"flange": (0, 20)}

SHARED = {
    "Compliant": Symbol(60, 40, ENDS, rect(12, 8, 36, 24) + "M0 20h12M48 20h12"),
    "Spring": Symbol(60, 20, {"a": (0, 10), "b": (60, 10)}, at(0, 10, SPRING)),
    "Damper": Symbol(60, 40, ENDS, "M0 20h30M30 12v16M22 8h22v24h-22M44 20h16"),
    "TabulatedDamper": Symbol(
        60, 40, ENDS, "M0 20h30M30 12v16M22 8h22v24h-22M44 20h16M14 36L46 4", solid=head(48, 2, 0.7, -0.7)
    ),
    "SpringDamper": Symbol(
        60,
        40,
        ENDS,
        "M0 20h6M6 9v22M54 9v22M54 20h6M6 9h14"
        + at(20, 9, "l3-6 5 12 5-12 5 12 2-6")
        + "M40 9h14M6 31h24M30 26v10M22 23h20v16h-20M42 31h12",
    ),
    "Fixed": Symbol(10, 20, {"flange": (0, 10)}, "M0 10h3M3 0v20M3 4l7-4M3 9l7-4M3 14l7-4M3 19l7-4", is_reference=True),
}


def multi_sensor(letters: str, *outputs: str) -> Symbol:
    """A sensor between two flanges with several outputs."""
    ports = {name: (20 + 20 * i, 0) for i, name in enumerate(outputs)}
    return Symbol(
        80,
        40,
        {"a": (0, 20), "b": (80, 20), **ports},
        rect(14, 6, 52, 28) + "M0 20h14M66 20h14M20 0v6M40 0v6M60 0v6",
        texts=((40, 20, letters, 11),),
    )
