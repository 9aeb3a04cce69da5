"""The set of parameters that all studies share."""

import inspect

import pytest
from _designs import DESIGNS

from studies.actuators import Parameter, motor_held, parameter_set
from studies.validate import hold


def _set() -> dict[str, Parameter]:
    return {parameter.keyword: parameter for parameter in parameter_set(DESIGNS)}


@pytest.mark.parametrize("design", DESIGNS)
def test_every_keyword_has_a_source(design: str) -> None:
    """Except the inductance, which the set does not contain."""
    listed = {keyword for keyword, parameter in _set().items() if design in parameter.values}
    assert listed == set(inspect.signature(DESIGNS[design]).parameters) - {"inductance"}


def test_display_units() -> None:
    found = _set()
    for keyword, design, unit, value in (
        ("displacement", "ehs_maxon", "cm3/rev", 1.25),
        ("spring_rate", "ema_fise", "N/mm", 58.0),
        ("line_stiffness", "sila", "bar/cm3", 1494.08526513837),
        ("friction", "ema_maxon", "mN.m.s/rad", 4.0),
        ("rotor_inertia", "ehs_maxon", "g.cm2", 140.0),
        ("slave_bore", "ema_fise", "mm", 17.4625),
    ):
        assert found[keyword].unit == unit
        assert found[keyword].values[design] == pytest.approx(value, rel=1e-12)
    for parameter in found.values():
        assert parameter.source
        assert all(1e-3 <= value < 1e4 for value in parameter.values.values()), parameter


@pytest.mark.parametrize("design", ["ema_fise", "ema_maxon", "ehs_maxon"])
def test_holding_power_is_that_of_the_winding(design: str) -> None:
    """The motor at rest takes R i^2, which a lossless converter draws from the battery at a different current."""
    model = DESIGNS[design]()
    rest = hold(model)
    assert rest.power == pytest.approx(float(model.motor.resistor.R * rest.current**2), rel=1e-12)
    assert rest.battery_current(12.0) == pytest.approx(float(rest.power) / 12.0, rel=1e-12)
    assert rest.battery_current() < rest.current


def test_the_worm_holds_without_current() -> None:
    rest = hold(DESIGNS["sila"]())
    assert rest.current == 0.0
    assert rest.power == 0.0
    assert rest.torque > 0.05


def test_no_load_set_of_the_held_actuator() -> None:
    """Friction does not change the static holding current."""
    assert hold(motor_held(friction=8e-4)).current == pytest.approx(float(hold(motor_held()).current), rel=1e-12)
