"""Description of an architecture: its model, main sizes and masses."""

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any, TypeVar

from acausal import Component, Scalar

Flow = tuple[Scalar, Scalar]
M = TypeVar("M", bound=Component)


def as_built(model: M) -> M:
    """Keeps the start values of the model."""
    return model


def at_the_pump(s: Any) -> Flow:
    """Delivery pressure and flow of a pump with a tank."""
    return s.pump.b.p, -s.pump.b.q


def at_the_slave(s: Any) -> Flow:
    """Pressure and flow that open the clutch."""
    return s.slave.port.p, s.slave.port.q


def at_the_master(s: Any) -> Flow:
    """Pressure and flow of the master cylinder."""
    return s.master.port.p, -s.master.port.q


def at_the_accumulator(s: Any) -> Flow:
    """Pressure and flow from an accumulator to its valves."""
    return s.inlet.a.p, s.inlet.q


@dataclasses.dataclass(frozen=True)
class Architecture:
    """A kind of actuator: its builder, main sizes, and published masses of its parts."""

    name: str
    title: str
    build: Callable[[], Any]
    sizes: tuple[str, ...]  # by path
    masses: Mapping[str, float]  # kg
    weightless: str  # parts without a published mass
    _: dataclasses.KW_ONLY
    start: Callable[[Any], Any] = as_built  # sets the start values of a model with other sizes
    delivered: Callable[[Any], Flow] = at_the_pump  # pressure and flow of its source
    taken: Callable[[Any], Flow] = at_the_slave  # pressure and flow of the clutch
