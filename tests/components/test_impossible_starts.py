"""Start values that no part can have, and start temperatures of parts that carry heat."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from _rig import Rig
from test_energy_accounts import EXAMPLES

from acausal import Component, Connections, ParameterError, check, connect, replace, simulate
from components.electrical import Battery
from components.hydraulic import (
    Chamber,
    ConstantFlow,
    DoubleActingCylinder,
    FlowVolume,
    HeatCarrier,
    LevelTank,
    LinearLiquid,
    Pipe,
    Tank,
    Vessel,
    fill,
    iso_vg_46,
)
from components.hydraulic._interfaces import FluidPart
from components.thermal import FixedTemperature, HeatCapacitor, HeatPort

COLD = iso_vg_46(temperature=283.15, carries_heat=True)
PURE = iso_vg_46(temperature=283.15, air=0.0)
CARRIER = HeatCarrier(capacity=1.7e6, temperature=283.15, conductance=0.05)


def through(flow: Any, volume: Any, tank: Any) -> Connections:
    return (connect(flow.port, volume.a), connect(volume.b, tank.port))


@pytest.mark.parametrize("heat", [None, HeatPort(), HeatPort(T=300.0)])
def test_a_filled_volume_starts_at_the_temperature_of_the_liquid(heat: HeatPort | None) -> None:
    volume = FlowVolume(volume=1e-3, heat=heat)
    rig = fill(Rig(parts=(ConstantFlow(flow=1e-9), volume, Tank()), wiring=through), COLD)
    solution = simulate(rig, 1e-3)
    wanted = 283.15 if heat is None or heat.T is None else 300.0
    np.testing.assert_allclose(solution.parts[1].heat.T[0], wanted, rtol=1e-9)


def test_a_heat_port_of_its_own_changes_no_start_temperature() -> None:
    """For each part of the library that holds liquid."""
    count = 0
    for part in EXAMPLES:
        if not isinstance(part, FluidPart) or part.carrier is not None:
            continue
        filled: Any = part.carrying(CARRIER) if getattr(part, "heat", None) is None else None
        for name in ("heat", "heat_a", "heat_b") if filled is not None else ():
            made = getattr(filled, name, None)
            if isinstance(made, HeatPort) and getattr(part, name) is None:
                own = _with(part, name, HeatPort()).carrying(CARRIER)
                assert getattr(own, name).T == made.T, type(part).__name__
                count += made.T is not None
    assert count > 5


def _with(part: Any, name: str, value: Any) -> Any:
    made = object.__new__(type(part))
    for key, old in vars(part).items():
        object.__setattr__(made, key, value if key == name else old)
    return made


IMPOSSIBLE: list[tuple[Callable[[], Component], str]] = [
    (lambda: Chamber(volume=1e-4, liquid=iso_vg_46(), p=-3e5), r"Chamber\.p must not start below the vapour pressure"),
    (
        lambda: DoubleActingCylinder(bore=0.04, stroke=0.1, dead_a=1e-5, dead_b=1e-5, liquid=iso_vg_46(), p_b=-3e5),
        r"DoubleActingCylinder\.p_b must not start below the vapour pressure",
    ),
    (lambda: Pipe(n=4, length=1.0, diameter=0.01, liquid=iso_vg_46(), p=-2e5), r"Pipe\.p_a must not start below"),
    (lambda: LevelTank(area=1.0, density=870.0, height=1.0, h=1.5), r"LevelTank\.h must start between 0 and height"),
    (lambda: LevelTank(area=1.0, density=870.0, height=1.0, h=-0.5), r"LevelTank\.h must start between 0 and height"),
    (lambda: Vessel(area=1.0, density=1e3, height=1.0, heights=[0.0], h=2.0), r"Vessel\.h must start between 0"),
    (
        lambda: Battery(Q=3600.0, charges=[0.0, 1.0], voltages=[3.0, 4.0], R0=0.1, soc=1.2),
        r"Battery\.soc must start between 0 and 1",
    ),
    (lambda: HeatCapacitor(C=1.0, T=-5.0), r"T must be positive"),
    (lambda: FixedTemperature(temperature=-5.0), r"temperature must be positive"),
]


@pytest.mark.parametrize(("build", "message"), IMPOSSIBLE)
def test_impossible_start_values_are_refused(build: Callable[[], Component], message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        build()


def test_replaced_and_changed_start_values_are_checked() -> None:
    chamber = Chamber(volume=1e-4, liquid=iso_vg_46(), p=-0.9e5)
    with pytest.raises(ParameterError, match=r"p must not start below the vapour pressure"):
        replace(chamber, {"p": -3e5})
    tank = LevelTank(area=1.0, density=870.0, height=1.0, h=0.5)
    with pytest.raises(ParameterError, match="h must start between 0 and height"):
        replace(tank, {"height": 0.4})
    object.__setattr__(tank, "h", 3.0)
    assert "h must start between 0 and height, got h = 3.0 m, height = 1.0 m" in str(check(tank))


@pytest.mark.parametrize("liquid", [PURE, LinearLiquid(density=870.0, bulk_modulus=1.5e9, viscosity=4e-5)])
def test_a_liquid_without_air_sustains_tension(liquid: Any) -> None:
    Chamber(volume=1e-4, liquid=liquid, p=-3e5)
