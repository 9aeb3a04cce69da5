"""What would have to be measured: predictions of all explanations that fit, beside the noise of a measurement."""

import dataclasses
import itertools
import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from acausal import replace

from .._opening import opening
from ..actuators import ElectromechanicalActuator, StickingActuator
from ._cases import held
from ._dead_time import at_voltage, times
from ._measured import FULL

LOW = 8.0  # V, at which the RE50 still opens the clutch
BATTERY = 12.0  # V, of a car that does not run
THOUSAND_RPM = 1000.0 * 2.0 * math.pi / 60.0  # rad/s
GRID = 1e-3 * np.arange(1, 131)  # s, of the records
EARLY = 14  # place in it of 15 ms
NOISE_CURRENT, NOISE_STROKE = 0.5, 0.1e-3  # A, m, of a clamp and of a potentiometer


@dataclasses.dataclass(frozen=True)
class Proposal:
    """What an explanation says of a measurement that was not made; not finite where it does not come to an end."""

    subject: str
    measurement: str
    unit: str
    noise: float
    explanation: str
    predicted: float


@dataclasses.dataclass(frozen=True)
class Separation:
    """How far apart two explanations are in a measurement, in standard deviations of its noise."""

    subject: str
    measurement: str
    explanations: str
    distance: float


def re50(models: Mapping[str, ElectromechanicalActuator]) -> Iterator[Proposal]:
    """For explanations of the measurements on the RE50 actuator."""
    for name, model in models.items():
        motor = model.motor
        assert motor.bearing is not None
        dry = 0.0 if model.friction is None else model.friction.Tc
        stall = FULL * motor.emf.k / motor.resistor.R
        speed = (stall - dry) / (motor.emf.k**2 / motor.resistor.R + motor.bearing.C)
        idle = (dry + motor.bearing.C * speed) / motor.emf.k
        slow = opening(replace(model, {"supply.V": LOW}), t_max=3.0, save="end", rtol=1e-7)
        back = held(model, direction=-1.0)
        for measurement, unit, noise, value in (
            ("voltage of the motor turned at 1000 rpm", "V", 0.02, motor.emf.k * THOUSAND_RPM),
            ("current of the motor and gear without cam at 13.5 V", "A", 0.3, idle),
            ("holding current as the clutch is let back", "A", 0.5, back),
            ("opening time at 8 V", "s", 1e-3, slow.t1),
        ):
            yield Proposal("RE50", measurement, unit, noise, name, float(value))


def dead_time(models: Mapping[str, StickingActuator], records: Mapping[str, Any]) -> Iterator[Proposal]:
    """For explanations of the dead time, in single numbers; `records` are of `GRID`."""
    for name, model in models.items():
        other = times(at_voltage(name, model, BATTERY))
        early = records[name].motor.p.i[EARLY]
        for measurement, unit, noise, value in (
            ("current 15 ms after the voltage was switched on", "A", NOISE_CURRENT, early),
            (f"dead time at {BATTERY:g} V", "s", 1e-3, other["dead time"]),
            (f"opening time at {BATTERY:g} V", "s", 1e-3, other["opening time"]),
        ):
            yield Proposal("dead time", measurement, unit, noise, name, float(value))


def separations(proposals: list[Proposal]) -> Iterator[Separation]:
    """Of each pair of explanations in each measurement of one number."""
    for subject, measurement in dict.fromkeys((item.subject, item.measurement) for item in proposals):
        chosen = [item for item in proposals if (item.subject, item.measurement) == (subject, measurement)]
        for a, b in itertools.combinations(chosen, 2):
            distance = abs(a.predicted - b.predicted) / a.noise
            # Two that both never come to an end are not told apart.
            yield Separation(
                subject, measurement, _pair(a.explanation, b.explanation), 0.0 if math.isnan(distance) else distance
            )


def of_records(records: Mapping[str, Any]) -> Iterator[Separation]:
    """Of each pair of explanations of the dead time in a record of `GRID`: the root of the sum of squares."""
    for signal, what, noise in (
        ("motor.p.i", "record of the current", NOISE_CURRENT),
        ("slave.rod.s", "record of the stroke", NOISE_STROKE),
    ):
        for a, b in itertools.combinations(records, 2):
            difference = np.asarray(records[a][signal]) - np.asarray(records[b][signal])
            distance = float(np.linalg.norm(difference / noise))
            yield Separation("dead time", what, _pair(a, b), distance)


def _pair(a: str, b: str) -> str:
    return f"{a} / {b}"
