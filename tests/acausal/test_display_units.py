"""Display units: their values are those in SI units, converted exactly."""

import math

import pytest

from acausal import display_unit, displayed, magnitude, quantity
from acausal._units.display import DISPLAY
from acausal._units.parsing import parsed


@pytest.mark.parametrize(("unit", "value", "shown"), [
    ("m3/rad", 1.25e-6 / (2.0 * math.pi), (1.25, "cm3/rev")), ("m", 12e-3, (12.0, "mm")), ("s", 0.13, (130.0, "ms")),
    ("Pa", 29e5, (29.0, "bar")), ("N/m", 58e3, (58.0, "N/mm")), ("m3/s", 2e-5, (20.0, "cm3/s")),
    ("kg/Pa", -2e-7, (-20.0, "g/bar")), ("m/rad", 5e-3 / (2.0 * math.pi), (5.0, "mm/rev")), ("A", 41.0, (41.0, "A")),
    ("rad/s", 100.0 * math.pi, (3000.0, "rpm")), ("1/min", 9.7, (9.7, "1/min")), ("1", 8.5, (8.5, "1")),
])  # fmt: skip
def test_displayed(unit: str, value: float, shown: tuple[float, str]) -> None:
    found, name = displayed(value, unit)
    assert name == shown[1] == display_unit(unit)
    assert found == pytest.approx(shown[0], rel=1e-12)


@pytest.mark.parametrize("unit", DISPLAY)
def test_no_digit_is_lost(unit: str) -> None:
    """Both units are of one dimension, and the way back gives the value again."""
    assert parsed(unit).is_si
    value, shown = displayed(1.23456789012345e-3, unit)
    assert magnitude(quantity(value, shown), unit) == pytest.approx(1.23456789012345e-3, rel=1e-14)


@pytest.mark.thorough
def test_a_unit_of_one_dimension_may_be_of_another_quantity() -> None:
    """Wb is the unit of a flux, N.m/A that of a motor constant."""
    assert parsed("Wb").dimension == parsed("N.m/A").dimension
    assert (display_unit("Wb"), display_unit("N.m/A")) == ("Wb", "mN.m/A")
