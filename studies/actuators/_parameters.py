"""The set of parameters that all studies share, with the source of each value in Meloni's thesis (Torino, 2012).

The values are the defaults of `ema_fise`, `ema_maxon`, `ehs_maxon` and `sila`; `parameter_set` lists them with
their sources.
"""

import dataclasses
import inspect
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

from acausal import magnitude, quantity

SUPPLY = 13.5  # V, full voltage
REDUCED_SUPPLY = 9.45  # V, 70 % of it
PRESENT_RATIO = 38.0  # motor turns per turn of the cam of the present actuator, (A.2)
LARGEST_TORQUE = 12.0 / PRESENT_RATIO  # N.m, of the FISE motor: 12 N.m behind its worm, Table 6.2

# N.m.s/rad, friction of the EHS when its motor turns the pump from tank to tank, chapter 8. In place of the 4e-3 of
# Table 8.3, it gives the no-load set of the EHS, the second column of tables with both sets.
NO_LOAD_FRICTION = 8e-4


@dataclasses.dataclass(frozen=True)
class Parameter:
    """A parameter of the set: its values in `unit` by the name of the design, and their source."""

    keyword: str
    name: str
    unit: str
    values: Mapping[str, float]
    source: str


# Description, unit, and source of the values, by keyword.
SOURCES: Mapping[str, tuple[str, str, str]] = MappingProxyType(
    {
        "voltage": (
            "supply", "V",
            "Fig. 7.4, and Fig. 7.6 with the voltage of the caption of Fig. 7.5: the two captions are swapped in print",
        ),
        "resistance": (
            "resistance of winding and leads", "ohm",
            "Tables 8.1 to 8.3; the data sheets have 0.103 ohm (RE50) and 0.317 ohm (RE40), a multimeter shows 0.2 ohm "
            "(FISE)",
        ),
        "torque_constant": (
            "torque constant", "mN.m/A",
            "no-load speed: 500 rpm behind 38:1 (Table 6.2) at 12 to 13.5 V gives 6.0 to 6.8, 6.4 chosen; "
            "5950 rpm (concluding table) and 7580 rpm (Table 6.4) at 24 V",
        ),
        "friction": (
            "friction of the whole drive", "mN.m.s/rad",
            "Tables 8.1 to 8.3, fitted to the opening; the no-load set of the EHS has 0.8, from the test without load "
            "in chapter 8",
        ),
        "rotor_inertia": ("moment of inertia of the rotor", "g.cm2", "concluding table"),
        "gearbox_inertia": (
            "moment of inertia of the gearbox", "g.cm2",
            "assumed; doubling it changes opening times by less than 0.4 %. Present actuator: remainder of the 5370 kg "
            "of Table 4.1 at the slave",
        ),
        "pump_inertia": (
            "moment of inertia of pump and coupling", "g.cm2",
            "assumed; doubling it changes the opening time by less than 0.1 %",
        ),
        "ratio": ("ratio of the gearbox", "1", "Figs. 6.6 (FISE) and 6.11 (RE50); (A.2) (present)"),
        "displacement": ("displacement of the pump", "cm3/rev", "Table 6.4"),
        "cam_inertia": ("moment of inertia of the cam", "g.cm2", "Table 6.1: 482 before, 349 after"),
        "eccentricity": ("eccentricity of the cam", "mm", "fitted to the 35 A of the held FISE, Fig. 7.4"),
        "cam_radius": ("radius of cam disc and roller", "mm", "assumed: a steel disc of that size has this inertia"),
        "lift_rate": ("lift of the cam", "mm/rad", "the 9330 rad/m of motor and slave in chapter 4"),
        "master_bore": ("bore of the master cylinder", "mm", "assumed: 3/4 in, a standard bore"),
        "slave_bore": (
            "bore of the slave cylinder", "mm",
            "11/16 in, the standard bore between 18.0 and 17.1 mm, which give holding currents of the EHS of 18 A "
            "(caption of Fig. 7.10) and 20 A (text of chapter 7)",
        ),
        "line_stiffness": ("stiffness of the liquid", "bar/cm3", "Table 4.1: 8.57e6 N/m at the slave"),
        "line_damping": ("damping of the liquid", "bar.s/cm3", "Tables 8.1 to 8.3"),
        "mass": ("mass that moves with the slave", "kg", "Table 4.1"),
        "piston_damping": ("friction of the slave's seal", "N.s/m", "Tables 8.1 to 8.3; Table 8.1 prints N/s"),
        "spring_rate": ("clutch spring", "N/mm", "spring of the test rig, 5.88 kgf/mm, chapter 7"),
    }
)  # fmt: skip


def parameter_set(designs: Mapping[str, Callable[..., Any]]) -> list[Parameter]:
    """The parameters of designs, which are functions with keywords in SI units; omits keywords without a value."""
    defaults = {name: inspect.signature(build).parameters for name, build in designs.items()}
    return [
        Parameter(
            keyword, spoken, unit,
            {
                name: defaults[name][keyword].default / magnitude(quantity(1.0, unit), "")
                for name in designs
                if keyword in defaults[name]
            },
            source,
        )
        for keyword, (spoken, unit, source) in SOURCES.items()
    ]  # fmt: skip
