"""Induction machine, stepper, linear motors and field-oriented control against closed forms."""

from typing import Any

import jax.numpy as jnp
import numpy as np
import pytest
from _rig import Rig

from acausal import Connections, connect, linearise, simulate
from acausal.testing import check_law
from components import blocks, electrical, rotational, translational
from components.electrical import InductionMachine

V, F = 325.0, 50.0
MOTOR: dict[str, Any] = dict(p=2.0, Rr=1.8, Lm=0.2, Lssigma=8e-3, Lrsigma=9e-3, J=0.01)
MACHINE = electrical.DqMachine(p=4.0, psi=0.03, Ld=0.4e-3, Lq=0.5e-3, Rs=0.1)


def at_speeds(source: Any, ground: Any, *parts: Any) -> Connections:
    half = len(parts) // 2
    motors, drives = parts[:half], parts[half:]
    return (
        connect(source.phases, *(motor.phases for motor in motors)),
        connect(source.n, ground.p),
        *(connect(motor.shaft, drive.flange) for motor, drive in zip(motors, drives, strict=True)),
    )


def circuit_torque(slip: float, Rs: float) -> float:
    """Torque of the equivalent circuit of a phase in steady state."""
    w, m = 2.0 * np.pi * F, MOTOR
    rotor = m["Rr"] / slip + 1j * w * m["Lrsigma"]
    main = 1j * w * m["Lm"] * rotor / (1j * w * m["Lm"] + rotor)
    i = V / (Rs + 1j * w * m["Lssigma"] + main)
    return 1.5 * abs(i * main / rotor) ** 2 * m["Rr"] / slip / (w / m["p"])


@pytest.mark.thorough
def test_the_torque_curve_of_an_induction_machine_is_that_of_kloss() -> None:
    slips = np.array([0.03, 0.3, -0.1, 0.03])
    # From the steady flux of the stator: without Rs, the transient of another one would not decay.
    plain = InductionMachine(psi_im=-V / (2.0 * np.pi * F), **MOTOR)
    motors = plain, plain, plain, InductionMachine(Rs=1.7, **MOTOR)
    drives = [rotational.ConstantSpeed(speed=np.pi * F * (1.0 - slip)) for slip in slips]
    parts = (electrical.ThreePhaseSource(V=V, f=F), electrical.Ground(), *motors, *drives)
    solution = simulate(Rig(parts=parts, wiring=at_speeds), 0.6, rtol=1e-8, save="end")
    found = [float(solution.final.parts[2 + i].torque) for i in range(4)]
    most, pull_out = (float(item) for item in plain.pull_out(V, F))
    kloss = 2.0 * most / (slips / pull_out + pull_out / slips)
    np.testing.assert_allclose(found[:3], kloss[:3], rtol=1e-6)
    assert circuit_torque(0.3, 0.0) == pytest.approx(kloss[1], rel=1e-12)
    assert found[3] == pytest.approx(circuit_torque(0.03, 1.7), rel=1e-5)


def controlled(*parts: Any) -> Connections:
    source, inverter, sensor, motor, drive, speed, link, control, d_set, q_set, ground = parts
    return (
        connect(source.p, inverter.p, link.p),
        connect(source.n, inverter.n, link.n, ground.p),
        connect(inverter.machine, sensor.p),
        connect(sensor.n, motor.terminals),
        connect(motor.shaft, drive.flange, speed.flange),
        connect(speed.y, control.w),
        connect(link.y, control.v_dc),
        connect(sensor.y_d, control.i_d),
        connect(sensor.y_q, control.i_q),
        connect(d_set.y, control.i_d_set),
        connect(q_set.y, control.i_q_set),
        connect(control.u_d, inverter.u_d),
        connect(control.u_q, inverter.u_q),
    )


@pytest.mark.thorough
def test_controlled_currents_follow_their_setpoints_as_a_lag_at_speed() -> None:
    """At 100 rad/s, -5 A and 10 A are reached as 1 - exp(-b t) from the currents at the start, without coupling."""
    b = 2000.0
    parts = (
        electrical.ConstantVoltage(V=48.0),
        electrical.Inverter(),
        electrical.DqCurrentSensor(),
        electrical.PMSM(machine=MACHINE, J=1e-4),
        rotational.ConstantSpeed(speed=100.0),
        rotational.SpeedSensor(),
        electrical.VoltageSensor(),
        electrical.FieldOrientedController(machine=MACHINE, bandwidth=b),
        blocks.Constant(k=-5.0),
        blocks.Step(height=10.0, start_time=1e-3),
        electrical.Ground(),
    )
    t = np.array([0.5e-3, 1e-3, 1.3e-3, 2e-3, 4e-3])
    solution = simulate(Rig(parts=parts, wiring=controlled), 4e-3, save=jnp.asarray(t), rtol=1e-9)
    np.testing.assert_allclose(solution.parts[3].i_d, -5.0 * -np.expm1(-b * t), rtol=1e-6)
    later = np.maximum(t - 1e-3, 0.0)
    np.testing.assert_allclose(solution.parts[3].i_q, 10.0 * -np.expm1(-b * later), rtol=1e-6, atol=1e-7)


def test_the_voltage_of_the_controller_is_limited_without_windup() -> None:
    """Beyond the limit, the output keeps the direction, and the integral parts fall back."""
    control = electrical.FieldOrientedController(machine=MACHINE, bandwidth=1000.0, m_max=0.5)
    given = {"i_d_set.value": 0.0, "i_q_set.value": 0.0, "i_d.value": 0.0, "i_q.value": 0.0, "w.value": 0.0}
    given |= {"v_dc.value": 10.0, "x_d": 6.0, "x_q": 8.0}
    expected = {"u_d.value": 0.3, "u_q.value": 0.4, "der(x_d)": -3000.0, "der(x_q)": -4000.0}
    check_law(control, given=given, expected=expected)


def test_setpoints_are_those_of_most_torque_per_ampere() -> None:
    control = electrical.CurrentSetpoints(machine=MACHINE, i_max=40.0)
    best = MACHINE.least_for(1.5)
    given = {"torque.value": 1.5, "w.value": 10.0, "v_dc.value": 48.0}
    check_law(control, given=given, expected={"i_d.value": float(best.d), "i_q.value": float(best.q)})


def test_the_symmetric_optimum_has_its_phase_margin() -> None:
    K, T, a = 50.0, 2e-3, 3.0
    control = blocks.LimPI.symmetric_optimum(K=K, T=T, y_max=1.0, a=a)
    s = 1j / (a * T)
    loop = float(control.k) * (1.0 + 1.0 / (float(control.Ti) * s)) * K / (s * (1.0 + T * s))
    assert abs(loop) == pytest.approx(1.0, rel=1e-12)
    assert np.angle(-loop) == pytest.approx(np.arctan(a) - np.arctan(1.0 / a), rel=1e-12)


def test_phases_of_rotor_coordinates_and_back() -> None:
    phi = np.array([0.0, 0.3, 2.0])
    angle = [3.0 * phi - 2.0 * np.pi * k / 3.0 for k in range(3)]
    expected = {f"y_{x}.value": 0.4 * np.cos(angle[k]) - 0.7 * np.sin(angle[k]) for k, x in enumerate("abc")}
    given = {"u_d.value": 0.4, "u_q.value": 0.7, "phi.value": phi}
    check_law(electrical.RotorToPhases(p=3.0), given=given, expected=expected)
    given = {f"phases.v_{x}": np.asarray(expected[f"y_{x}.value"]) for x in "abc"} | {"shaft.phi": phi}
    back = {"machine.v_d": [0.4] * 3, "machine.v_q": [0.7] * 3}
    check_law(electrical.DqTerminals(p=3.0), given=given, expected=back)


def test_a_stepper_holds_with_both_phases_and_steps_by_a_quarter_of_a_tooth() -> None:
    motor = electrical.StepperMotor(R=1.0, L=2e-3, k=0.4, N=50.0, J=3e-5, detent=0.02)
    step = 0.5 * np.pi / 50.0
    check_law(
        motor,
        given={"i_A": [2.0, 0.0, 2.0], "i_B": [0.0, 2.0, 2.0], "shaft.phi": [0.0, step, -0.5 * step]},
        expected={"torque": [0.0, 0.0, 0.8 * np.sqrt(2.0)]},
    )


def test_a_linear_motor_is_a_rotating_one_unrolled() -> None:
    """With pi/tau_p in place of the pole pairs, force and induced voltages are those of `DqMachine`."""
    data: dict[str, Any] = dict(psi=0.06, Ld=8e-3, Lq=9e-3, Rs=2.7)
    motor = electrical.LinearSynchronousMotor(tau_p=0.016, m=1.2, cogging=5.0, **data)
    twin = electrical.DqMachine(p=np.pi / 0.016, **data)
    i = electrical.DqCurrents(-1.0, 3.0)
    v_d, v_q = twin.voltages(i, twin.p * 0.5)
    given = {"i_d": i.d, "i_q": i.q, "v": 0.5, "rod.s": 0.004, "terminals.v_d": 50.0, "terminals.v_q": 90.0}
    expected = {"force": twin.torque(i) - 5.0, "der(i_d)": (50.0 - v_d) / 8e-3, "der(i_q)": (90.0 - v_q) / 9e-3}
    check_law(motor, given=given, expected={name: float(value) for name, value in expected.items()})


def pushed(signal: Any, source: Any, coil: Any, sensor: Any, ground: Any) -> Connections:
    return (
        connect(signal.y, source.u),
        connect(source.p, coil.p),
        connect(source.n, coil.n, ground.p),
        connect(coil.rod, sensor.flange),
    )


def test_a_voice_coil_has_its_electrical_and_mechanical_poles() -> None:
    """m L s^2 + m R s + k^2 = 0, and the speed without load is v/k."""
    R, L, k, m = 4.0, 1.5e-3, 12.0, 0.05
    parts = (
        blocks.Constant(k=0.0),
        electrical.SignalVoltage(),
        electrical.VoiceCoil(R=R, L=L, k=k, m=m),
        translational.SpeedSensor(),
        electrical.Ground(),
    )
    system = linearise(Rig(parts=parts, wiring=pushed), inputs=["parts[0].k"], outputs=["parts[3].y.value"])
    poles = np.sort_complex(np.asarray(system.poles))
    poles = poles[np.abs(poles) > 1e-9]  # without that of the position
    np.testing.assert_allclose(poles, np.sort_complex(np.roots([m * L, m * R, k**2])), rtol=1e-9)
    static = complex(np.ravel(system.frequency_response(np.array([1e-6])))[0])
    assert abs(static) == pytest.approx(1.0 / k, rel=1e-6)
