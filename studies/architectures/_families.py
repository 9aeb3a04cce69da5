"""The list of architectures."""

from collections.abc import Mapping
from types import MappingProxyType

from ._architecture import Architecture, at_the_accumulator, at_the_master
from ._electromechanical import ball_screw, crank, eccentric, screw, worm
from ._hydrostatic import across_the_piston, across_the_pump, servo_motor, servo_pump, variable_purge
from ._stored import automated_gearbox, charged, holding_valve, purge_valve
from ._valve_controlled import bleed_off, constant_pressure, load_sensing, power_matched, pressure_compensated

# Masses in kg, from the thesis (tables 6.2 to 6.4, conclusions).
_PUMP: Mapping[str, float] = MappingProxyType({"motor RE40": 0.48, "pump": 0.9})
_RELIEVED: Mapping[str, float] = MappingProxyType({**_PUMP, "relief valve": 0.05})
_VARIABLE: Mapping[str, float] = MappingProxyType({"motor RE40": 0.48, "relief valve": 0.05})
_HELD: Mapping[str, float] = MappingProxyType({**_PUMP, "holding valve with coil": 0.29})
_GEARED: Mapping[str, float] = MappingProxyType({"motor RE50": 1.1, "gearbox GP52": 0.46})
_OF_METERING = ("pump.displacement", "valve.rated_flow", "motor.resistor.R")
_OF_PUMPS = ("pump.displacement", "slave.bore", "motor.resistor.R")

ARCHITECTURES = (
    Architecture(
        "constant pressure", "(1) fixed pump, constant pressure", constant_pressure,
        (*_OF_METERING, "slave.bore"), _RELIEVED, "proportional valve, block, cylinder",
    ),
    Architecture(
        "load sensing", "(2) fixed pump, load sensing", load_sensing,
        (*_OF_METERING, "compensator.margin"), _RELIEVED, "proportional valve, compensator, block, cylinder",
    ),
    Architecture(
        "pressure compensated", "(3) variable pump, pressure compensated", pressure_compensated,
        (*_OF_METERING, "slave.bore"), _VARIABLE, "variable pump, proportional valve, block, cylinder",
    ),
    Architecture(
        "power matched", "(4) variable pump, power matched", power_matched,
        (*_OF_METERING, "pump.margin"), _VARIABLE, "variable pump, proportional valve, block, cylinder",
    ),
    Architecture(
        "bleed-off", "(5) fixed pump, bleed-off", bleed_off, _OF_PUMPS, _PUMP, "proportional valve, block, cylinder",
    ),
    Architecture(
        "EHA, servo motor", "EHA, servo motor and fixed pump", servo_motor, _OF_PUMPS, _PUMP,
        "accumulator, check and relief valves, cylinder",
        delivered=across_the_pump, taken=across_the_piston,
    ),
    Architecture(
        "EHA, servo pump", "EHA, servo pump", servo_pump,
        ("pump.pump.displacement", "slave.bore", "pump.swash.rate", "motor.resistor.R"), {"motor RE40": 0.48},
        "variable pump, accumulator, check and relief valves, cylinder",
        delivered=across_the_pump, taken=across_the_piston,
    ),
    Architecture(
        "holding valve", "prototype, normally open holding valve", holding_valve,
        (*_OF_PUMPS, "valve.area"), _HELD, "block, cylinder",
    ),
    Architecture(
        "purge valve", "pump, check valve and purge valve", purge_valve, _OF_PUMPS, _PUMP,
        "check and purge valve, block, cylinder",
    ),
    Architecture(
        "purge, variable pump", "variable pump and purge valve", variable_purge,
        ("pump.pump.displacement", "slave.bore", "pump.swash.rate", "motor.resistor.R"), {"motor RE40": 0.48},
        "variable pump, purge valve, block, cylinder",
    ),
    Architecture(
        "automated gearbox", "accumulator, three-way and on/off valves", automated_gearbox,
        ("valve.rated_flow", "inlet.area", "slave.bore", "accumulator.volume"), _PUMP,
        "accumulator, all valves, block, cylinder", start=charged,
        delivered=at_the_accumulator,
    ),
    Architecture(
        "eccentric", "electromechanical, eccentric", eccentric,
        ("gearbox.ratio", "cam.profile.eccentricity", "master.bore", "motor.resistor.R"), _GEARED, "cam, cylinders",
        delivered=at_the_master,
    ),
    Architecture(
        "crank", "electromechanical, crank", crank,
        ("gearbox.ratio", "crank.crank", "master.bore", "motor.resistor.R"), _GEARED, "crank, cylinders",
        delivered=at_the_master,
    ),
    Architecture(
        "ball screw", "electromechanical, ball screw", ball_screw,
        ("gearbox.ratio", "screw.converter.ratio", "master.bore", "motor.resistor.R"), _GEARED, "screw, cylinders",
        delivered=at_the_master,
    ),
    Architecture(
        "worm", "electromechanical, worm (present)", worm,
        ("cam.profile.rate", "master.bore", "motor.resistor.R"), {"motor FISE with worm gear": 1.2},
        "cam, cylinders", delivered=at_the_master,
    ),
    Architecture(
        "screw", "electromechanical, screw", screw,
        ("screw.converter.ratio", "master.bore", "motor.resistor.R"), {"motor RE50": 1.1}, "screw, cylinders",
        delivered=at_the_master,
    ),
)  # fmt: skip
