"""Two-ports, controlled and variable elements, diode, coil and amplifier against closed forms."""

from typing import Any

import jax.numpy as jnp
import numpy as np
import pytest
from _rig import Rig
from scipy import linalg, optimize

from acausal import Component, Connections, ParameterError, connect, simulate
from components import blocks, electrical, rotational, thermal, translational
from components.electrical import Capacitor, ConstantVoltage, Ground, Inductor, Resistor

TIMES = jnp.linspace(0.0, 1.0, 6)


def wire_transformer(source: Any, resistor: Any, transformer: Any, load: Any, ground: Any) -> Connections:
    return (
        connect(source.p, resistor.p),
        connect(resistor.n, transformer.p1),
        connect(transformer.p2, load.p),
        connect(source.n, transformer.n1, transformer.n2, load.n, ground.p),
    )


@pytest.mark.thorough
def test_transformer() -> None:
    """A step on the primary side: [[L1, M], [M, L2]] di/dt = (V - R1 i1, -R2 i2)."""
    coils = np.array([[1.3, 0.7], [0.7, 0.9]])
    transformer = electrical.Transformer(L1=1.3, L2=0.9, M=0.7)
    rig = Rig(
        parts=(ConstantVoltage(V=5.0), Resistor(R=0.8), transformer, Resistor(R=1.5), Ground()), wiring=wire_transformer
    )
    solution = simulate(rig, 1.0, save=TIMES, rtol=1e-9)
    matrix = -np.linalg.solve(coils, np.diag([0.8, 1.5]))
    stationary = np.array([5.0 / 0.8, 0.0])
    exact = np.stack([stationary - linalg.expm(matrix * t) @ stationary for t in np.asarray(TIMES)])
    np.testing.assert_allclose(solution["parts[2].i1"], exact[:, 0], atol=1e-7)
    np.testing.assert_allclose(solution["parts[2].i2"], exact[:, 1], atol=1e-7)


def test_perfectly_coupled_coils_are_refused() -> None:
    with pytest.raises(ParameterError, match=r"Transformer.M must be smaller in absolute value than sqrt\(L1 L2\)"):
        electrical.Transformer(L1=4.0, L2=1.0, M=-2.0)


V1, R1, R2 = 5.0, 0.8, 1.5


@pytest.mark.parametrize(
    ("part", "i1", "v2"),
    [
        (electrical.IdealTransformer(n=2.0), V1 / (R1 + 4.0 * R2), R2 * 2.0 * V1 / (R1 + 4.0 * R2)),
        (electrical.Gyrator(G=0.5), V1 / (R1 + 4.0 / R2), 2.0 * V1 / (R1 + 4.0 / R2)),
        (electrical.VCV(gain=3.0), 0.0, 3.0 * V1),
        (electrical.VCC(G=0.4), 0.0, -R2 * 0.4 * V1),
        (electrical.CCV(R=3.0), V1 / R1, 3.0 * V1 / R1),
        (electrical.CCC(gain=0.4), V1 / R1, -R2 * 0.4 * V1 / R1),
    ],
    ids=lambda item: type(item).__name__,
)
def test_two_port_between_source_and_load(part: Component, i1: float, v2: float) -> None:
    """A source V1 with inner resistance R1 at port 1, a resistor R2 at port 2."""
    rig = Rig(parts=(ConstantVoltage(V=V1), Resistor(R=R1), part, Resistor(R=R2), Ground()), wiring=wire_transformer)
    end = simulate(rig, 1.0, save="end").final.parts[2]
    np.testing.assert_allclose([end.i1, end.v2], [i1, v2], rtol=1e-9, atol=1e-12)


def wire_bridge(supply: Any, bridge: Any, motor: Any, duty: Any, ground: Any) -> Connections:
    return (
        connect(duty.y, bridge.duty),
        connect(supply.p, bridge.p1),
        connect(bridge.p2, motor.p),
        connect(supply.n, bridge.n1, bridge.n2, motor.n, ground.p),
    )


@pytest.mark.thorough
def test_averaged_bridge_draws_the_power_it_gives() -> None:
    """At rest, the motor draws duty V / R and the supply delivers duty times that."""
    motor = electrical.DCMotor(R=0.5, k=0.1, J=1e-3)
    parts = (ConstantVoltage(V=24.0), electrical.AveragedBridge(), motor, blocks.Constant(k=-0.25), Ground())
    solution = simulate(Rig(parts=parts, wiring=wire_bridge), 3.0, save=jnp.array([0.0, 3.0]), rtol=1e-9)
    np.testing.assert_allclose(solution["parts[1].i2"][0], 12.0, rtol=1e-12)
    np.testing.assert_allclose(solution["parts[0].i"][0], -3.0, rtol=1e-12)
    np.testing.assert_allclose(solution["parts[2].rotor.w"][-1], -6.0 / 0.1, rtol=1e-9)


def wire_series(source: Any, first: Any, second: Any, ground: Any) -> Connections:
    return (
        connect(source.p, first.p),
        connect(first.n, second.p),
        connect(second.n, source.n, ground.p),
    )


@pytest.mark.parametrize("V", [0.5, 5.0, -5.0])
def test_diode_and_resistor(V: float) -> None:
    """Within and beyond its exponential part, and in reverse, against the root of V = R i + v."""
    diode = electrical.Diode(Ids=1e-6, Vt=0.04, R=1e8, max_exponent=13.0)
    parts = (ConstantVoltage(V=V), Resistor(R=10.0), diode, Ground())
    end = simulate(Rig(parts=parts, wiring=wire_series), 1.0, save="end", rtol=1e-10).final.parts[2]

    def current(v: float) -> float:
        x = v / 0.04
        exponential = np.exp(x) if x < 13.0 else np.exp(13.0) * (1.0 + x - 13.0)
        return 1e-6 * (exponential - 1.0) + v / 1e8

    v: Any = optimize.brentq(lambda v: V - 10.0 * current(v) - v, -6.0, 6.0, xtol=1e-14)
    np.testing.assert_allclose(end.v, v, rtol=1e-7)
    np.testing.assert_allclose(end.i, current(v), rtol=1e-6)


def wire_signal(source: Any, resistor: Any, part: Any, signal: Any, ground: Any) -> Connections:
    return (*wire_series(source, resistor, part, ground), connect(signal.y, part.u))


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("part", "charge"), [(electrical.VariableCapacitor(Q=3.0), "Q"), (electrical.VariableInductor(Psi=3.0), "Psi")]
)
def test_charge_of_variable_capacitor_and_flux_of_variable_inductor(part: Component, charge: str) -> None:
    """u = 1 + t/2, on a resistor: R dQ/dt = -Q/u, and dPsi/dt = -R Psi/u, so that both go as u^-2 for R = 1."""
    ramp = blocks.Ramp(height=1.0, duration=2.0, offset=1.0)
    rig = Rig(parts=(ConstantVoltage(V=0.0), Resistor(R=1.0), part, ramp, Ground()), wiring=wire_signal)
    solution = simulate(rig, 1.0, save=TIMES, rtol=1e-9, energy=True)
    np.testing.assert_allclose(solution[f"parts[2].{charge}"], 3.0 * (1.0 + 0.5 * TIMES) ** -2.0, atol=1e-7)
    assert abs(solution.energy.imbalance) < 1e-6


@pytest.mark.thorough
def test_variable_resistor() -> None:
    rig = Rig(
        parts=(ConstantVoltage(V=6.0), Resistor(R=1.0), electrical.VariableResistor(), blocks.Clock(), Ground()),
        wiring=wire_signal,
    )
    solution = simulate(rig, 1.0, save=TIMES)
    np.testing.assert_allclose(solution["parts[2].i"], 6.0 / (1.0 + TIMES), rtol=1e-12)


def wire_potentiometer(source: Any, part: Any, load: Any, signal: Any, ground: Any) -> Connections:
    return (
        connect(signal.y, part.u),
        connect(source.p, part.p),
        connect(part.contact, load.p),
        connect(source.n, part.n, load.n, ground.p),
    )


@pytest.mark.parametrize("u", [0.0, 0.3, 1.0])
def test_loaded_potentiometer(u: float) -> None:
    """The voltage divider of (1 - u) R with u R parallel to the load, its ends included."""
    parts = (
        ConstantVoltage(V=6.0),
        electrical.Potentiometer(R=2.0),
        electrical.Conductor(G=0.25),
        blocks.Constant(k=u),
        Ground(),
    )
    end = simulate(Rig(parts=parts, wiring=wire_potentiometer), 1.0, save="end").final.parts[2]
    lower = 2.0 * u / (1.0 + 0.25 * 2.0 * u)
    np.testing.assert_allclose(end.v, 6.0 * lower / (2.0 * (1.0 - u) + lower), rtol=1e-9, atol=1e-12)


def wire_heating(source: Any, part: Any, body: Any, ground: Any) -> Connections:
    return (
        connect(source.p, part.p),
        connect(source.n, part.n, ground.p),
        connect(part.heat, body.port),
    )


def test_heating_resistor_warms_its_body() -> None:
    """C dT/dt = V^2 / R(T): with r = 1 + alpha (T - T_ref), r^2 = 1 + 2 alpha V^2 t / (C R_ref)."""
    part = electrical.HeatingResistor(R_ref=2.0, T_ref=300.0, alpha=4e-3)
    parts = (ConstantVoltage(V=10.0), part, thermal.HeatCapacitor(C=5.0, T=300.0), Ground())
    solution = simulate(Rig(parts=parts, wiring=wire_heating), 20.0, save="end", rtol=1e-9, energy=True)
    r = np.sqrt(1.0 + 2.0 * 4e-3 * 100.0 * 20.0 / (5.0 * 2.0))
    np.testing.assert_allclose(solution.final.parts[2].T, 300.0 + (r - 1.0) / 4e-3, rtol=1e-8)
    assert abs(solution.energy.imbalance) < 1e-5


def wire_amplifier(source: Any, resistor: Any, capacitor: Any, amplifier: Any, ground: Any) -> Connections:
    return (
        connect(source.p, resistor.p),
        connect(resistor.n, amplifier.n, capacitor.p),
        connect(capacitor.n, amplifier.out),
        connect(source.n, amplifier.p, ground.p),
    )


def test_operational_amplifier_as_an_integrator() -> None:
    parts = (ConstantVoltage(V=2.0), Resistor(R=0.5), Capacitor(C=0.1), electrical.IdealOpAmp(), Ground())
    end = simulate(Rig(parts=parts, wiring=wire_amplifier), 3.0, save="end").final
    np.testing.assert_allclose(end.parts[3].out.v, -2.0 * 3.0 / (0.5 * 0.1), rtol=1e-9)


def wire_voice_coil(source: Any, resistor: Any, emf: Any, mass: Any, ground: Any) -> Connections:
    return (*wire_series(source, resistor, emf, ground), connect(emf.rod, mass.a))


@pytest.mark.thorough
def test_voice_coil_accelerates_a_mass() -> None:
    """v = V / k (1 - exp(-k^2 t / (R m)))."""
    parts = (
        ConstantVoltage(V=6.0),
        Resistor(R=2.0),
        electrical.TranslationalEMF(k=3.0),
        translational.Mass(m=1.5),
        Ground(),
    )
    solution = simulate(Rig(parts=parts, wiring=wire_voice_coil), 1.0, save=TIMES, rtol=1e-9)
    np.testing.assert_allclose(solution["parts[3].v"], 2.0 * (1.0 - np.exp(-3.0 * np.asarray(TIMES))), atol=1e-8)


def wire_stator(source: Any, coil: Any, emf: Any, rotor: Any, stator: Any, ground: Any) -> Connections:
    return (
        *wire_series(source, coil, emf, ground),
        connect(emf.shaft, rotor.a),
        connect(emf.support, stator.a),
    )


@pytest.mark.thorough
def test_stator_takes_the_reaction() -> None:
    """Free in space, rotor and stator turn against each other: their angular momentum stays zero."""
    parts = (
        ConstantVoltage(V=6.0),
        Inductor(L=0.1),
        electrical.EMF(k=0.5, support=rotational.Flange()),
        rotational.Inertia(J=0.2),
        rotational.Inertia(J=0.8),
        Ground(),
    )
    solution = simulate(Rig(parts=parts, wiring=wire_stator), 1.0, save=TIMES, rtol=1e-9)
    w, w_stator = solution["parts[3].w"], solution["parts[4].w"]
    np.testing.assert_allclose(0.2 * w + 0.8 * w_stator, 0.0, atol=1e-9)
    # i and the relative speed swing with w0^2 = k^2 / (L J'), where 1 / J' = 1 / J + 1 / J_stator.
    w0 = np.sqrt(0.25 / (0.1 * 0.16))
    np.testing.assert_allclose(w - w_stator, 12.0 * (1.0 - np.cos(w0 * np.asarray(TIMES))), atol=1e-7)
