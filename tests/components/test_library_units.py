"""The units of every component of the library."""

from typing import Any

import pytest
from _library import LIBRARY
from _rig import Rig

from acausal import Component, Connections, connect
from acausal._reduce.flatten import flatten
from acausal._unit_check.model_units import unchecked_equations, unit_problems
from acausal._units.parsing import is_coherent
from acausal.testing import check_units
from components import blocks, rotational


@pytest.mark.parametrize("component", LIBRARY, ids=lambda component: type(component).__name__)
def test_every_component(component: Component) -> None:
    check_units(component)


def test_the_library_is_covered() -> None:
    assert len({type(component) for component in LIBRARY}) > 100
    flats = {type(part).__name__: flatten(part) for part in LIBRARY}
    unchecked = {name for name, flat in flats.items() if unchecked_equations(flat)}
    # The path parameter of what switches is a force or a motion, by its mode.
    assert {name for name in unchecked if not flats[name].discrete_leaves} == {"Function", "TimeFunction"}


def test_no_unit_of_the_library_needs_pint() -> None:
    """Importing pint would take as long as many runs."""
    flats = map(flatten, LIBRARY)
    units = {leaf.declaration.unit for flat in flats for leaf in flat.leaves if leaf.declaration.unit}
    assert len(units) > 50
    assert {unit for unit in units if not is_coherent(unit)} == set()


# Those of hydraulics carry shares of a stroke.
# Not here: outputs that are 0, 1 or a time, and a block with a second input.
OTHERS = (blocks.Hysteresis, blocks.Not, blocks.Timer, blocks.TransportDelay)
SISO = [
    block
    for block in LIBRARY
    if isinstance(block, blocks.SISO) and "blocks" in type(block).__module__ and not isinstance(block, OTHERS)
]
# What gives back its input, or a part of it; the others have gains, which may carry a unit.
ALIKE = ("Limiter", "DeadZone", "Notch", "Play", "SlewRateLimiter")


def wire(sensor: Any, block: Any, drive: Any) -> Connections:
    return (
        connect(sensor.flange, drive.flange),
        connect(sensor.y, block.u),
        connect(block.y, drive.u),
    )


@pytest.mark.parametrize("block", SISO, ids=lambda block: type(block).__name__)
def test_blocks_carry_any_quantity(block: Component) -> None:
    """Between a speed and a torque, only blocks with equal units of input and output have a unit error."""
    speed, drive = rotational.SpeedSensor(), rotational.SignalTorque()
    problems = unit_problems(flatten(Rig(parts=(speed, block, drive), wiring=wire)))
    assert len(problems) == (type(block).__name__ in ALIKE)
