"""Liquids at a given temperature, and heated by the losses of components."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _rig import Part, Rig
from scipy.integrate import solve_ivp

from acausal import Connections, ParameterError, connect, replace, simulate
from acausal.testing import check_law
from components.hydraulic import (
    AnnularGap,
    Chamber,
    ConstantFlow,
    ConstantPressure,
    FixedPump,
    FourWayValve,
    Liquid,
    LiquidOrifice,
    Tank,
    WilsonLosses,
    dot_4,
    fill,
    iso_vg_46,
)
from components.thermal import HeatCapacitor, HeatPort

CELSIUS = 273.15
COLD_TO_HOT = np.array([-30.0, 20.0, 120.0]) + CELSIUS


def test_dot_4_from_cold_to_hot() -> None:
    """Within FMVSS 116 (49 CFR 571.116): at most 1800 mm2/s at -40 C, at least 1.5 mm2/s at 100 C; and its law."""
    cold, hot = (
        float(jnp.asarray(dot_4(celsius + CELSIUS).kinematic_viscosity(jnp.zeros(())))) for celsius in (-40, 100)
    )
    assert 1.5e-6 < hot < cold < 1.8e-3
    liquid = dot_4()
    D = COLD_TO_HOT - float(liquid.T_ref)
    for T, d in zip(COLD_TO_HOT, D, strict=True):
        warm = dot_4(T)
        np.testing.assert_allclose(warm.reference_density, 1070.0 / (1.0 + 8e-4 * d), rtol=1e-12)
        # Far above the pressure at which the air is compressed: the tangent modulus K(T) + m p.
        stiff = warm.bulk_modulus_at(jnp.asarray(3e7))
        np.testing.assert_allclose(stiff, 2e9 * np.exp(-5e-3 * d) + 10.0 * 3e7, rtol=2e-3)


def squeezed(flow: Part, gap: Part, chamber: Part) -> Connections:
    return connect(flow.port, gap.a), connect(gap.b, chamber.port)


@pytest.mark.thorough
@pytest.mark.parametrize("temperature", COLD_TO_HOT)
def test_a_circuit_differentiated_by_its_temperature(temperature: float) -> None:
    """The pressure that a flow builds up behind a gap, by both modes and differences: cold is stiffer and thicker."""
    gap = AnnularGap(diameter=0.02, clearance=5e-5, length=0.02, liquid=dot_4())
    rig = Rig(parts=(ConstantFlow(flow=2e-6), gap, Chamber(volume=1e-5, liquid=dot_4())), wiring=squeezed)

    def pressures(T: jax.Array) -> jax.Array:
        end = simulate(fill(rig, dot_4(T)), 0.1, save="end", rtol=1e-9).final
        return jnp.stack([end.parts[1].dp, end.parts[2].p])

    here, h = jnp.asarray(temperature), 0.05
    with_slope = lambda T: jax.jvp(pressures, (T,), (jnp.ones(()),))  # noqa: E731
    forward, reverse = with_slope(here)[1], jax.jacrev(pressures)(here)
    difference = (with_slope(here + h)[0] - with_slope(here - h)[0]) / (2.0 * h)
    np.testing.assert_allclose(forward, reverse, rtol=1e-7)
    np.testing.assert_allclose(forward, difference, rtol=1e-4)
    assert np.all(np.asarray(forward) < 0.0)


def test_temperatures_that_are_none() -> None:
    with pytest.raises(ParameterError, match=r"^Liquid\.temperature must be positive and finite, got -30\.0 K"):
        dot_4(-30.0)


OIL = iso_vg_46(temperature=313.15, air=1e-3)


@pytest.mark.thorough
def test_losses_leave_as_heat_with_the_viscosity_of_its_temperature() -> None:
    """A gap, q = pi d c^3/(12 mu L) dp with mu at the port's temperature, gives dp q there; pump and valve alike."""
    gap = AnnularGap(diameter=0.02, clearance=2e-5, length=0.03, liquid=OIL, heat=HeatPort())
    T = np.array([293.15, 353.15])
    # Walther's law through 46 mm2/s at 40 C and 6.7 mm2/s at 100 C, at 50 bar.
    z_1, z_2 = (np.log(nu + 0.7) for nu in (46.0, 6.7))
    w = np.log(z_1 / z_2) / np.log(373.15 / 313.15)
    nu = 1e-6 * (np.exp(z_1 * (313.15 / T) ** w) - 0.7) * np.exp(2e-8 * 5e6)
    mu = nu * float(OIL.reference_density)
    q = np.pi * 0.02 * 2e-5**3 / (12.0 * mu * 0.03) * 1e7
    check_law(gap, {"a.p": 1e7, "b.p": 0.0, "heat.T": T}, {"q": q, "heat.Q_flow": -1e7 * q}, rtol=1e-9)

    pump = FixedPump(displacement=1e-6, liquid=OIL, losses=WilsonLosses(C_s=1e-9, C_v=1e5, T_c=0.1), heat=HeatPort())
    slip, drag = 1e-9 * 1e-6 * 1e7 / mu, 1e5 * 1e-6 * mu * 100.0 + 0.1
    given = {"w": 100.0, "a.p": 0.0, "b.p": 1e7, "der(w)": 0.0, "heat.T": T}
    expected = {"q": 1e-4 - slip, "shaft.tau": 10.0 + drag, "heat.Q_flow": -(slip * 1e7 + drag * 100.0)}
    check_law(pump, given, expected, rtol=1e-6)

    valve = FourWayValve(rated_flow=1e-3, rated_drop=1e6, heat=HeatPort())
    given = {"u.value": 0.5, "p.p": 1e7, "t.p": 0.0, "a.p": 9e6, "b.p": 1e6, "heat.T": 300.0}
    check_law(valve, given, {"q_pa": 5e-4, "q_bt": 5e-4, "heat.Q_flow": -1000.0}, rtol=1e-6)


def leaking(source: Part, gap: Part, tank: Part, oil: Part) -> Connections:
    return connect(source.port, gap.a), connect(gap.b, tank.port), connect(gap.heat, oil.port)


@pytest.mark.thorough
def test_oil_that_its_leakage_warms() -> None:
    """C dT/dt = dp q(T), integrated by another program; nothing is dissipated that is not stored as heat."""
    gap = AnnularGap(diameter=0.02, clearance=2e-5, length=0.03, liquid=OIL, heat=HeatPort())
    oil = HeatCapacitor(C=5.0, T=293.15)
    sol = simulate(
        Rig(parts=(ConstantPressure(pressure=1e7), gap, Tank(), oil), wiring=leaking),
        60.0, save=jnp.linspace(0.0, 60.0, 7), rtol=1e-9, energy=True,
    )  # fmt: skip

    def warming(t: float, T: Any) -> Any:
        del t
        nu = float(jnp.asarray(OIL.kinematic_viscosity(jnp.asarray(5e6), jnp.asarray(T[0]))))
        return [1e7 * np.pi * 0.02 * 2e-5**3 / (12.0 * nu * float(OIL.reference_density) * 0.03) * 1e7 / 5.0]

    other = solve_ivp(warming, (0.0, 60.0), [293.15], method="DOP853", t_eval=np.linspace(0.0, 60.0, 7), rtol=1e-10)
    np.testing.assert_allclose(sol["parts[3].T"], other.y[0], rtol=1e-8)
    assert float(other.y[0][-1]) > 303.0
    assert abs(float(sol.energy.imbalance)) < 1e-9 * float(sol.energy.stored["parts[3]"])
    cold = replace(
        Rig(parts=(ConstantPressure(pressure=1e7), gap, Tank(), oil), wiring=leaking), {"parts[3].T": 263.15}
    )
    assert float(simulate(cold, 60.0, save="end").final.parts[3].T) < float(other.y[0][-1])


def test_an_orifice_turns_laminar_as_it_gets_cold() -> None:
    """Far below its transition, the flow of a hole is C_d A dp sqrt(2/(rho p_t)), with nu of the port's temperature."""
    hole = LiquidOrifice(area=1e-6, liquid=OIL, heat=HeatPort())
    T, dp = np.array([283.15, 313.15]), 0.1
    nu = np.array([float(jnp.asarray(OIL.kinematic_viscosity(jnp.zeros(()), jnp.asarray(t)))) for t in T])
    rho, diameter = float(OIL.reference_density), np.sqrt(4e-6 / np.pi)
    p_t = 0.5 * rho * (100.0 * nu / (0.61 * diameter)) ** 2
    check_law(
        hole, {"a.p": dp, "b.p": 0.0, "heat.T": T}, {"q": 0.61e-6 * np.sqrt(2.0 / rho) * dp / np.sqrt(p_t)}, rtol=1e-6
    )


@pytest.mark.thorough
def test_viscosity_is_that_of_the_liquid_without_a_temperature() -> None:
    for liquid in (OIL, Liquid(density=870.0, bulk_modulus=1.5e9, nu_1=46e-6, nu_2=6.7e-6)):
        p = jnp.asarray(1e7)
        assert liquid.kinematic_viscosity(p) == liquid.kinematic_viscosity(p, liquid.temperature)
