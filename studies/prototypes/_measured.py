"""What was measured on the prototypes, as printed in Meloni's thesis (Politecnico di Torino, 2012), in SI units.

It states no uncertainties. Times are read from curves over 200 ms, a hundredth of the axis; a peak that is called
"about" is taken to be right within a tenth, and a holding current within the range that is given for it.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

from ..actuators import NO_LOAD_FRICTION, REDUCED_SUPPLY, SUPPLY

FULL, REDUCED = SUPPLY, REDUCED_SUPPLY  # V
UNITS: Mapping[str, str] = MappingProxyType(
    {"opening time": "s", "dead time": "s", "moving time": "s", "peak current": "A", "holding current": "A"}
)


class Datum(NamedTuple):
    """A measured number, and its assumed standard deviation."""

    value: float
    sigma: float


# By actuator and supply voltage.
MEASURED: Mapping[str, Mapping[float, Mapping[str, Datum]]] = MappingProxyType(
    {
        "ema_fise": {
            FULL: {
                "opening time": Datum(0.148, 2e-3),
                "peak current": Datum(200.0, 20.0),
                "holding current": Datum(35.0, 1.0),
            },
        },
        "ema_maxon": {
            FULL: {
                "opening time": Datum(0.070, 2e-3),
                "peak current": Datum(100.0, 10.0),
                "holding current": Datum(23.0, 1.5),
            },
            REDUCED: {"opening time": Datum(0.105, 2e-3), "peak current": Datum(60.0, 6.0)},
        },
        "ehs_maxon": {
            FULL: {
                "moving time": Datum(0.100, 3e-3),
                "peak current": Datum(41.0, 2.0),
                "holding current": Datum(19.0, 1.0),
            },
        },
    }
)
DEAD_TIME: Mapping[str, Datum] = MappingProxyType(
    {"opening time": Datum(0.130, 2e-3), "dead time": Datum(0.030, 2e-3), "peak current": Datum(41.0, 2.0)}
)
MULTIMETER = Datum(0.2, 0.02)  # ohm, winding and leads of the FISE
NO_LOAD_TEST = Datum(NO_LOAD_FRICTION, 8e-5)  # N.m.s/rad, friction of the EHS pumping from tank to tank
