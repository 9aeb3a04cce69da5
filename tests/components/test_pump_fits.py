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


def test_efficiencies_of_another_shape_are_refused() -> None:
    sheet = efficiencies(WilsonLosses(C_s=2e-9)) | {"volumetric": np.ones(3)}
    with pytest.raises(ParameterError, match=r"efficiencies must have shape \(3, 3\), speeds by pressures"):
        WilsonLosses.from_efficiencies(**sheet)
