"""Which ratings a run exceeded."""

import dataclasses
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from acausal import ArgumentError, Array, Component, Solution

from ..electrical import BrushedMotor, DCMotor
from ..hydraulic import HoldingValve, Pump
from ..rotational import PlanetaryGearbox, PlanetaryTrain

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
    HoldingValve: {"nominal_current": lambda valve: valve.coil.i, "max_pressure": lambda valve: valve.poppet.dp},
    Pump: {"max_speed": lambda pump: pump.w, "max_pressure": lambda pump: pump.dp},
}


class Exceeded(NamedTuple):
    """A rating that a run exceeded."""

    path: str  # of the part
    order: str  # its order name
    rating: str
    limit: float
    largest: float  # size, in the run
    time: float  # of the largest one, in s
    first: float  # when it was exceeded first, in s
    share: float  # of the time of the run
    unit: str

    def __str__(self) -> str:
        return (
            f"{self.path} ({self.order}): {self.rating} {self.largest:.4g} {self.unit} at {self.time:.4g} s is above "
            f"{self.limit:.4g} {self.unit} by {self.largest / self.limit - 1.0:.0%}; first at {self.first:.4g} s, for "
            f"{self.share:.0%} of the time."
        )


class Limits(tuple[Exceeded, ...]):
    """What a run exceeded, one line for each rating when printed.

    `checked` are the ratings that the run was held against: path of the part, order name, rating.
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
        return "\n".join(["No rating is exceeded of those that were checked:", *lines])


def limits(solution: Solution[Any]) -> Limits:
    """The ratings of data sheets that a run exceeded: where, when, by how much, and for how long.

    For the parts that were made from a data sheet, at the saved times: save enough of them, with `save="steps"` or
    times. Ratings for continuous operation, of currents and torques, may be exceeded for a while; the largest one and
    the share of the time tell how far. `limits(solution).checked` tells what the run was held against: parts without a
    data sheet and ratings that a sheet does not state are not in it.

    Raises `ArgumentError` for a batch of solutions, and for a run that failed where a rated size is not a number.
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
                raise ArgumentError(f"{path}: the size that {rating} limits is not a number, since the run failed.")
            checked.append((path, sheet.order, rating))
            if np.max(size) > limit:
                found.append(_exceeded(path, sheet, rating, limit, times, size))
    return Limits(found, checked)


def _exceeded(path: str, sheet: Any, rating: str, limit: float, times: np.ndarray, size: np.ndarray) -> Exceeded:
    excess, worst = size - limit, int(np.argmax(size))
    # Sizes are straight between saved times, which tells when the limit is passed between two of them.
    above, apart = np.maximum(excess, 0.0), np.abs(excess[1:]) + np.abs(excess[:-1])
    spans, run = np.diff(times), max(float(times[-1] - times[0]), np.finfo(float).tiny)
    shares = (above[1:] + above[:-1]) / np.maximum(apart, np.finfo(float).tiny)
    share = float(np.sum(spans * shares)) / run
    first = float(times[int(np.argmax(excess > 0.0))])
    return Exceeded(
        path, sheet.order, rating, limit, float(size[worst]), float(times[worst]), first, share, sheet.unit(rating)
    )


def _rated(node: Any, path: str) -> Iterator[tuple[str, Any]]:
    """The parts with a data sheet, with their paths."""
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
