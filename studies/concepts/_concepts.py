"""The two concepts with all manually chosen sizes free, and their motors.

Motors of the prototypes have the resistance that the thesis identified; others have that of the data sheet with leads.
The identified friction covers all parts that turn with the motor, and is the same for other motors.
"""

import dataclasses
import functools as ft
from collections.abc import Mapping
from typing import Any

from acausal import replace
from acausal.design import Design, Front, optimise, pareto
from components.catalogues import catalogue

from ..actuators import STROKE, SUPPLY, WORN_LOAD, ClutchActuator, ehs_maxon, ema_fise, ema_maxon
from ..catalogue import LEADS
from . import _targets as targets
from ._targets import (
    BY_MOTOR,
    CAM,
    COIL_POWER,
    HOLD,
    HOLDING_ENERGY,
    OPENING_TIME,
    POWER,
    PUMP,
    TARGET,
    VALVE_MASS,
    opening,
)


@dataclasses.dataclass(frozen=True, eq=False)
class Motor:
    """A motor on the market."""

    name: str
    power: float  # W, rated
    mass: float | None  # kg, None if not stated
    gearhead: float  # kg, mass of a matching gearhead
    values: Mapping[str, float]  # of the model, by path


def _listed(order: str, gearhead: float) -> Motor:
    """A motor of the catalogue that the thesis did not use; the rated power is that of the nominal operating point."""
    sheet = catalogue("motors")[order]
    values = {
        "motor.resistor.R": sheet["resistance"] + LEADS, "motor.emf.k": sheet["torque_constant"],
        "motor.rotor.J": sheet["inertia"],
    }  # fmt: skip
    power = sheet["nominal_torque"] * sheet["nominal_speed"]
    return Motor(sheet.family, power, sheet.get("mass"), gearhead, values)


def _built(name: str, model: ClutchActuator, power: float, mass: float, gearhead: float) -> Motor:
    """A motor of a prototype, with power and mass from the thesis."""
    motor: Any = model.motor
    values = {
        "motor.resistor.R": float(motor.resistor.R), "motor.emf.k": float(motor.emf.k),
        "motor.rotor.J": float(motor.rotor.J), "motor.bearing.C": float(motor.bearing.C),
    }  # fmt: skip
    return Motor(name, power, mass, gearhead, values)


MOTORS = (
    _built("FISE", ema_fise(), 400.0, 1.2, 0.26),
    _built("RE 50", ema_maxon(), 200.0, 1.1, 0.46),
    _built("RE 40", ehs_maxon(), 150.0, 0.48, 0.26),
    _listed("RE 35 30 V", 0.26),
    _listed("268214", 0.16),
    _listed("118752", 0.1),
)
ALLOWED = tuple(motor for motor in MOTORS if motor.power < POWER)


@dataclasses.dataclass(frozen=True, eq=False)
class Concept:
    """A kind of actuator to optimise."""

    name: str
    model: ClutchActuator
    free: Mapping[Any, Any]
    limits: Mapping[str, Any]
    pump_mass: float | None  # kg, None with a gearhead
    rest: float  # kg, total mass in the thesis without motor and transmission
    valve: bool = False  # whether a valve holds

    def of(self, motor: Motor) -> ClutchActuator:
        """The actuator before the optimisation, with a motor and the load of a worn clutch."""
        values = {path: value for path, value in motor.values.items() if path != "motor.bearing.C"}
        friction = motor.values.get("motor.bearing.C", float(self.model.motor.bearing.C))  # pyright: ignore
        return replace(self.model, {**values, "motor.bearing.C": friction, "clutch.rate": WORN_LOAD / STROKE})

    def mass(self, motor: Motor) -> float | None:
        """The total mass in kg, or None."""
        if motor.mass is None:
            return None
        transmission = motor.gearhead if self.pump_mass is None else self.pump_mass
        return motor.mass + transmission + self.rest + (VALVE_MASS if self.valve else 0.0)

    def holding_energy(self, model: Any) -> float:
        """The energy of a hold in J."""
        return HOLD * COIL_POWER if self.valve else float(targets.holding_energy(model))

    def solve(self, motor: Motor) -> Design[Any]:
        """The design of minimum opening time; cached."""
        return _fastest(self, motor)

    def least_energy(self, motor: Motor, time: float) -> Design[Any]:
        """The design of minimum holding energy by the motor that opens within `time` in s."""
        limits = {**self.limits, "opening time": (lambda s: s.t1, f"<= {time} s")}
        return optimise(
            self.of(motor), self.free, HOLDING_ENERGY, run=opening, constraints=limits, progress=False,
            sensitivities=False,
        )  # fmt: skip

    def front(self, motor: Motor, points: int) -> Front[Any]:
        """The Pareto front of opening time, within the target, and holding energy."""
        return pareto(
            self.of(motor), self.free, OPENING_TIME | HOLDING_ENERGY, points=points, run=opening,
            constraints={**self.limits, **TARGET}, progress=False,
        )  # fmt: skip


@ft.cache
def _fastest(concept: Concept, motor: Motor) -> Design[Any]:
    return optimise(
        concept.of(motor), concept.free, OPENING_TIME, run=opening, constraints=concept.limits, progress=False,
        sensitivities=False,
    )  # fmt: skip


_SUPPLY = {"supply.V": (6.0, SUPPLY)}
_SLAVE = {"slave.bore": ("14 mm", "22 mm")}
_EMA_FREE = {
    "gearbox.ratio": (1.5, 40.0), "cam.profile.eccentricity": ("3 mm", "12 mm"),
    "cam.profile.radius": ("15 mm", "25 mm"), "master.bore": ("12 mm", "24 mm"), **_SLAVE, **_SUPPLY,
}  # fmt: skip
_EHS_FREE = {"pump.displacement": ("0.25 cm3/rev", "6.25 cm3/rev"), **_SLAVE, **_SUPPLY}

# Total masses of the prototypes are 2.5 kg (RE50) and 1.8 kg (RE40, including its holding valve).
EMA = Concept("EMA", ema_maxon(eccentricity=7e-3), _EMA_FREE, CAM | BY_MOTOR, None, 2.5 - 1.1 - 0.46)
EHS = Concept("EHS, motor holds", ehs_maxon(), _EHS_FREE, PUMP | BY_MOTOR, 0.9, 1.8 - 0.48 - 0.9 - VALVE_MASS)
EHS_VALVE = dataclasses.replace(EHS, name="EHS, valve holds", limits=PUMP, valve=True)
CONCEPTS = (EMA, EHS, EHS_VALVE)
