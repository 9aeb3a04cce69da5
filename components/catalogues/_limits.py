"""Check of a run against the ratings of its parts."""

import dataclasses
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from acausal import ArgumentError, Array, Component, Solution

from ..electrical import PMSM, BrushedMotor, DCMotor, Inverter, PMSMDrive
from ..hydraulic import HoldingValve, Pump
from ..rotational import PlanetaryGearbox, PlanetaryTrain


def _rms(machine: Any) -> Any:
    """Rms value of the phase currents, from peak values in rotor coordinates."""
    return np.hypot(np.asarray(machine.i_d), np.asarray(machine.i_q)) / np.sqrt(2.0)


_SERVO: Mapping[str, Callable[[Any], Any]] = {
    "continuous_current": _rms,
    "peak_current": _rms,
    "peak_torque": lambda motor: motor.torque,
    "max_speed": lambda motor: motor.w,
}

RATINGS: Mapping[type[Component], Mapping[str, Callable[[Any], Any]]] = {
    DCMotor: {"nominal_current": lambda motor: motor.resistor.i, "max_speed": lambda motor: motor.rotor.w},
    BrushedMotor: {
        "nominal_current": lambda motor: motor.resistor.i,
        "max_speed": lambda motor: motor.rotor.w,
        "max_winding_temperature": lambda motor: motor.winding.T,
    },
    PlanetaryGearbox: {
        "continuous_torque": lambda gear: gear.carrier.tau,
        "intermittent_torque": lambda gear: gear.carrier.tau,
        "max_input_speed": lambda gear: gear.w_sun,
    },
    PlanetaryTrain: {
        "continuous_torque": lambda train: train.b.tau,
        "intermittent_torque": lambda train: train.b.tau,
        "max_input_speed": lambda train: train.stages[0].w_sun,
    },
    PMSM: _SERVO,
    PMSMDrive: _SERVO,
    Inverter: dict.fromkeys(("rated_current", "overload_current", "peak_current"), lambda bridge: _rms(bridge.machine)),
    HoldingValve: {"nominal_current": lambda valve: valve.coil.i, "max_pressure": lambda valve: valve.poppet.dp},
    Pump: {"max_speed": lambda pump: pump.w, "max_pressure": lambda pump: pump.dp},
}


class Exceeded(NamedTuple):
    """A rating that a run exceeded."""

    path: str  # path of the part
    order: str  # order name of the part
    rating: str
    limit: float
    largest: float  # maximum absolute value in the run
    time: float  # time of the maximum, in s
    first: float  # time at which the rating was first exceeded, in s
    share: float  # fraction of the run during which it was exceeded
    unit: str

    def __str__(self) -> str:
        return (
            f"{self.path} ({self.order}): {self.rating} {self.largest:.4g} {self.unit} at {self.time:.4g} s is above "
            f"{self.limit:.4g} {self.unit} by {self.largest / self.limit - 1.0:.0%}; first at {self.first:.4g} s, for "
            f"{self.share:.0%} of the time."
        )


class Limits(tuple[Exceeded, ...]):
    """The ratings that a run exceeded, printed with one line for each.

    `checked` lists the ratings checked: path of the part, order name, rating.
    """

    checked: tuple[tuple[str, str, str], ...]

    def __new__(cls, exceeded: Iterable[Exceeded], checked: Iterable[tuple[str, str, str]]) -> "Limits":
        made = super().__new__(cls, exceeded)
        made.checked = tuple(checked)
        return made

    def __getnewargs__(self) -> tuple[Any, ...]:
        return tuple(self), self.checked

    def __str__(self) -> str:
        if self:
            return "\n".join(map(str, self))
        if not self.checked:
            return "No rating was checked: no part of the model has a data sheet that states one."
        parts = dict.fromkeys(f"{path} ({order})" for path, order, _ in self.checked)
        told = {part: [name for path, order, name in self.checked if part == f"{path} ({order})"] for part in parts}
        lines = [f"{part}: {', '.join(names)}" for part, names in told.items()]
        return "\n".join(["None of the ratings checked is exceeded:", *lines])


def limits(solution: Solution[Any]) -> Limits:
    """The data-sheet ratings that a run exceeded: where, when, by how much, and for how long.

    Checks the parts made from a data sheet at the saved times: save enough of them, with `save="steps"` or times.
    Currents and torques may exceed ratings for continuous operation temporarily; the maximum and the fraction of time
    show how far. `limits(solution).checked` lists the ratings checked; it excludes parts without a data sheet and
    ratings that a sheet does not state.

    Raises `ArgumentError` for a batch of solutions, and for a failed run in which a rated quantity is not a number.
    """
    if solution.is_batched:
        raise ArgumentError("limits takes a single solution, not a batch: use vmap's results one by one.")
    times, found, checked = np.asarray(solution.ts), [], []
    for path, part in _rated(solution.values, ""):
        sheet = part.data_sheet
        for rating, read in RATINGS[type(part)].items():
            limit = sheet.get(rating)
            if limit is None:
                continue
            size = np.abs(np.broadcast_to(np.asarray(read(part)), times.shape))
            if np.any(np.isnan(size)):
                raise ArgumentError(f"{path}: the quantity limited by {rating} is not a number: the run failed.")
            checked.append((path, sheet.order, rating))
            if np.max(size) > limit:
                found.append(_exceeded(path, sheet, rating, limit, times, size))
    return Limits(found, checked)


def _exceeded(path: str, sheet: Any, rating: str, limit: float, times: np.ndarray, size: np.ndarray) -> Exceeded:
    excess, worst = size - limit, int(np.argmax(size))
    # Linear interpolation between the saved times locates the crossings of the limit.
    above, apart = np.maximum(excess, 0.0), np.abs(excess[1:]) + np.abs(excess[:-1])
    spans, run = np.diff(times), max(float(times[-1] - times[0]), np.finfo(float).tiny)
    shares = (above[1:] + above[:-1]) / np.maximum(apart, np.finfo(float).tiny)
    share = float(np.sum(spans * shares)) / run
    first = float(times[int(np.argmax(excess > 0.0))])
    return Exceeded(
        path, sheet.order, rating, limit, float(size[worst]), float(times[worst]), first, share, sheet.unit(rating)
    )


def _rated(node: Any, path: str) -> Iterator[tuple[str, Any]]:
    """The parts with a data sheet and their paths."""
    if isinstance(node, tuple | Array):
        for i, part in enumerate(node):
            yield from _rated(part, f"{path}[{i}]")
        return
    if not isinstance(node, Component):
        return
    if type(node) in RATINGS and getattr(node, "data_sheet", None) is not None:
        yield path, node
    for field in dataclasses.fields(node):
        yield from _rated(getattr(node, field.name), f"{path}.{field.name}".lstrip("."))
