"""A driver who follows a speed, against closed forms; the energy of a vehicle on a drive cycle."""

from typing import Any

import jax
import numpy as np
import pytest

from acausal import Component, Connections, Scalar, connect, replace, simulate
from acausal.testing import check_law
from components.blocks import Constant, FirstOrder, Gain, Input, LimPI, TimeSeries
from components.translational import Driver, SignalForce, SpeedSensor, Vehicle, eudc

CAR: dict[str, Any] = dict(m=1200.0, area=2.2, c_d=0.28, c_r=0.01, v_0=0.01)
G, RHO = 9.80665, 1.2
FORCE, BRAKE = 6e3, 12e3  # greatest forces, N


def test_the_commands_are_limited_and_exclude_each_other() -> None:
    """k (wp u_s - u_m + x) + u_ff, limited; the excess feeds back into the integral."""
    driver = Driver(k=0.5, Ti=2.0, wp=0.8, Ni=0.9, u_ff=Input())
    given = {"u_s.value": 10.0, "u_m.value": [9.0, 12.0, 0.0], "x": 0.2, "u_ff.value": 0.1}
    wanted = 0.5 * (8.0 - np.array([9.0, 12.0, 0.0]) + 0.2) + 0.1
    y = np.clip(wanted, -1.0, 1.0)
    error = 10.0 - np.array([9.0, 12.0, 0.0])
    expected = {
        "y.value": y,
        "traction.value": np.maximum(y, 0.0),
        "brake.value": np.maximum(-y, 0.0),
        "der(x)": (error + (y - wanted) / (0.5 * 0.9)) / 2.0,
    }
    check_law(driver, given=given, expected=expected)


class FedForward(Component):
    """A plant of first order whose controller knows the input that it needs."""

    setpoint: Constant
    inverse: Gain
    control: LimPI
    plant: FirstOrder

    def connections(self) -> Connections:
        return (
            connect(self.setpoint.y, self.control.u_s, self.inverse.u),
            connect(self.inverse.y, self.control.u_ff),  # pyright: ignore[reportArgumentType]
            connect(self.control.y, self.plant.u),
            connect(self.plant.y, self.control.u_m),
        )


def test_an_exact_feed_forward_leaves_nothing_to_the_integral() -> None:
    """With u = 1.5 / 3 the plant T dy/dt + y = 3 u stays at 1.5."""
    loop = FedForward(
        setpoint=Constant(k=1.5),
        inverse=Gain(k=1.0 / 3.0),
        control=LimPI(k=2.0, Ti=0.3, y_min=0.0, y_max=2.0, u_ff=Input()),
        plant=FirstOrder(T=0.5, k=3.0, x=1.5),
    )
    run = simulate(loop, 2.0, save=np.linspace(0.0, 2.0, 9), rtol=1e-9)
    np.testing.assert_allclose(run["control.x"], 0.0, atol=1e-12)
    np.testing.assert_allclose(run["plant.y.value"], 1.5, atol=1e-12)


class Trip(Component):
    """A car whose driver follows a drive cycle with a motor and brakes of limited force."""

    cycle: TimeSeries
    driver: Driver
    pedal: Gain
    brakes: Gain
    motor: SignalForce
    brake: SignalForce
    speed: SpeedSensor
    car: Vehicle

    def connections(self) -> Connections:
        return (
            connect(self.cycle.y, self.driver.u_s),
            connect(self.speed.y, self.driver.u_m),
            connect(self.driver.traction, self.pedal.u),
            connect(self.pedal.y, self.motor.u),
            connect(self.driver.brake, self.brakes.u),
            connect(self.brakes.y, self.brake.u),
            connect(self.motor.flange, self.brake.flange, self.speed.flange, self.car.flange),
        )


def trip() -> Trip:
    return Trip(
        cycle=eudc(),
        driver=Driver(k=2.0, Ti=1.0),
        pedal=Gain(k=FORCE),
        brakes=Gain(k=-BRAKE),
        motor=SignalForce(),
        brake=SignalForce(),
        speed=SpeedSensor(),
        car=Vehicle(**CAR),
    )


def by_hand() -> float:
    """Energy at the wheels in J, the integral of max(F, 0) v (Guzzella, Sciarretta, ch. 2)."""
    cycle, energy = eudc(), 0.0
    for t0, t1, v0, v1 in zip(cycle.times, cycle.times[1:], cycle.values, cycle.values[1:], strict=False):
        t = np.linspace(t0, t1, 2001)
        v = np.interp(t, [t0, t1], [v0, v1])
        drag = 0.5 * RHO * CAR["c_d"] * CAR["area"] * v**2
        force = CAR["m"] * ((v1 - v0) / (t1 - t0) + G * CAR["c_r"]) + drag
        energy += np.trapezoid(np.maximum(force, 0.0) * v, t)
    return float(energy)


def test_the_published_length_of_the_cycle() -> None:
    """UNECE Regulation 83: 400 s, 6.955 km, mean speed 62.6 km/h, greatest acceleration 0.833 m/s2."""
    cycle = eudc()
    times, speeds = np.asarray(cycle.times), np.asarray(cycle.values)
    length = np.trapezoid(speeds, times)
    assert times[-1] == 400.0
    np.testing.assert_allclose(length, 6955.0, atol=0.5)
    np.testing.assert_allclose(length / 400.0 * 3.6, 62.6, atol=0.05)
    slopes = np.diff(speeds) / np.diff(times)
    np.testing.assert_allclose([slopes.max(), slopes.min()], [0.833, -1.389], atol=5e-4)


@pytest.mark.thorough
def test_the_consumption_on_a_drive_cycle() -> None:
    """The energy of the motor is that of the cycle, and the brakes take the rest of the kinetic energy."""
    times = np.linspace(0.0, 400.0, 801)
    run = simulate(trip(), 400.0, save=times, energy=True, rtol=1e-7)
    asked = np.interp(times, np.asarray(eudc().times), np.asarray(eudc().values))
    assert np.max(np.abs(run["car.v"] - asked)) < 2.0 / 3.6  # tolerance of the regulation, 2 km/h
    np.testing.assert_allclose(run.final.car.flange.s, 6955.0, rtol=1e-3)
    np.testing.assert_allclose(run.energy.supplied["motor"], by_hand(), rtol=2e-3)
    assert abs(run.energy.imbalance) < 1e-5 * by_hand()


@pytest.mark.thorough
def test_the_consumption_has_a_gradient() -> None:
    """With respect to the mass, against central differences."""

    def used(m: Scalar) -> Scalar:
        run = simulate(replace(trip(), {"car.m": m}), 60.0, save="end", energy=True, rtol=1e-8)
        return run.energy.supplied["motor"]

    step = 1.0
    central = (used(1200.0 + step) - used(1200.0 - step)) / (2.0 * step)
    np.testing.assert_allclose(jax.jacfwd(used)(1200.0), central, rtol=1e-4)
