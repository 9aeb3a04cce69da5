"""What a study knows of an architecture beside its model."""

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any, TypeVar

from acausal import Component, Scalar

Flow = tuple[Scalar, Scalar]
M = TypeVar("M", bound=Component)


def as_built(model: M) -> M:
    """The start values stay those that were built in."""
    return model


def at_the_pump(s: Any) -> Flow:
    """Pressure and flow that a pump delivers from its tank."""
    return s.pump.b.p, -s.pump.b.q


def at_the_slave(s: Any) -> Flow:
    """Pressure and flow that open the clutch."""
    return s.slave.port.p, s.slave.port.q


def at_the_master(s: Any) -> Flow:
    """Pressure and flow of the master cylinder."""
    return s.master.port.p, -s.master.port.q


def at_the_accumulator(s: Any) -> Flow:
    """Pressure and flow that an accumulator gives to the valves behind it."""
    return s.inlet.a.p, s.inlet.q


@dataclasses.dataclass(frozen=True)
class Architecture:
    """A kind of actuator: how to build it, its main sizes, and what its parts weigh where that is published."""

    name: str
    title: str
    build: Callable[[], Any]
    sizes: tuple[str, ...]  # by path
    masses: Mapping[str, float]  # kg
    weightless: str  # parts without a published mass
    _: dataclasses.KW_ONLY
    start: Callable[[Any], Any] = as_built  # what a model with other sizes starts from
    delivered: Callable[[Any], Flow] = at_the_pump  # what its source of flow gives
    taken: Callable[[Any], Flow] = at_the_slave  # what the clutch takes of it
