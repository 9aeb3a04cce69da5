"""Restrictions, valves, pumps, cylinders and accumulators against closed forms and published figures."""

from typing import Any

import jax.numpy as jnp
import numpy as np
import pytest

from acausal import ParameterError, replace
from acausal.testing import check_component, check_law
from components.hydraulic import (
    AnnularGap,
    CheckValve,
    DoubleActingCylinder,
    DrilledPassage,
    EndCushion,
    Filter,
    FixedPump,
    FlowControlValve,
    FourWayValve,
    GasAccumulator,
    LaminarResistance,
    LinearLiquid,
    LiquidOrifice,
    LoadSensingPump,
    LocalLoss,
    PilotCheckValve,
    PoppetValve,
    PressureCompensatedPump,
    PressureReducingValve,
    PumpLosses,
    SchloesserLosses,
    ShuttleValve,
    SpringAccumulator,
    ThreeWayValve,
    TJunction,
    VariableOrifice,
    VariablePump,
    WilsonLosses,
    iso_vg_46,
)

OIL = LinearLiquid(density=860.0, bulk_modulus=1.4e9, viscosity=3.2e-5)
HOLE: dict[str, Any] = dict(area=1e-6, liquid=OIL, discharge_coefficient=0.7, transition_reynolds=100.0)
DROPS = np.array([10.0, 1e3, 1e5, 1e7])
FLOWS = np.array([4.018208680049e-09, 3.998292671781e-07, 1.066164799284e-05, 0.0001067489859397])  # rounded root


def test_orifice_from_laminar_to_turbulent() -> None:
    check_law(LiquidOrifice(**HOLE), {"dp": np.concatenate([-DROPS, DROPS])}, {"q": np.concatenate([-FLOWS, FLOWS])},
              rtol=1e-12)  # fmt: skip


def test_variable_orifice() -> None:
    """The area of the signal, limited; shut, that of the leak."""
    orifice = VariableOrifice(leak=1e-8, **HOLE)
    for u, share in ((-1.0, 0.01), (0.25, 0.01 + 0.99 * 0.25), (2.0, 1.0)):
        check_law(orifice, {"u.value": u, "dp": DROPS}, {"q": share * FLOWS}, rtol=1e-12)


def test_annular_gap() -> None:
    """pi d c^3 dp/(12 mu L), two and a half times that where the piston touches the bore."""
    sizes: dict[str, Any] = dict(diameter=0.02, clearance=1e-5, length=0.03, liquid=OIL)
    q = np.pi * 0.02 * 1e-15 * 1e7 / (12.0 * 860.0 * 3.2e-5 * 0.03)
    check_law(AnnularGap(**sizes), {"dp": 1e7}, {"q": q}, rtol=1e-12)
    check_law(AnnularGap(eccentricity=1.0, **sizes), {"dp": 1e7}, {"q": 2.5 * q}, rtol=1e-12)


def test_fittings() -> None:
    """Borda and Carnot for an expansion, (1 - s)/2 for a contraction; the others from their tables."""
    step = LocalLoss.widening(diameter_a=0.01, diameter_b=0.02, liquid=OIL)
    v = np.array([5.0, 20.0])
    for sense, zeta in ((1.0, 0.75**2), (-1.0, 0.375)):
        q = sense * v * np.pi / 4.0 * 1e-4
        check_law(step, {"dp": sense * zeta * 430.0 * v**2}, {"q": q}, rtol=1e-3)
    bend = LocalLoss.bend(diameter=0.01, radius=0.03, liquid=OIL)
    assert float(jnp.asarray(bend.zeta_ab)) == pytest.approx(0.21 / np.sqrt(3.0))
    assert float(jnp.asarray(LocalLoss.drilled_corner(diameter=0.01, liquid=OIL).zeta_ba)) == 1.2
    entry = LocalLoss.entry(diameter=0.01, liquid=OIL)
    assert (float(jnp.asarray(entry.zeta_ab)), float(jnp.asarray(entry.zeta_ba))) == (0.5, 1.0)


@pytest.mark.thorough
def test_drilled_passage() -> None:
    """Hagen and Poiseuille along it and 1.2 rho/2 v^2 for each corner, in both directions."""
    passage = DrilledPassage(diameter=4e-3, length=0.1, corners=2.0, liquid=OIL)
    q = np.array([-4e-5, -1e-6, 1e-6, 4e-5])
    v = q / (np.pi / 4.0 * 16e-6)
    law = 128.0 * 860.0 * 3.2e-5 * 0.1 * q / (np.pi * 256e-12) + 2.0 * 1.2 * 430.0 * v * np.abs(v)
    check_law(passage, {"q": q}, {"dp": law}, rtol=1e-12)
    assert float(replace(passage, {"q": 1e-6}).reynolds) == pytest.approx(v[2] * 4e-3 / 3.2e-5)
    check_component(passage)
    with pytest.raises(ParameterError, match=r"^DrilledPassage\.length must be positive and finite, got 0\.0 m"):
        DrilledPassage(diameter=4e-3, length=0.0, corners=2.0, liquid=OIL)


@pytest.mark.thorough
def test_end_cushion() -> None:
    """Away from the end it is the orifice; half-way, half of it and half of the gap; at the end, the gap."""
    cushion = EndCushion(gap=1e-7, length=0.01, end=0.3, sense=-1.0, **HOLE)
    s = np.array([0.1, 0.295, 0.3, 0.31])
    for position, share in zip(s, [1.0, 0.55, 0.1, 0.1], strict=True):
        check_law(cushion, {"rod.s": position, "dp": DROPS}, {"q": share * FLOWS, "rod.f": 0.0}, rtol=1e-12)
    with pytest.raises(ParameterError, match=r"^EndCushion\.sense must be 1 or -1, got 2\.0"):
        EndCushion(gap=1e-7, length=0.01, sense=2.0, **HOLE)


@pytest.mark.thorough
def test_filter_and_its_bypass() -> None:
    """The element alone up to the cracking pressure; beyond it the bypass helps."""
    filter_ = Filter(
        element=LaminarResistance(resistance=1e8),
        bypass=CheckValve(conductance=1e-8, cracking_pressure=2e5, transition_pressure=1e3),
    )
    p = np.array([1e5, 5e5])
    check_law(filter_, {"a.p": p, "b.p": 0.0}, {"a.q": p / 1e8 + 1e-8 * np.array([0.0, 3e5])}, rtol=1e-6)


def test_tee() -> None:
    """Sum of the losses of both legs: 20 f straight through, 60 f to the branch."""
    tee = TJunction.standard(diameter=0.01, liquid=OIL, friction=0.02)
    straight, turned = tee.loss_a.zeta_ab + tee.loss_b.zeta_ba, tee.loss_a.zeta_ab + tee.loss_c.zeta_ba
    assert float(jnp.asarray(straight)) == pytest.approx(0.4)
    assert float(jnp.asarray(turned)) == pytest.approx(1.2)


@pytest.mark.thorough
def test_poppet_under_pressure_and_flow_force() -> None:
    """Lift and pressure at three flows balance a spring of 400 N + 40 kN/m x; a moving poppet displaces liquid."""
    valve = PoppetValve(seat=4e-5, width=0.0126, stroke=1e-3, density=860.0, transition_pressure=1.0)
    x = np.array([7.998835682135e-06, 7.929482474517e-05, 0.0005950625779511])
    dp = np.array([10119524.2675, 10295557.1856, 11686582.20573]) - 1e5
    q = np.array([1e-5, 1e-4, 8e-4])
    for lift, drop, flow in zip(x, dp, q, strict=True):
        given: dict[str, Any] = {"rod.s": lift, "dp": drop, "v": np.array([0.0, 0.2])}
        check_law(valve, given, {"q": flow + 4e-5 * given["v"], "rod.f": -(400.0 + 4e4 * lift)}, rtol=1e-9)


def test_load_sensing_pump_in_equilibrium() -> None:
    """At three loads behind an edge of 8 mm2; at the highest one the pressure compensation holds it back."""
    mu = 860.0 * 3.2e-5
    pump = LoadSensingPump(
        displacement=4.5e-6, liquid=OIL, losses=WilsonLosses(C_s=1.5e-12 * mu / 4.5e-6), tau=0.03,
        margin=2e6, band=4e5, p_set=16e6, band_set=1e6,
    )  # fmt: skip
    load = np.array([6e6, 9e6, 1.5e7])
    p = np.array([7802746.524564, 10800328.68437, 15675086.55281])
    x = np.array([0.493133688591, 0.4991782890864, 0.3249134471895])
    q = [0.0003366948312027, 0.000336468968213, 0.0002060387206102]
    given: dict[str, Any] = {"w": 157.0, "a.p": 0.0, "b.p": p, "load.p": load, "x": x}
    check_law(pump, given, {"q": q, "der(x)": 0.0, "load.q": 0.0}, rtol=1e-9, atol=1e-9)


RATED: dict[str, Any] = dict(rated_flow=5e-4, rated_drop=3.5e6)
K = 5e-4 / np.sqrt(3.5e6)


@pytest.mark.parametrize("u", [0.6, -0.6, 0.1, -0.1, 3.0])
def test_four_way_valve(u: float) -> None:
    """K (u - lap)/(1 - lap) sqrt(dp) at each open edge, with another lap at the edges to the tank."""
    valve = FourWayValve(lap=0.2, lap_return=-0.1, transition_pressure=1e-3, **RATED)
    p, t, a, b = 12e6, 1e5, 5e6, 3e6

    def flow(travel: float, lap: float, dp: float) -> float:
        return K * min(max((travel - lap) / (1.0 - lap), 0.0), 1.0) * np.sqrt(dp)

    flows = {
        "q_pa": flow(u, 0.2, p - a), "q_bt": flow(u, -0.1, b - t), "q_pb": flow(-u, 0.2, p - b),
        "q_at": flow(-u, -0.1, a - t),
    }  # fmt: skip
    flows["p.q"] = flows["q_pa"] + flows["q_pb"]
    flows["a.q"] = flows["q_at"] - flows["q_pa"]
    check_law(valve, {"u.value": u, "p.p": p, "t.p": t, "a.p": a, "b.p": b}, flows, rtol=1e-9)


def test_underlap_and_leakage() -> None:
    """An open centre lets pass at rest, K 0.1/1.1 sqrt(dp) and K 0.3/1.3 sqrt(dp); leakage comes on top."""
    for leakage in (0.0, 0.05):
        valve = ThreeWayValve(lap=-0.1, lap_return=-0.3, leakage=leakage, transition_pressure=1e-3, **RATED)
        supply, drain = K * (0.1 / 1.1 + leakage), K * (0.3 / 1.3 + leakage)
        given: dict[str, Any] = {"u.value": 0.0, "p.p": 9e6, "t.p": 0.0, "a.p": 4e6}
        check_law(valve, given, {"q_pa": supply * np.sqrt(5e6), "q_at": drain * np.sqrt(4e6)}, rtol=1e-9)


@pytest.mark.thorough
def test_pressure_valves() -> None:
    """The targets of the openings, at half of the band and beyond it."""
    rated: dict[str, Any] = RATED | dict(band=1e6, tau=1e-3)
    reducing = PressureReducingValve(pressure=5e6, **rated)
    lower = np.array([6e6, 4.5e6, 1e6])
    given: dict[str, Any] = {"a.p": 2e7, "b.p": lower, "x": 0.0}
    check_law(reducing, given, {"der(x)": np.array([0.0, 500.0, 1000.0]), "q": 0.0}, atol=1e-6)
    check = PilotCheckValve(cracking=1e5, ratio=3.0, **rated)
    held = {"a.p": 0.0, "b.p": 1e7, "x": 0.0, "pilot.p": np.array([3e6, 3.6e6, 6e6])}
    check_law(check, held, {"der(x)": np.array([0.0, 1000.0 * 0.7, 1000.0]), "pilot.q": 0.0}, atol=1e-6)


def test_flow_control_valve() -> None:
    valve = FlowControlValve(flow=1e-4, margin=8e5, transition_pressure=1e-2)
    check_law(valve, {"dp": np.array([-2e5, 2e5, 8e5, 1e7])}, {"q": np.array([-5e-5, 5e-5, 1e-4, 1e-4])}, rtol=1e-9)


def test_shuttle_valve() -> None:
    """The port of higher pressure is connected to c."""
    valve = ShuttleValve(transition_pressure=1e-2, **RATED)
    for a, b, q_a, q_b in ((5e6, 1e6, K * 1e3, 0.0), (1e6, 5e6, 0.0, K * 1e3)):
        check_law(valve, {"a.p": a, "b.p": b, "c.p": 4e6}, {"a.q": q_a, "b.q": q_b, "c.q": -K * 1e3}, rtol=1e-9)


# Flow and torque of a pump of 4.5 cm3/rad at [rpm, Pa, Pa.s], by the two laws.
DUTIES = np.array([[500.0, 2e6, 0.008], [1500.0, 2e6, 0.03], [3000.0, 2e7, 0.03]])
COEFFICIENTS = dict(C_s=1e-8, C_v=1.2e5, C_f=0.03, T_c=0.5)
WILSON = ([0.0002243694490192, 0.0007038583470577, 0.001383716694115], [9.996194671058, 12.31469004941, 98.28938009882])
SCHLOESSER = (
    [0.0002236258894442, 0.0007031147874826, 0.001381365352282], [10.06849216233, 12.96536747084, 100.8920897845]
)  # fmt: skip


@pytest.mark.parametrize(
    ("losses", "wanted"),
    [
        (WilsonLosses(**COEFFICIENTS), WILSON),
        (SchloesserLosses(C_st=4e-5, C_h=50.0, p_t=1.0, **COEFFICIENTS), SCHLOESSER),
    ],
    ids=["wilson", "schloesser"],
)
def test_pump_losses(losses: PumpLosses, wanted: tuple[list[float], list[float]]) -> None:
    for (rpm, dp, mu), q, tau in zip(DUTIES, *wanted, strict=True):
        liquid = LinearLiquid(density=860.0, bulk_modulus=1.4e9, viscosity=mu / 860.0)
        pump = FixedPump(displacement=4.5e-6, liquid=liquid, losses=losses)
        given: dict[str, Any] = {"w": rpm * np.pi / 30.0, "a.p": 0.0, "b.p": dp}
        check_law(pump, given, {"q": q, "shaft.tau": tau}, rtol=1e-10)


@pytest.mark.thorough
def test_a_pump_that_sucks_vapour() -> None:
    """As the pressure at its inlet falls to that of the vapour, delivery and torque fade together."""
    oil = iso_vg_46()
    suction = np.array([0.0, -0.9e5, -101315.0])
    filling = np.asarray(oil.relative_density(jnp.asarray(suction)))
    assert filling[0] == 1.0
    assert filling[2] < 0.1
    pump = FixedPump(displacement=1e-6, liquid=oil, losses=WilsonLosses())
    given: dict[str, Any] = {"w": 100.0, "a.p": suction, "b.p": 1e7}
    check_law(pump, given, {"q": 1e-4 * filling, "shaft.tau": 1e-6 * filling * (1e7 - suction)}, rtol=1e-9)


def test_variable_pump_is_limited() -> None:
    pump = VariablePump(displacement=1e-6, liquid=OIL, losses=WilsonLosses())
    given: dict[str, Any] = {"w": 100.0, "a.p": 0.0, "b.p": 1e7, "u.value": np.array([-3.0, -0.5, 0.4, 2.0])}
    check_law(pump, given, {"q": 1e-4 * np.array([-1.0, -0.5, 0.4, 1.0])}, rtol=1e-12)


def test_compensated_pump_on_its_curve() -> None:
    """Displacement and delivery over the pressure, the leakage of 1.5e-12 p included."""
    mu = 860.0 * 3.2e-5
    losses = WilsonLosses(C_s=1.5e-12 * mu / 4.5e-6)
    pump = PressureCompensatedPump(displacement=4.5e-6, liquid=OIL, losses=losses, tau=0.03, p_set=16e6, band=1e6)
    p = np.array([0.0, 5e6, 15e6, 15.25e6, 15.75e6, 16e6])
    x, q = np.array([1.0, 1.0, 1.0, 0.75, 0.25, 0.0]), [0.0007065, 0.000699, 0.000684, 0.000507, 0.000153, -2.4e-05]
    check_law(pump, {"w": 157.0, "a.p": 0.0, "b.p": p, "x": x}, {"q": q, "der(x)": 0.0}, rtol=1e-9, atol=1e-9)


@pytest.mark.thorough
def test_gas_accumulator_laws() -> None:
    """Precharged to 50 bar (absolute here), 0.5 l, with 0.1 to 0.3 l in it: isothermal, adiabatic, polytropic."""
    V = np.array([1e-4, 2e-4, 3e-4])
    for n, wanted in (
        (1.0, [6250000.0, 8333333.333333, 12500000.0]),
        (1.4, [6833512.962145, 10222526.7058, 18033748.82384]),
        (1.2, [6535247.203695, 9229719.527069, 15014055.42477]),
    ):
        gas = GasAccumulator(capacity=4e-4, resistance=1.0, volume=5e-4, precharge=5e6, n=n, atmosphere=0.0)
        check_law(gas, {"V": V, "port.q": 0.0}, {"p": wanted}, rtol=1e-11)


def test_spring_accumulator_law() -> None:
    spring = SpringAccumulator(capacity=1e-4, resistance=1e8, preload=2e5, stiffness=1e10)
    check_law(spring, {"V": 5e-5, "port.p": 8e5}, {"p": 7e5, "port.q": 1e-3}, rtol=1e-12)


def test_cylinder_stiffness_depends_on_the_stroke() -> None:
    """omega = sqrt(K (A_a^2/V_a + A_b^2/V_b)/m): here K A^2/V by the rates of the pressures with the rod moving."""
    bore, rod, stroke, dead = 0.04, 0.025, 0.3, 2e-5
    cylinder = DoubleActingCylinder(bore=bore, rod=rod, stroke=stroke, liquid=OIL, dead_a=dead, dead_b=dead)
    area_a, area_b = np.pi / 4.0 * bore**2, np.pi / 4.0 * (bore**2 - rod**2)
    s = np.array([0.0, 0.15, 0.3])
    volume_a, volume_b = dead + area_a * s, dead + area_b * (stroke - s)
    given: dict[str, Any] = {"flange.s": s, "v": 0.1, "a.q": 0.0, "b.q": 0.0, "p_a": 1e6, "p_b": 2e6}
    rates = {"der(p_a)": -1.4e9 * area_a * 0.1 / volume_a, "der(p_b)": 1.4e9 * area_b * 0.1 / volume_b}
    check_law(cylinder, given, rates | {"flange.f": area_b * 2e6 - area_a * 1e6}, rtol=1e-9)


GOOD: dict[str, Any] = dict(bore=0.04, stroke=0.3, liquid=OIL, dead_a=1e-5, dead_b=1e-5)


@pytest.mark.parametrize(
    ("change", "text"),
    [
        (dict(dead_a=0.0), "dead_a must be positive and finite, got 0.0 m3"),
        (dict(bore=0.0), "bore must be positive"),
        (dict(rod=0.04), "rod must be thinner than bore, got rod = 0.04 m, bore = 0.04 m"),
    ],
    ids=["dead", "bore", "rod"],
)
def test_bad_cylinders(change: dict[str, Any], text: str) -> None:
    with pytest.raises(ParameterError, match=rf"^DoubleActingCylinder\.{text}"):
        DoubleActingCylinder(**(GOOD | change))


def test_bad_restrictions_and_accumulators() -> None:
    with pytest.raises(ParameterError, match=r"^LiquidOrifice\.area must be positive and finite, got 0\.0 m2"):
        LiquidOrifice(area=0.0, liquid=OIL)
    with pytest.raises(ParameterError, match=r"^AnnularGap\.eccentricity must be at most 1"):
        AnnularGap(diameter=0.1, clearance=1e-5, length=0.1, liquid=OIL, eccentricity=1.1)
    with pytest.raises(ParameterError, match=r"^VariableOrifice\.leak must be at most area"):
        VariableOrifice(area=1e-6, leak=1e-5, liquid=OIL)
    with pytest.raises(ParameterError, match=r"^GasAccumulator\.capacity must be below volume"):
        GasAccumulator(capacity=1e-3, resistance=1.0, volume=5e-4, precharge=5e6)
    with pytest.raises(ParameterError, match=r"^FourWayValve\.lap must be below 1"):
        FourWayValve(lap=1.0, **RATED)
