"""Energies of an opening against an independent integration, and the energy balance of the whole manoeuvre.

The reference energies in J come from hand-written equations, integrated with LSODA at a tolerance of 1e-12.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from studies import opening
from studies.actuators import ehs_maxon, ema_fise, ema_maxon

REFERENCE: dict[Callable[..., Any], dict[str, float]] = {
    ema_fise: {
        "E_in": 170.77839450933942,
        "E_joule": 152.5988905490222,
        "E_motor_friction": 12.503132983193648,
        "E_fluid_damping": 0.0024643087629184165,
        "E_piston": 2.850096829072025e-06,
        "KE_rotor": 1.4706427398859374,
        "PE_fluid": 0.026514924665914954,
        "KE_slave": 0.0007461533201438169,
        "PE_spring": 4.176000000136469,
    },
    ema_maxon: {
        "E_in": 30.123299924790235,
        "E_joule": 18.956093402812936,
        "E_motor_friction": 6.6134685313186,
        "E_fluid_damping": 0.0035927221224908304,
        "E_piston": 4.25883191520546e-06,
        "KE_rotor": 0.3468202107743464,
        "PE_fluid": 0.025857620081212077,
        "KE_slave": 0.0014631786684226632,
        "PE_spring": 4.175999999554351,
    },
    ehs_maxon: {
        "E_in": 45.667149963805215,
        "E_joule": 34.68508979054175,
        "E_motor_friction": 6.735802981509038,
        "E_fluid_damping": 0.001955596537561043,
        "E_piston": 2.293825998860475e-06,
        "KE_rotor": 0.0408118168159746,
        "PE_fluid": 0.02696676113467362,
        "KE_slave": 0.0005207220603401017,
        "PE_spring": 4.176000000007127,
    },
}
ROTATING = ("motor.rotor", "gearbox", "cam", "pump")


@pytest.mark.thorough
@pytest.mark.parametrize("actuator", REFERENCE, ids=lambda actuator: actuator.__name__)
def test_energies_at_opening(actuator: Callable[..., Any]) -> None:
    account = opening(actuator(), energy=True).energy
    found = {
        "E_in": account.supplied["supply"],
        "E_joule": account.dissipated["motor.resistor"],
        "E_motor_friction": account.dissipated["motor.bearing"],
        "E_fluid_damping": account.dissipated["line"],
        "E_piston": account.dissipated["seal"],
        "KE_rotor": sum(account.stored.get(part, 0.0) for part in ROTATING),
        "PE_fluid": account.stored["line"],
        "KE_slave": account.stored["piston"],
        "PE_spring": account.stored["clutch"],
    }
    for name, energy in REFERENCE[actuator].items():
        np.testing.assert_allclose(found[name], energy, rtol=1e-6, err_msg=name)
    assert abs(account.imbalance) <= 1e-7 * account.totals[0]
