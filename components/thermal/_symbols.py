"""Symbols of thermal components."""

from acausal import Symbol

from .._drawing import at, circle, head, rect

COLOUR = "#7f3c8d"  # of lines and parts of this domain

ENDS = {"a": (0, 20), "b": (60, 20)}
SURFACES = {"solid": (0, 20), "fluid": (60, 20), "u": (30, 0)}


def _source(letter: str, **inputs: tuple[int, int]) -> Symbol:
    lead = "M0 20h5" if inputs else ""
    return Symbol(
        60,
        40,
        {"port": (60, 20), **inputs},
        circle(20, 20, 15) + "M35 20h25" + lead,
        solid=head(54, 20, 1, 0),
        texts=((20, 20, letter, 12),),
    )


def _meter(letter: str, ports: dict[str, tuple[int, int]], leads: str) -> Symbol:
    return Symbol(60, 40, ports, circle(30, 20, 15) + leads, texts=((30, 20, letter, 12),))


def _temperature(**inputs: tuple[int, int]) -> Symbol:
    """A wall at a temperature."""
    lines = rect(10, 4, 26, 32) + "M36 20h24" + ("M0 20h10" if inputs else "")
    hatch = "".join(at(10, y, "l-5 5") for y in (4, 10, 22, 28)) if not inputs else ""
    return Symbol(60, 40, {"port": (60, 20), **inputs}, lines + hatch, texts=((23, 20, "T", 14),))


SYMBOLS = {
    "HeatCapacitor": Symbol(
        40,
        40,
        {"port": (20, 40)},
        "M20 32v8M10 32h20q7 0 7-7v-14q0-9-9-12-9-5-17 0-8 3-8 12v14q0 7 7 7z",
        texts=((20, 19, "C", 13),),
    ),
    "ThermalConductor": Symbol(60, 40, ENDS, rect(12, 10, 36, 20) + "M0 20h12M48 20h12M20 14v12M28 14v12M36 14v12"),
    "Convection": Symbol(
        60,
        40,
        SURFACES,
        rect(8, 6, 8, 28)
        + "M0 20h8M52 20h8M8 14l8-8M8 24l8-8M8 34l8-8M52 8v24"
        + "M20 12q4-5 8 0t8 0t8 0M20 28q4-5 8 0t8 0t8 0",
        solid=head(50, 12, 1, 0, 6) + head(50, 28, 1, 0, 6),
        dashed="M30 0v8",
    ),
    "BodyRadiation": Symbol(
        60,
        40,
        ENDS,
        rect(8, 6, 8, 28) + rect(44, 6, 8, 28) + "M0 20h8M52 20h8M19 20q3-6 6 0t6 0t6 0",
        solid=head(43, 20, 1, 0, 6),
    ),
    "FixedTemperature": _temperature(),
    "SignalTemperature": _temperature(u=(0, 20)),
    "ConstantHeatFlow": _source("Q"),
    "SignalHeatFlow": _source("Q", u=(0, 20)),
    "TemperatureSensor": _meter("T", {"port": (0, 20), "y": (60, 20)}, "M0 20h15M45 20h15"),
    "RelativeTemperatureSensor": _meter("ΔT", {**ENDS, "y": (30, 0)}, "M0 20h15M45 20h15M30 0v5"),
    "HeatFlowSensor": _meter("Q", {**ENDS, "y": (30, 0)}, "M0 20h15M45 20h15M30 0v5"),
}
