"""A spring-applied brake against closed forms."""

import jax
import numpy as np
import pytest

from acausal import Component, Connections, ParameterError, Scalar, connect, replace, simulate
from components.blocks import Ramp, Staircase
from components.rotational import ConstantTorque, Inertia, SpringAppliedBrake

J, LOAD, SPRINGS = 2.0, 60.0, 150.0  # kg.m2, N.m, N.m


class Drum(Component):
    """The drum of a hoist with its load, held by a brake."""

    load: ConstantTorque
    drum: Inertia
    brake: SpringAppliedBrake
    release: Ramp | Staircase

    def connections(self) -> Connections:
        return (
            connect(self.load.flange, self.drum.a),
            connect(self.drum.b, self.brake.flange),
            connect(self.release.y, self.brake.u),
        )


def drum(release: Ramp | Staircase, peak: float = 1.0) -> Drum:
    brake = SpringAppliedBrake(torque=SPRINGS, peak=peak)
    return Drum(load=ConstantTorque(torque=LOAD), drum=Inertia(J=J), brake=brake, release=release)


def test_a_brake_that_is_released_slowly() -> None:
    """It slips when springs (1 - t/T) = load; then J dw/dt = load - springs (1 - t/T), and J dw/dt = load from T on."""
    T = 0.5
    slips = T * (1.0 - LOAD / SPRINGS)
    run = simulate(drum(Ramp(height=1.0, duration=T)), 0.7, save=[0.2, 0.4, 0.5, 0.7], rtol=1e-9, energy=True)

    def speed(t: float) -> float:
        return SPRINGS / (2.0 * J * T) * (min(t, T) - slips) ** 2 + LOAD / J * max(t - T, 0.0)

    np.testing.assert_allclose(run["drum.w"], [0.0, *map(speed, (0.4, 0.5, 0.7))], rtol=1e-6, atol=1e-7)
    np.testing.assert_allclose(run["brake.tau"], [LOAD, SPRINGS * 0.2, 0.0, 0.0], rtol=1e-6, atol=1e-7)
    assert abs(run.energy.imbalance) < 1e-6


def test_a_static_level_above_the_sliding_one() -> None:
    """With peak, it holds longer, and then slips with a jump of the torque."""
    T = 0.5
    slips = T * (1.0 - LOAD / (1.25 * SPRINGS))
    run = simulate(drum(Ramp(height=1.0, duration=T), peak=1.25), 0.5, save=[slips - 1e-4, slips + 1e-4], rtol=1e-9)
    np.testing.assert_allclose(run["brake.tau"], [LOAD, LOAD / 1.25], rtol=1e-3)


def test_a_brake_stops_the_load_when_the_voltage_fails() -> None:
    """Free for 0.3 s, it then brakes with springs - load, rests, and holds; the way has a derivative."""
    model = drum(Staircase(times=[0.0, 0.3, 9.0], values=[1.0, 0.0]))
    fast, slow = LOAD / J, (SPRINGS - LOAD) / J
    stops = 0.3 * (1.0 + fast / slow)

    def way(torque: Scalar) -> Scalar:
        return simulate(replace(model, {"brake.torque": torque}), 1.0, save="end", rtol=1e-9).final.drum.a.phi

    value, slope = jax.value_and_grad(way)(SPRINGS)
    np.testing.assert_allclose(value, 0.5 * fast * 0.3**2 * (1.0 + fast / slow), rtol=1e-6)
    np.testing.assert_allclose(slope, -0.5 * fast**2 * 0.3**2 * J / (SPRINGS - LOAD) ** 2, rtol=1e-5)
    run = simulate(model, 1.0, save=[stops - 0.01, stops + 0.01], rtol=1e-9)
    np.testing.assert_allclose(run["drum.w"], [0.01 * slow, 0.0], atol=1e-6)
    np.testing.assert_allclose(run["brake.tau"], [SPRINGS, LOAD], rtol=1e-6)


def test_a_negative_signal_does_not_add_to_the_springs() -> None:
    """A load above the springs slips with J dw/dt = load - springs, for u = -0.5 as for u = 0."""
    load = 1.2 * SPRINGS
    model = replace(drum(Staircase(times=[0.0, 0.2, 9.0], values=[-0.5, 0.0])), {"load.torque": load})
    run = simulate(model, 0.5, save=[0.1, 0.3, 0.5], rtol=1e-9, energy=True)
    np.testing.assert_allclose(run["drum.w"], (load - SPRINGS) / J * np.array([0.1, 0.3, 0.5]), rtol=1e-6)
    np.testing.assert_allclose(run["brake.tau"], SPRINGS, rtol=1e-6)
    assert abs(run.energy.imbalance) < 1e-6


def test_what_a_spring_applied_brake_refuses() -> None:
    with pytest.raises(ParameterError, match="peak must be at least 1"):
        SpringAppliedBrake(torque=1.0, peak=0.9)
