"""Measurements on the prototypes, as printed in Meloni's thesis (Politecnico di Torino, 2012), in SI units.

The thesis states no uncertainties. Times are read from curves over 200 ms, to a hundredth of the axis. A peak called
"about" is assumed accurate to a tenth, and a holding current to the range that is stated for it.

The captions of Figs. 7.5 and 7.6 are swapped: they state 13.5 V for the slower opening and 9.5 V for the faster one.
A higher voltage cannot open later, and a note to the concluding table gives 70 % of the full voltage for the slower
one. Fig. 7.5 is therefore taken at 9.45 V and Fig. 7.6 at 13.5 V.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

from .actuators import NO_LOAD_FRICTION, REDUCED_SUPPLY, SUPPLY

FULL, REDUCED = SUPPLY, REDUCED_SUPPLY  # V
UNITS: Mapping[str, str] = MappingProxyType(
    {"opening time": "s", "dead time": "s", "moving time": "s", "peak current": "A", "holding current": "A"}
)


class Datum(NamedTuple):
    """A measured value, its assumed standard deviation, and its source in the thesis."""

    value: float
    sigma: float
    source: str


# By actuator and supply voltage. Currents are motor currents.
MEASURED: Mapping[str, Mapping[float, Mapping[str, Datum]]] = MappingProxyType(
    {
        "ema_fise": {
            FULL: {
                "opening time": Datum(0.148, 2e-3, "Fig. 7.4"),
                "peak current": Datum(200.0, 20.0, "Fig. 7.4, about"),
                "holding current": Datum(35.0, 1.0, "Fig. 7.4"),
            },
        },
        "ema_maxon": {
            FULL: {
                "opening time": Datum(0.070, 2e-3, "Fig. 7.6, captions swapped"),
                "peak current": Datum(100.0, 10.0, "Fig. 7.6, about"),
                "holding current": Datum(23.0, 1.5, "Figs. 7.5 and 7.6, 20 to 25"),
            },
            REDUCED: {
                "opening time": Datum(0.105, 2e-3, "Fig. 7.5, captions swapped"),
                "peak current": Datum(60.0, 6.0, "Fig. 7.5, about"),
            },
        },
        "ehs_maxon": {
            FULL: {
                "moving time": Datum(0.100, 3e-3, "Fig. 7.10"),
                "peak current": Datum(41.0, 2.0, "Fig. 7.10, a little over 40"),
                "holding current": Datum(19.0, 1.0, "Fig. 7.10: 18 in its caption, about 20 in the text"),
            },
        },
    }
)
DEAD_TIME: Mapping[str, Datum] = MappingProxyType(
    {
        "opening time": Datum(0.130, 2e-3, "Fig. 7.10, 30 ms of it at rest"),
        "dead time": Datum(0.030, 2e-3, "Fig. 7.10"),
        "peak current": MEASURED["ehs_maxon"][FULL]["peak current"],
    }
)
MULTIMETER = Datum(0.2, 0.02, "chapter 8")  # ohm, winding and leads of the FISE
NO_LOAD_TEST = Datum(NO_LOAD_FRICTION, 8e-5, "chapter 8")  # N.m.s/rad, the EHS pumping from tank to tank


def measured(actuator: str, quantity: str) -> float | None:
    """A value measured at full voltage, in SI units, or None. Opening times include dead times."""
    found = {**MEASURED.get(actuator, {}).get(FULL, {}), **(DEAD_TIME if actuator == "ehs_maxon" else {})}
    return found[quantity].value if quantity in found else None
