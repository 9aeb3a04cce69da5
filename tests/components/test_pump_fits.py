"""Coefficients of pump losses from efficiencies."""

from typing import Any

import numpy as np
import pytest

from acausal import ParameterError, parameters
from components.hydraulic import SchloesserLosses, WilsonLosses

D, MU, RHO = 4.5e-6, 0.03, 870.0
SPEEDS, PRESSURES = np.array([80.0, 150.0, 300.0]), np.array([50e5, 150e5, 280e5])


def efficiencies(losses: Any) -> dict[str, Any]:
    """The data sheet of a pump with these losses."""
    w, dp = np.meshgrid(SPEEDS, PRESSURES, indexing="ij")
    slip, drag = (np.asarray(law(D, dp, w, MU, RHO)) for law in (losses.slip, losses.drag))
    return dict(
        displacement=D,
        speeds=SPEEDS,
        pressures=PRESSURES,
        volumetric=1.0 - slip / (D * w),
        mechanical=1.0 / (1.0 + drag / (D * dp)),
        viscosity=MU,
        density=RHO,
    )


@pytest.mark.parametrize(
    "losses",
    [
        WilsonLosses(C_s=2e-9, C_v=1e5, C_f=0.02, T_c=0.3),
        SchloesserLosses(C_s=2e-9, C_v=1e5, C_f=0.02, T_c=0.3, C_st=1e-4, C_h=30.0),
    ],
    ids=["Wilson", "Schloesser"],
)
def test_a_fit_finds_the_coefficients_of_the_law(losses: Any) -> None:
    sheet = efficiencies(losses)
    found, expected = parameters(type(losses).from_efficiencies(**sheet)), parameters(losses)
    for name in expected:
        assert float(found[name]) == pytest.approx(float(expected[name]), rel=1e-4), name


def test_a_fit_of_a_simpler_law_stays_near_the_efficiencies() -> None:
    """Wilson's law for a pump with turbulent slip: the efficiencies of the fit differ by less than a per cent."""
    sheet = efficiencies(SchloesserLosses(C_s=2e-9, C_v=1e5, C_f=0.02, T_c=0.3, C_st=3e-5))
    again = efficiencies(WilsonLosses.from_efficiencies(**sheet))
    np.testing.assert_allclose(again["volumetric"], sheet["volumetric"], atol=0.01)
    np.testing.assert_allclose(again["mechanical"], sheet["mechanical"], atol=1e-9)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"volumetric": np.ones(3)}, r"efficiencies must have shape \(3, 3\), speeds by pressures"),
        ({"mechanical": np.full((3, 3), 92.0)}, "efficiencies must be above 0 and at most 1: 92 per cent is 0.92"),
        ({"speeds": np.array([0.0, 100.0, 200.0])}, "speeds and pressures must be positive"),
    ],
)
def test_what_is_no_map_of_efficiencies_is_refused(change: dict[str, Any], message: str) -> None:
    sheet = efficiencies(WilsonLosses(C_s=2e-9)) | change
    with pytest.raises(ParameterError, match=message):
        WilsonLosses.from_efficiencies(**sheet)


@pytest.mark.parametrize("name", ["displacement", "viscosity", "density"])
def test_a_fit_refuses_data_that_are_not_positive(name: str) -> None:
    given: dict[str, Any] = dict(displacement=1e-5, viscosity=0.03, density=870.0) | {name: -1.0}
    grid = dict(speeds=[100.0], pressures=[1e7], volumetric=[[0.95]], mechanical=[[0.9]])
    with pytest.raises(ParameterError, match="displacement, viscosity and density must be positive"):
        WilsonLosses.from_efficiencies(**given, **grid)
