"""Pumps, actuators, tanks and coolers against closed forms."""

from typing import Any

import jax.numpy as jnp
import numpy as np
import pytest
from _rig import Part, Rig

from acausal import Connections, ParameterError, SimulationError, connect, simulate
from acausal.testing import check_law
from components.blocks import Sine
from components.hydraulic import (
    BootstrapTank,
    ConstantPressure,
    Cooler,
    FixedPump,
    LinearLiquid,
    MappedLosses,
    PilotStage,
    PowerLimitedPump,
    RipplingPump,
    RotaryVaneActuator,
    ServoPump,
    SignalFlow,
    SignalPressure,
    SingleActingCylinder,
    SpringAccumulator,
    Tank,
    VariablePump,
    WilsonLosses,
)
from components.rotational import ConstantSpeed

OIL = LinearLiquid(density=860.0, bulk_modulus=1.4e9, viscosity=3.2e-5)
IDEAL: dict[str, Any] = dict(displacement=4.5e-6, liquid=OIL, losses=WilsonLosses())


def test_bootstrap_tank() -> None:
    """A pump's 210 bar on a fiftieth of the area keep 4.2 bar, 100 N more on 0.01 m2 another 0.1 bar."""
    tank = BootstrapTank(area=0.01, pilot_area=2e-4, stroke=0.1, preload=100.0, rate=2e3, damping=50.0)
    given = {"s": 0.05, "v": np.array([0.0, 0.2]), "pilot.p": 2.1e7}
    expected = {
        "port.p": 4.2e5 + 2e4 + np.array([0.0, 1e3]),
        "port.q": 0.01 * given["v"],
        "pilot.q": -2e-4 * given["v"],
    }
    check_law(tank, given, expected, rtol=1e-12)


def _bootstrapped(flow: Part, signal: Part, tank: Part, high: Part) -> Connections:
    return (
        connect(signal.y, flow.u),
        connect(flow.port, tank.port),
        connect(high.port, tank.pilot),
    )


@pytest.mark.thorough
@pytest.mark.parametrize(("amplitude", "text"), [(-1e-3, "the tank is empty"), (1e-3, "the tank is full")])
def test_bootstrap_tanks_have_ends(amplitude: float, text: str) -> None:
    tank = BootstrapTank(area=0.01, pilot_area=2e-4, stroke=0.02, s=0.01)
    parts = (SignalFlow(), Sine(amplitude=amplitude, frequency=1.0), tank, ConstantPressure(pressure=2e7))
    with pytest.raises(SimulationError, match=text):
        simulate(Rig(parts=parts, wiring=_bootstrapped), 1.0)


def test_cooler() -> None:
    """At 20 l/min, NTU = UA/(rho c q) and the oil gives C (1 - exp(-NTU)) per kelvin; hardly any at rest."""
    cooler = Cooler(resistance=3e8, UA=300.0, density=870.0, specific_heat=1950.0)
    q = np.array([20.0 / 60e3, -20.0 / 60e3, 1e-3, 0.0])
    capacity = 870.0 * 1950.0 * np.abs(q)
    ntu = 300.0 / np.where(capacity > 0.0, capacity, 1.0)
    heat = np.where(capacity > 0.0, capacity * (1.0 - np.exp(-ntu)), 0.0) * 40.0
    given = {"q": q, "oil.T": 333.15, "coolant.T": 293.15}
    expected = {"dp": 3e8 * q, "oil.Q_flow": heat - 3e8 * q**2, "coolant.Q_flow": -heat}
    check_law(cooler, given, expected, rtol=1e-9, atol=1e-9)
    assert heat[0] == pytest.approx(40.0 * 565.5 * (1.0 - np.exp(-300.0 / 565.5)), rel=1e-6)


def test_single_acting_cylinder() -> None:
    """K A^2/V is its stiffness with the port shut, at any stroke; liquid let in moves it."""
    cylinder, s, area = SingleActingCylinder(bore=0.04, liquid=OIL, dead=2e-5), np.array([0.0, 0.1]), np.pi * 4e-4
    rate = 1.4e9 * area / (2e-5 + area * s)
    check_law(cylinder, {"flange.s": s, "v": 0.1, "port.q": 0.0, "p": 1e6}, {"der(p)": -0.1 * rate}, rtol=1e-9)
    given = {"flange.s": s, "v": 0.1, "port.q": 0.1 * area, "p": 1e6}
    check_law(cylinder, given, {"der(p)": 0.0, "flange.f": -1e6 * area}, rtol=1e-9, atol=1e-3)
    with pytest.raises(ParameterError, match=r"^SingleActingCylinder\.dead must be positive and finite, got 0\.0 m3"):
        SingleActingCylinder(bore=0.04, liquid=OIL, dead=0.0)


def test_rotary_vane_actuator() -> None:
    """D = (R^2 - r^2) width/2: its torque, and the rates of its pressures with the ports shut."""
    D = 0.5 * (0.04**2 - 0.015**2) * 0.05
    vane = RotaryVaneActuator(liquid=OIL, displacement=D, angle=4.7, dead_a=1e-5, dead_b=1e-5, leakage=1e-12)
    phi = np.array([0.0, 2.0])
    given = {"flange.phi": phi, "w": 3.0, "a.q": 0.0, "b.q": 0.0, "p_a": 8e6, "p_b": 2e6}
    leaked = 1e-12 * 6e6
    expected = {
        "flange.tau": -D * 6e6,
        "der(p_a)": 1.4e9 * (-leaked - 3.0 * D) / (1e-5 + D * phi),
        "der(p_b)": 1.4e9 * (leaked + 3.0 * D) / (1e-5 + D * (4.7 - phi)),
    }
    check_law(vane, given, expected, rtol=1e-9)


def test_rippling_pump() -> None:
    """Flow and torque have the same ripple, from 1 - ripple to 1 + ripple of the mean, nine times a revolution."""
    pump = RipplingPump(ripple=0.05, pulses=9.0, **IDEAL)
    phi = np.array([0.0, np.pi / 9.0, 0.1])
    share = 1.0 + 0.05 * np.cos(9.0 * phi)
    given = {"shaft.phi": phi, "w": 100.0, "a.p": 0.0, "b.p": 1e7, "der(w)": 0.0}
    check_law(pump, given, {"q": 4.5e-4 * share, "shaft.tau": 45.0 * share}, rtol=1e-9)
    with pytest.raises(ParameterError, match=r"^RipplingPump\.ripple must be below 1, got 1\.2"):
        RipplingPump(ripple=1.2, pulses=9.0, **IDEAL)


def test_power_limited_pump_on_its_curve() -> None:
    """Full displacement, then q dp = 4 kW, then the pressure compensation, at 157 rad/s."""
    pump = PowerLimitedPump(tau=0.03, p_set=2.5e7, band=1e6, power=4e3, **IDEAL)
    p = np.array([2e6, 5e6, 1e7, 2e7, 2.49e7, 2.6e7])
    full = 4.5e-6 * 157.0
    x = np.array([1.0, 1.0, 4e3 / (full * 1e7), 4e3 / (full * 2e7), 0.1, 0.0])
    given = {"w": 157.0, "a.p": 0.0, "b.p": p, "x": x}
    check_law(pump, given, {"der(x)": 0.0, "q": full * x}, rtol=1e-9, atol=1e-9)


SPEEDS, PRESSURES = np.array([50.0, 150.0, 300.0]), np.array([2e6, 1e7, 2e7])
VOLUMETRIC = np.array([[0.93, 0.80, 0.65], [0.98, 0.93, 0.88], [0.99, 0.96, 0.93]])
MECHANICAL = np.array([[0.80, 0.92, 0.94], [0.75, 0.91, 0.94], [0.65, 0.88, 0.92]])


def mapped() -> FixedPump:
    losses = MappedLosses.from_efficiencies(
        displacement=4.5e-6, speeds=SPEEDS, pressures=PRESSURES, volumetric=VOLUMETRIC, mechanical=MECHANICAL
    )
    return FixedPump(**{**IDEAL, "losses": losses})


def test_pump_by_its_efficiencies() -> None:
    """At the points of the map, eta_v = q/(D w) and eta_m = D dp/tau are reproduced; in between, interpolated."""
    w, p = (grid.ravel() for grid in np.meshgrid(SPEEDS, PRESSURES, indexing="ij"))
    given = {"w": w, "a.p": 0.0, "b.p": p, "der(w)": 0.0}
    expected = {"q": 4.5e-6 * w * VOLUMETRIC.ravel(), "shaft.tau": 4.5e-6 * p / MECHANICAL.ravel()}
    check_law(mapped(), given, expected, rtol=1e-9)
    slip = 4.5e-6 * 150.0 * np.array([0.07, 0.12])
    between = mapped().losses.slip(
        jnp.asarray(4.5e-6), jnp.asarray(1.5e7), jnp.asarray(150.0), jnp.ones(()), jnp.ones(())
    )
    assert slip[0] < float(between) < slip[1]


def _driven(drive: Part, pump: Part, tank: Part, high: Part, signal: Part) -> Connections:
    return (
        connect(drive.flange, pump.shaft),
        connect(tank.port, pump.a),
        connect(pump.b, high.port),
        connect(signal.y, high.u),
    )


@pytest.mark.thorough
def test_a_map_that_does_not_cover_the_run() -> None:
    parts = (ConstantSpeed(speed=150.0), mapped(), Tank(), SignalPressure(), Sine(amplitude=2.5e7, frequency=1.0))
    with pytest.raises(SimulationError, match=r"parts\[1\].*beyond the loss map: extend the map"):
        simulate(Rig(parts=parts, wiring=_driven), 0.3)
    with pytest.raises(ParameterError, match=r"^MappedLosses\.slips must have shape \(3, 2\)"):
        MappedLosses(speeds=SPEEDS, pressures=PRESSURES[:2], slips=np.ones((3, 3)), drags=np.ones((3, 2)))


@pytest.mark.thorough
def test_servo_pump_at_rest() -> None:
    """At rest its displacement is the signal's share, limited."""
    pump = ServoPump(swash=PilotStage(w=60.0, D=0.8, rate=12.0), pump=VariablePump(**IDEAL))
    for u, share in ((0.4, 0.4), (3.0, 1.0), (-0.5, -0.5)):
        given = {
            "u.value": u,
            "swash.x": share,
            "swash.z": 0.0,
            "pump.w": 100.0,
            "a.p": 0.0,
            "b.p": 0.0,
        }
        check_law(pump, given, {"der(swash.z)": 0.0, "b.q": -4.5e-4 * share}, rtol=1e-9, atol=1e-9)


def _sprung(high: Part, signal: Part, accumulator: Part) -> Connections:
    return connect(signal.y, high.u), connect(high.port, accumulator.port)


@pytest.mark.thorough
def test_spring_accumulator_between_its_ends() -> None:
    """Under a pressure that swings to both sides it opens at the preload, fills, shuts when full, and empties again.

    Between the ends R dV/dt = p(t) - preload - stiffness V; the linear equation in closed form.
    """
    preload, stiffness, resistance, capacity, top = 2e5, 1e10, 1e9, 5e-5, 1e6
    accumulator = SpringAccumulator(
        capacity=capacity, resistance=resistance, preload=preload, stiffness=stiffness, end=-1.0
    )
    w, rate = 2.0 * np.pi * 0.2, stiffness / resistance
    opens = np.arcsin(preload / top) / w

    def forced(t: Any) -> Any:
        swing = (rate * np.sin(w * t) - w * np.cos(w * t)) / (rate**2 + w**2)
        return top / resistance * swing - preload / stiffness

    t = opens + np.array([0.05, 0.2, 0.4])
    V = forced(t) - forced(opens) * np.exp(-rate * (t - opens))
    parts, times = (SignalPressure(), Sine(amplitude=top, frequency=0.2), accumulator), np.append(t, [1.5, 4.0])
    sol = simulate(Rig(parts=parts, wiring=_sprung), 5.0, save=jnp.asarray(times), rtol=1e-9, energy=True)
    ends = ("fill", "full", "drain", "empty")
    found = {name: float(np.min(sol.events.of_event(f"parts[2].{name}"))) for name in ends}
    assert found["fill"] == pytest.approx(opens, rel=1e-6)
    assert sorted(found, key=lambda name: found[name]) == list(ends)
    # It lets go where the pressure outside falls below its own, preload + stiffness capacity.
    assert found["drain"] == pytest.approx((np.pi - np.arcsin((preload + stiffness * capacity) / top)) / w, rel=1e-6)
    np.testing.assert_allclose(sol["parts[2].V"], np.append(V, [capacity, 0.0]), rtol=1e-6, atol=1e-14)
    assert abs(float(sol.energy.imbalance)) < 1e-6 * top * capacity
