"""Windings and magnets at a temperature."""

import pytest

from studies.actuators._warm import COPPER, NEODYMIUM, SHEETS, T20, magnets, winding


def test_winding_and_magnets() -> None:
    assert winding(T20 + 100.0, T20) == pytest.approx(1.0 + 100.0 * COPPER, rel=1e-12)
    assert magnets(T20 + 100.0, T20) == pytest.approx(1.0 + 100.0 * NEODYMIUM, rel=1e-12)
    for law in (winding, magnets):
        assert law(SHEETS) == 1.0
        assert law(400.0) == pytest.approx(law(350.0) * law(400.0, 350.0), rel=1e-12)
