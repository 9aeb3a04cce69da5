"""Battery, inverter, synchronous and brushed motors, bridge, encoder and solenoid against closed forms."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _rig import Rig
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm

from acausal import Connections, ParameterError, connect, quantity, simulate
from acausal.testing import check_law
from components import blocks, electrical, rotational, thermal
from components.electrical import DqCurrents, DqMachine

SURFACE = DqMachine(p=4, psi=0.012, Ld=60e-6, Lq=60e-6)
INTERIOR = DqMachine(p=4, psi=0.062, Ld=0.35e-3, Lq=0.9e-3, Rs=0.03)


@jax.jit
def most(machine: DqMachine, w: Any, v: Any, i: Any) -> tuple[DqCurrents, Any, Any]:
    """Currents, torque and voltage for a torque setpoint far above the possible torque."""
    found = machine.currents(1e4, w, v, i)
    return found, machine.torque(found), machine.voltage(found, w)


def test_field_weakening_without_resistance_is_the_closed_form() -> None:
    """i_d = ((V/w)^2 - psi^2 - (L I)^2)/(2 psi L) above the corner (Morimoto 1990)."""
    psi, L, V, I = 0.012, 60e-6, 13.5, 120.0  # noqa: E741
    corner = V / np.hypot(psi, L * I)
    for factor in (0.5, 1.25, 1.5, 2.0, 2.9):
        w = factor * corner
        i_d = 0.0 if factor < 1.0 else ((V / w) ** 2 - psi**2 - (L * I) ** 2) / (2.0 * psi * L)
        found, torque, voltage = most(SURFACE, w, V, I)
        np.testing.assert_allclose(found.d, i_d, rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(torque, 6.0 * psi * np.sqrt(I**2 - i_d**2), rtol=1e-12)
        np.testing.assert_allclose(voltage, min(V, factor * V), rtol=1e-12)


@pytest.mark.parametrize(
    ("factor", "i_d", "i_q", "torque"),
    [
        (0.5, -150.82716169358653, 199.37694775338673, 173.40403971561346),
        (1.25, -193.0345052261641, 158.8637145231409, 160.29569095611322),
        (2.0, -230.47924410859483, 96.84687932572099, 109.68698439535417),
        (3.0, -242.4413409454816, 61.00980413471874, 71.50693293141529),
    ],
)
def test_buried_magnets_by_constrained_maximisation(factor: float, i_d: float, i_q: float, torque: float) -> None:
    found, given, _ = most(INTERIOR, factor * 918.7538390729152, 170.0, 250.0)
    np.testing.assert_allclose([found.d, found.q, given], [i_d, i_q, torque], rtol=1e-10)


def test_beyond_the_current_limit_the_voltage_alone_bounds_the_torque() -> None:
    """MTPV: with |psi/L| < I, i_d tends to -psi/L and the torque to 3/2 p psi V/(w L)."""
    found, torque, _ = most(SURFACE, 4000.0, 13.5, 400.0)
    np.testing.assert_allclose([found.d, torque], [-200.0, 6.0 * 0.012 * 13.5 / (4000.0 * 60e-6)], rtol=1e-12)


@pytest.mark.thorough
@pytest.mark.parametrize("share", [0.075, 0.2, 0.5, 0.8])
@pytest.mark.parametrize("speed", [1.0, 1.2, 2.0, 4.0])
def test_weak_magnets_and_much_reluctance(share: float, speed: float) -> None:
    """psi is a fraction of Ld I; the speed is above the corner speed of the MTPA currents."""
    i_max, v_max = 100.0, 50.0
    machine = DqMachine(p=3, psi=share * 1e-4 * i_max, Ld=1e-4, Lq=3e-4)
    w = 1.001 * speed * v_max / float(machine.voltage(machine.most_per_ampere(i_max), 1.0))
    i = machine.currents(torque=1e3, w=w, v_max=v_max, i_max=i_max)
    angle = np.linspace(0.0, np.pi, 20001)
    size = np.linspace(0.0, i_max, 201)[:, None]
    tried = DqCurrents(jnp.asarray(size * np.cos(angle)), jnp.asarray(size * np.sin(angle)))
    best = np.max(np.where(machine.voltage(tried, w) <= v_max, machine.torque(tried), 0.0))
    assert float(machine.torque(i)) == pytest.approx(best, rel=5e-3)
    assert float(jnp.hypot(i.d, i.q)) <= i_max * (1.0 + 1e-9)
    assert float(machine.voltage(i, w)) <= v_max * (1.0 + 1e-9)


_currents = jax.jit(jax.vmap(lambda m, T, w, v, i: m.currents(T, w, v, i), (None, 0, None, None, None)))


@pytest.mark.thorough
@settings(deadline=None, max_examples=150, derandomize=True, database=None)
@given(
    w=st.floats(-4000.0, 4000.0),
    v_max=st.floats(0.5, 60.0),
    i_max=st.floats(5.0, 200.0),
    Rs=st.sampled_from([0.0, 0.02, 0.1]),
    Lq=st.sampled_from([2e-4, 3e-4, 6e-4]),
    psi=st.floats(5e-3, 5e-2),
)
def test_limits_are_kept_wherever_they_can_be(
    w: float, v_max: float, i_max: float, Rs: float, Lq: float, psi: float
) -> None:
    """Torques grow with the setpoint; if no currents keep both limits, they are the smallest at the voltage limit.

    By comparison with a grid of all currents.
    """
    machine = DqMachine(p=4, psi=psi, Ld=2e-4, Lq=Lq, Rs=Rs)
    most = float(machine.torque(machine.most_per_ampere(i_max)))
    wanted = jnp.linspace(-1.5, 1.5, 13) * most
    found = _currents(machine, wanted, w, v_max, i_max)
    torque, size = np.asarray(machine.torque(found)), np.hypot(found.d, found.q)
    assert np.all(np.diff(torque) >= -1e-6 * most)
    assert np.all(np.asarray(machine.voltage(found, w)) <= v_max * (1.0 + 1e-6))
    angle, share = np.linspace(0.0, 2.0 * np.pi, 721), np.linspace(0.0, 1.0, 201)[:, None]
    tried = DqCurrents(jnp.asarray(i_max * share * np.cos(angle)), jnp.asarray(i_max * share * np.sin(angle)))
    fits = np.asarray(machine.voltage(tried, w)) <= v_max
    if np.any(fits):
        assert np.all(size <= i_max * (1.0 + 1e-6))
        possible = np.asarray(machine.torque(tried))[fits]
        nearest = np.clip(wanted, np.min(possible), np.max(possible))
        assert np.all(np.abs(torque - wanted) <= np.abs(nearest - wanted) + 1e-6 * most)
    else:
        assert np.ptp(size) <= 1e-6 * np.max(size) or np.all(size <= i_max * (1.0 + 1e-6))


@pytest.mark.thorough
@pytest.mark.parametrize("wanted", [3.0, -3.0])
def test_what_is_within_the_limits_is_given(wanted: float) -> None:
    for w in (0.0, 900.0, 1500.0, -1500.0):
        found = SURFACE.currents(wanted, w, 13.5, 120.0)
        np.testing.assert_allclose(SURFACE.torque(found), wanted, rtol=1e-12)
        assert SURFACE.voltage(found, w) <= 13.5 * (1.0 + 1e-12)


@pytest.mark.parametrize("psi", [1e-6, 1e-3, 1.0])
def test_a_machine_that_lives_on_its_reluctance_or_on_its_magnets(psi: float) -> None:
    """The MTPA currents for a torque are those for the amplitude that gives this torque."""
    machine = DqMachine(p=2, psi=psi, Ld=1e-3, Lq=8e-3)
    wanted = machine.most_per_ampere(40.0)
    found = machine.least_for(machine.torque(wanted))
    np.testing.assert_allclose(np.array(found), np.array(wanted), rtol=1e-10)


@pytest.mark.thorough
def test_the_best_currents_are_differentiable_in_data_and_limits() -> None:
    def numbers(x: Any) -> Any:
        p, psi, Ld, Lq, Rs, T, w, v, i = x
        found = DqMachine(p=p, psi=psi, Ld=Ld, Lq=Lq, Rs=Rs).currents(T, w, v, i)
        return jnp.stack(found)

    draw = np.random.default_rng(0)
    x = draw.uniform(0.3, 1.8, (200, 9))
    x[:, 5:7] = 2.0 * draw.normal(size=(200, 2))
    way = x * draw.normal(size=x.shape)
    both = jax.jit(jax.vmap(lambda x, way: jax.jvp(numbers, (x,), (way,))[1]))
    value, reverse = jax.jit(jax.vmap(numbers)), jax.jit(jax.vmap(jax.jacrev(numbers)))
    forward = both(x, way)
    differences = (value(x + 1e-6 * way) - value(x - 1e-6 * way)) / 2e-6
    size = 1.0 + np.max(np.abs(forward), axis=1, keepdims=True)
    np.testing.assert_array_less(np.abs(forward - differences) / size, 1e-5)
    np.testing.assert_allclose(np.einsum("nij,nj->ni", reverse(x), way) / size, forward / size, atol=1e-9)


def held_machine(source: Any, inverter: Any, motor: Any, wall: Any, zero: Any, full: Any, ground: Any) -> Connections:
    return (
        connect(source.p, inverter.p),
        connect(source.n, inverter.n, ground.p),
        connect(inverter.machine, motor.terminals),
        connect(motor.shaft, wall.flange),
        connect(zero.y, inverter.u_d),
        connect(full.y, inverter.u_q),
    )


@pytest.mark.thorough
def test_stall_at_the_voltage_limit() -> None:
    """i_q = V/(sqrt(3) Rs) (1 - exp(-Rs t/Lq)); in the end the power of the supply is 3/2 Rs i_q^2."""
    machine = DqMachine(p=4, psi=0.012, Ld=60e-6, Lq=80e-6, Rs=0.05)
    parts = (
        electrical.ConstantVoltage(V=12.0),
        electrical.Inverter(),
        electrical.PMSM(machine=machine, J=1e-4),
        rotational.Fixed(),
        blocks.Constant(k=0.0),
        blocks.Constant(k=1.0),  # more than the inverter can give
        electrical.Ground(),
    )
    solution = simulate(Rig(parts=parts, wiring=held_machine), 2e-2, rtol=1e-9, save="steps", energy=True)
    last = 12.0 / np.sqrt(3.0) / 0.05
    times, motor = np.asarray(solution.ts), solution.parts[2]
    np.testing.assert_allclose(motor.i_q, last * (1.0 - np.exp(-times * 0.05 / 80e-6)), rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(motor.torque[-1], 6.0 * 0.012 * last, rtol=1e-5)
    np.testing.assert_allclose(-12.0 * solution.parts[0].i[-1], 1.5 * 0.05 * last**2, rtol=1e-5)
    assert abs(solution.energy.imbalance) < 1e-6 * float(np.sum(solution.energy.supplied["parts[0]"]))
    at_rest = machine.currents(100.0, 0.0, 12.0 / np.sqrt(3.0), 1e3)
    np.testing.assert_allclose(machine.voltage(at_rest, 0.0), 12.0 / np.sqrt(3.0), rtol=1e-12)
    assert machine.torque(at_rest) > 6.0 * 0.012 * last  # it uses the reluctance, too


def under_current_control(
    source: Any, inverter: Any, sensor: Any, motor: Any, wall: Any, none: Any, wanted: Any, along: Any, across: Any,
    ground: Any,
) -> Connections:  # fmt: skip
    return (
        connect(source.p, inverter.p),
        connect(source.n, inverter.n, ground.p),
        connect(inverter.machine, sensor.p),
        connect(sensor.n, motor.terminals),
        connect(motor.shaft, wall.flange),
        connect(none.y, along.u_s),
        connect(wanted.y, across.u_s),
        connect(sensor.y_d, along.u_m),
        connect(sensor.y_q, across.u_m),
        connect(along.y, inverter.u_d),
        connect(across.y, inverter.u_q),
    )


@pytest.mark.thorough
def test_current_control_of_a_held_machine() -> None:
    """With k = Lq w_c/V and Ti = Lq/Rs the zero of the controller cancels the winding: i_q = i (1 - exp(-w_c t))."""
    machine, bandwidth, voltage = DqMachine(p=4, psi=0.012, Ld=60e-6, Lq=80e-6, Rs=0.05), 1e3, 48.0
    parts = (
        electrical.ConstantVoltage(V=voltage),
        electrical.Inverter(),
        electrical.DqCurrentSensor(),
        electrical.PMSM(machine=machine, J=1e-4),
        rotational.Fixed(),
        blocks.Constant(k=0.0),
        blocks.Constant(k=20.0),
        *(
            blocks.LimPI(k=inductance * bandwidth / voltage, Ti=inductance / 0.05, y_max=1.0, y_min=-1.0)
            for inductance in (60e-6, 80e-6)
        ),
        electrical.Ground(),
    )
    solution = simulate(Rig(parts=parts, wiring=under_current_control), 5e-3, rtol=1e-9, save="steps")
    motor, times = solution.parts[3], np.asarray(solution.ts)
    np.testing.assert_allclose(motor.i_q, 20.0 * (1.0 - np.exp(-bandwidth * times)), atol=20e-7)
    np.testing.assert_allclose(motor.i_d, 0.0, atol=1e-7)


def driven(battery: Any, cable: Any, drive: Any, demand: Any, load: Any, ground: Any) -> Connections:
    return (
        connect(battery.p, cable.p),
        connect(cable.n, drive.p),
        connect(drive.n, battery.n, ground.p),
        connect(demand.y, drive.u),
        connect(drive.shaft, load.a),
    )


@pytest.mark.thorough
def test_a_drive_on_a_battery_runs_up_through_its_limits() -> None:
    machine = DqMachine(p=4, psi=0.012, Ld=60e-6, Lq=60e-6, Rs=0.01)
    parts = (
        electrical.Battery(Q=3600.0, charges=[0.0, 1.0], voltages=[20.0, 26.0], R0=0.01, R=[0.01], C=[100.0], soc=0.9),
        electrical.Cable(length=2.0, area=10e-6),
        electrical.PMSMDrive(machine=machine, J=1e-4, i_max=120.0, C=2e-3, v=25.0),
        blocks.Constant(k=10.0),
        rotational.Inertia(J=9e-3),
        electrical.Ground(),
    )
    solution = simulate(Rig(parts=parts, wiring=driven), 0.6, rtol=1e-8, save="steps", energy=True)
    drive = solution.parts[2]
    np.testing.assert_allclose(np.max(drive.torque), 6.0 * 0.012 * 120.0, rtol=1e-9)
    found = machine.currents(drive.wanted[-1], 4.0 * drive.w[-1], drive.v[-1] / np.sqrt(3.0), 120.0)
    np.testing.assert_allclose(np.array([drive.i_d[-1], drive.i_q[-1]]), np.array(found), rtol=1e-9)
    assert drive.i_d[-1] < -10.0
    lost = float(sum(np.sum(value) for value in solution.energy.dissipated.values()))
    assert abs(solution.energy.imbalance) < 1e-6 * lost


def discharged(battery: Any, load: Any, switch: Any, ground: Any) -> Connections:
    return connect(battery.p, load.p), connect(battery.n, load.n, ground.p), connect(switch.y, load.u)


@pytest.mark.thorough
def test_a_battery_relaxes_after_a_pulse() -> None:
    I, off, Q = 80.0, 300.0, 36000.0  # noqa: E741
    pairs = ((0.8e-3, 2500.0), (1.5e-3, 40000.0))
    battery = electrical.Battery(
        Q=Q, charges=[0.0, 1.0], voltages=[3.2, 4.1], R0=2e-3, R=[0.8e-3, 1.5e-3], C=[2500.0, 40000.0], soc=0.8
    )
    pulse = blocks.Step(height=-I, offset=I, start_time=off)
    parts = (battery, electrical.SignalCurrent(), pulse, electrical.Ground())
    ts = np.array([1.0, 60.0, 299.0, 330.0, 900.0])
    solution = simulate(Rig(parts=parts, wiring=discharged), 900.0, rtol=1e-9, save=ts, energy=True)
    charged = np.minimum(ts, off)
    expected = 3.2 + 0.9 * (0.8 - I * charged / Q) - 2e-3 * I * (ts < off)
    for R, C in pairs:
        expected -= I * R * (1.0 - np.exp(-charged / (R * C))) * np.exp(-(ts - charged) / (R * C))
    np.testing.assert_allclose(solution.parts[0].v, expected, rtol=1e-7)
    np.testing.assert_allclose(expected, [3.7308345, 3.5001455, 2.9788221, 3.2477067, 3.3199946], rtol=1e-7)


def heated(source: Any, motor: Any, wall: Any, room: Any, ground: Any) -> Connections:
    return (
        connect(source.n, motor.p),
        connect(source.p, motor.n, ground.p),
        connect(motor.shaft, wall.flange),
        connect(motor.ambient, room.port),
    )


@pytest.mark.thorough
def test_a_held_motor_warms_as_the_linear_equations_say() -> None:
    I, R, alpha, Cw, Ch, Gwh, Gha, Ta = 12.0, 0.35, 3.93e-3, 45.0, 220.0, 1.2, 0.9, 298.15  # noqa: E741
    motor = electrical.BrushedMotor(
        R=R, k=0.05, J=1e-4, winding=Cw, housing=Ch, G_wh=Gwh, G_ha=Gha, alpha=alpha, T_ref=293.15, T=Ta
    )
    parts = (
        electrical.ConstantCurrent(I=I),
        motor,
        rotational.Fixed(),
        thermal.FixedTemperature(temperature=Ta),
        electrical.Ground(),
    )
    ts = np.array([10.0, 300.0, 3000.0])
    solution = simulate(Rig(parts=parts, wiring=heated), 3000.0, rtol=1e-9, save=ts)
    grow = I**2 * R * alpha
    A = np.array([[(grow - Gwh) / Cw, Gwh / Cw], [Gwh / Ch, -(Gwh + Gha) / Ch]])
    steady = Ta + np.linalg.solve(-A, [I**2 * R * (1.0 + alpha * 5.0) / Cw, 0.0])
    expected = np.stack([steady + expm(A * t) @ (Ta - steady) for t in ts])
    found = np.stack([solution.parts[1].winding.T, solution.parts[1].housing.T], axis=1)
    np.testing.assert_allclose(found, expected, rtol=1e-8)
    np.testing.assert_allclose(found[:, 0] - 273.15, [35.262287500006, 119.622133037068, 187.370162327446], rtol=1e-7)


@pytest.mark.parametrize("reference", [273.15, 293.15, 298.15, quantity(25, "degC")])
def test_a_winding_is_of_copper_whatever_temperature_its_resistance_is_given_for(reference: Any) -> None:
    """IEC 60028: 0.00393 1/K at 20 C, so that 100 K above it the resistance is 1.393 times that at 20 C."""
    winding = electrical.BrushedMotor(
        R=0.3, k=0.05, J=1e-4, winding=45.0, housing=220.0, G_wh=1.2, G_ha=0.9, T_ref=reference
    ).resistor
    cool, warm = (1.0 + winding.alpha * (T - winding.T_ref) for T in (293.15, 393.15))
    assert warm / cool == pytest.approx(1.393, rel=1e-12)


def test_laws_of_the_motor_s_parts() -> None:
    drop = electrical.BrushDrop(V=1.5, i_0=0.1)
    check_law(drop, {"i": [-5.0, 0.0, 0.1]}, {"v": [-1.5, 0.0, 1.5 * np.tanh(1.0)]})
    emf = electrical.MagnetEMF(k_ref=0.05, alpha=-2e-3)
    check_law(emf, {"heat.T": 343.15, "w": 100.0, "n.v": 0.0}, {"k": 0.045, "p.v": 4.5, "heat.Q_flow": 0.0})
    check_law(rotational.IronLoss(T_h=2e-3, k_e=1e-5), {"w": [-300.0, 300.0]}, {"flange.tau": [-5e-3, 5e-3]})


def test_a_bridge_takes_back_the_duty_at_the_limit_of_the_current() -> None:
    bridge = electrical.CurrentLimitedBridge(i_max=10.0, band=1.0, Ron=0.01)
    given: dict[str, Any] = {"duty.value": [0.5, 1.7, 1.0, 1.0, -1.0], "i2": [-4.0, -8.0, -9.5, -11.0, 9.5], "v1": 24.0}
    m = np.array([0.5, 1.0, 0.5, -1.0, -0.5])
    i = -np.array(given["i2"])
    check_law(bridge, given, {"m": m, "v2": 24.0 * m - 0.02 * i, "i1": m * i})


@pytest.mark.thorough
def test_a_solenoid_gives_the_force_of_its_data_sheet_and_stores_its_work() -> None:
    coil = electrical.DataSheetSolenoid(R=7.0, L_0=0.1, rated=2.0, positions=[0.0, 1e-3, 3e-3], forces=[5.0, 5.0, 5.0])
    given: dict[str, Any] = {"i": [2.0, 1.0], "rod.s": [2e-3, 0.5e-3]}
    check_law(coil, given, {"rod.f": [-5.0, -1.25], "L": [0.1 + 2.0 / 4.0 * 5.0 * 2e-3, 0.1 + 0.5 * 5.0 * 0.5e-3]})
    with pytest.raises(ParameterError, match="forces must be nonnegative"):
        electrical.DataSheetSolenoid(R=7.0, L_0=0.1, rated=2.0, positions=[0.0, 1e-3], forces=[5.0, -5.0])


def counted(turning: Any, encoder: Any) -> Connections:
    return (connect(turning.flange, encoder.flange),)


@pytest.mark.thorough
def test_an_encoder_counts() -> None:
    """At 1 rad/s and a step of 2 pi/100 = 62.8 ms: readings after each 100 ms see one or two counts more."""
    parts = (rotational.ConstantSpeed(speed=1.0), rotational.Encoder(counts=100.0, period=0.1))
    ts = np.array([0.05, 0.15, 0.25, 0.35, 0.45])
    encoder = simulate(Rig(parts=parts, wiring=counted), 0.5, save=ts).parts[1]
    step = 2.0 * np.pi / 100.0
    np.testing.assert_allclose(encoder.angle.value, step * np.array([0.0, 1.0, 3.0, 4.0, 6.0]), rtol=1e-12)
    np.testing.assert_allclose(encoder.speed.value, step / 0.1 * np.array([0.0, 1.0, 2.0, 1.0, 2.0]), rtol=1e-12)


def test_a_cable_has_the_resistance_of_both_conductors() -> None:
    """IEC 60228: 1 mm2 of annealed copper at 20 C has 17.24 mohm/m."""
    np.testing.assert_allclose(electrical.Cable(length=5.0, area=1e-6).R, 0.17241, rtol=1e-4)
    with pytest.raises(ParameterError, match="alpha must give a nonnegative resistance"):
        electrical.Cable(length=5.0, area=1e-6, temperature=20.0)


@pytest.mark.thorough
def test_a_battery_refuses_pairs_that_do_not_match() -> None:
    with pytest.raises(ParameterError, match="C must have one number for each of R"):
        electrical.Battery(Q=1.0, charges=[0.0, 1.0], voltages=[3.0, 4.0], R0=0.1, R=[0.1, 0.2], C=[1.0])
