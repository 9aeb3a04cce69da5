"""All architectures that are compared."""

from collections.abc import Mapping
from types import MappingProxyType

from ._architecture import Architecture, at_the_master
from ._electromechanical import eccentric
from ._valve_controlled import constant_pressure

# In kg, as the thesis states them (tables 6.2 to 6.4, conclusions).
_PUMP: Mapping[str, float] = MappingProxyType({"motor RE40": 0.48, "pump": 0.9})
_RELIEVED: Mapping[str, float] = MappingProxyType({**_PUMP, "relief valve": 0.05})
_GEARED: Mapping[str, float] = MappingProxyType({"motor RE50": 1.1, "gearbox GP52": 0.46})
_OF_METERING = ("pump.displacement", "valve.rated_flow", "motor.resistor.R")

ARCHITECTURES = (
    Architecture(
        "constant pressure", "(1) fixed pump, constant pressure", constant_pressure,
        (*_OF_METERING, "slave.bore"), _RELIEVED, "proportional valve, block, cylinder",
    ),
    Architecture(
        "eccentric", "electromechanical, eccentric", eccentric,
        ("gearbox.ratio", "cam.profile.eccentricity", "master.bore", "motor.resistor.R"), _GEARED, "cam, cylinders",
        at_the_master,
    ),
)  # fmt: skip
