"""Proposed measurements: predictions of all explanations that fit, and the distances between them.

A prediction has two uncertainties: the noise of the measurement, and that of the fitted parameters.
"""

import dataclasses
import itertools
import math
from collections.abc import Callable, Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from acausal import Scalar, replace
from acausal.design import Fit

from .._measured import FULL
from ..actuators import ClutchActuator, StickingActuator, opening
from ._cases import held
from ._dead_time import at_voltage, record, times

LOW = 8.0  # V, at which the RE50 still opens the clutch
BATTERY = 12.0  # V, with the engine off
THOUSAND_RPM = 1000.0 * 2.0 * math.pi / 60.0  # rad/s
GRID = 1e-3 * np.arange(1, 131)  # s, sample times of the records
EARLY = 4  # index of 5 ms in GRID
CURRENT, STROKE = "record of the current", "record of the stroke"
NOISES: Mapping[str, Mapping[str, tuple[str, float]]] = {  # unit and standard deviation, by subject and measurement
    "RE50": {
        "generator voltage of the motor at 1000 rpm": ("V", 0.02),
        "no-load current of motor and gear at 13.5 V": ("A", 0.3),
        "breakaway current of motor and gear": ("A", 0.3),
        "holding current when closing": ("A", 0.5),
        "opening time at 8 V": ("s", 1e-3),
    },
    "dead time": {
        "current 5 ms after switch-on": ("A", 0.5),  # by a clamp
        "dead time at 12 V": ("s", 1e-3),
        "opening time at 12 V": ("s", 1e-3),
        CURRENT: ("A", 0.5),
        STROKE: ("m", 0.1e-3),  # by a potentiometer
    },
}


@dataclasses.dataclass(frozen=True)
class Proposal:
    """The prediction of a measurement by an explanation; not finite if the clutch does not open.

    `spread` is the standard deviation due to the parameters. It is not finite if the clutch opens for some of their
    values only.
    """

    subject: str
    measurement: str
    unit: str
    noise: float
    explanation: str
    predicted: float
    spread: float


@dataclasses.dataclass(frozen=True)
class Separation:
    """The distance between two explanations in a measurement, in standard deviations of noise and parameters."""

    subject: str
    measurement: str
    explanations: str
    distance: float


class Prediction(NamedTuple):
    """Predicted values, and their change for one standard deviation in each principal direction of the parameters."""

    values: Float[np.ndarray, " n"]
    moved: Float[np.ndarray, "directions n"]


Predictions = Mapping[str, Mapping[str, Prediction]]  # by explanation and measurement


def predictions(
    fits: Mapping[str, Fit[ClutchActuator]], functions: Mapping[str, Callable[[Any], Mapping[str, Scalar]]]
) -> Predictions:
    """Predictions of functions of the fitted models, by the names of the explanations."""
    return {name: _predicted(fit, functions[name]) for name, fit in fits.items()}


def _predicted(fit: Fit[ClutchActuator], function: Callable[[Any], Mapping[str, Scalar]]) -> dict[str, Prediction]:
    """Central differences over one standard deviation in each direction of the covariance factor."""

    def at(step: np.ndarray) -> Mapping[str, Scalar]:
        places = zip(fit.names, np.asarray(fit.estimates) + step, strict=True)
        return function(replace(fit.model, {path: value for name, value in places for path in name.split(", ")}))

    directions = np.linalg.cholesky(fit.covariance).T
    ends = [(at(step), at(-step)) for step in directions]
    return {
        name: Prediction(
            np.atleast_1d(np.asarray(value, float)),
            np.stack([_half(np.atleast_1d(more[name]), np.atleast_1d(less[name])) for more, less in ends]),
        )
        for name, value in function(fit.model).items()
    }


def _half(more: np.ndarray, less: np.ndarray) -> np.ndarray:
    """Half the difference; zero if neither value is finite, infinite if one is not."""
    with np.errstate(invalid="ignore"):
        found = 0.5 * (np.asarray(more, float) - np.asarray(less, float))
    return np.where(np.isnan(found), 0.0, found)


def of_re50(model: Any) -> dict[str, Scalar]:
    """Proposed measurements on the RE50 actuator."""
    motor = model.motor
    dry = 0.0 if model.friction is None else model.friction.Tc
    stall = FULL * motor.emf.k / motor.resistor.R
    speed = (stall - dry) / (motor.emf.k**2 / motor.resistor.R + motor.bearing.C)
    slow = opening(replace(model, {"supply.V": LOW}), t_max=3.0, save="end", rtol=1e-7)
    values = (
        motor.emf.k * THOUSAND_RPM, (dry + motor.bearing.C * speed) / motor.emf.k, dry / motor.emf.k,
        held(model, direction=-1.0), slow.t1,
    )  # fmt: skip
    return dict(zip(NOISES["RE50"], values, strict=True))


def of_dead_time(name: str, model: StickingActuator) -> dict[str, Scalar]:
    """Proposed measurements on the electrohydraulic actuator, predicted by an explanation of its dead time."""
    other, run = times(at_voltage(name, model, BATTERY)), record(model, GRID)
    current = run.motor.p.i
    values = (current[EARLY], other["dead time"], other["opening time"], current, run.slave.rod.s)
    return dict(zip(NOISES["dead time"], values, strict=True))


def proposals(subject: str, found: Predictions) -> Iterator[Proposal]:
    """The proposals of scalar measurements."""
    for name, measurements in found.items():
        for measurement, (values, moved) in measurements.items():
            if len(values) == 1:
                unit, noise = NOISES[subject][measurement]
                spread = float(np.linalg.norm(moved))
                yield Proposal(subject, measurement, unit, noise, name, float(values[0]), spread)


def separations(subject: str, found: Predictions) -> Iterator[Separation]:
    """The distances of each pair of explanations in each measurement."""
    for measurement, (_, noise) in NOISES[subject].items():
        for a, b in itertools.combinations(found, 2):
            distance = _distance(found[a][measurement], found[b][measurement], noise)
            yield Separation(subject, measurement, f"{a} / {b}", distance)


def _distance(a: Prediction, b: Prediction, noise: float) -> float:
    """The Mahalanobis distance of two predictions, in the metric of their uncertainties."""
    moved = np.concatenate([a.moved, b.moved])
    with np.errstate(invalid="ignore"):
        apart = a.values - b.values
    # The distance is zero if both values are infinite, or if the parameters decide whether one is finite.
    if np.any(np.isnan(apart)) or not np.all(np.isfinite(moved)):
        return 0.0
    if not np.all(np.isfinite(apart)):
        return math.inf
    covariance = noise**2 * np.eye(len(apart)) + moved.T @ moved
    return float(np.sqrt(apart @ np.linalg.solve(covariance, apart)))
