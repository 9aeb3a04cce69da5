"""The relaxation of a tyre and a road over distance, against closed forms."""

from typing import Any

import jax
import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid

from acausal import Component, Connections, Scalar, connect, replace, simulate
from acausal.testing import check_law, solved
from components import rotational, translational
from components.blocks import Constant, Gain, Input, Step, Sum, Table1D
from components.rotational import Inertia, SignalTorque, TransientTyre, Tyre
from components.translational import PositionSensor, Vehicle

TYRE: dict[str, Any] = dict(radius=0.3, F_z=4000.0)


class Rig(Component):
    """A tyre on a drum of constant speed, whose wheel suddenly turns faster."""

    drum: translational.SignalSpeed
    speed: Constant
    wheel: rotational.SignalSpeed
    more: Step
    tyre: TransientTyre

    def connections(self) -> Connections:
        return (
            connect(self.speed.y, self.drum.u),
            connect(self.more.y, self.wheel.u),
            connect(self.drum.flange, self.tyre.rod),
            connect(self.wheel.flange, self.tyre.shaft),
        )


def rig(v: float, v_slip: float, sigma: float) -> Rig:
    return Rig(
        drum=translational.SignalSpeed(),
        speed=Constant(k=v),
        wheel=rotational.SignalSpeed(),
        more=Step(offset=v / 0.3, height=v_slip / 0.3, start_time=0.01),
        tyre=TransientTyre(**TYRE, sigma=sigma, v_0=0.1),
    )


def test_the_slip_relaxes_over_a_rolled_distance() -> None:
    """k = v_slip/V (1 - exp(-V t/sigma)) with V^2 = v^2 + v_0^2; the derivative with respect to sigma follows."""
    v, v_slip, sigma, after = 10.0, 0.4, 0.3, 0.04
    V = np.hypot(v, 0.1)

    def slip(sigma: Scalar) -> Scalar:
        return simulate(
            replace(rig(v, v_slip, 0.3), {"tyre.sigma": sigma}), 0.01 + after, save="end", rtol=1e-9
        ).final.tyre.slip

    value, slope = jax.value_and_grad(slip)(sigma)
    decay = np.exp(-V * after / sigma)
    np.testing.assert_allclose(value, v_slip / V * (1.0 - decay), rtol=1e-7)
    np.testing.assert_allclose(slope, -v_slip * after / sigma**2 * decay, rtol=1e-6)


def test_the_tyre_ends_at_the_force_of_steady_slip() -> None:
    run = simulate(rig(10.0, 0.4, 0.3), 2.0, save="end", rtol=1e-9, energy=True)
    given = {"der(rod.s)": 10.0, "der(shaft.phi)": 10.4 / 0.3}
    np.testing.assert_allclose(run.final.tyre.F, solved(Tyre(**TYRE, v_0=0.1), given=given)["F"], rtol=1e-9)
    assert abs(run.energy.imbalance) < 1e-5


def test_near_rest_the_tyre_is_a_spring() -> None:
    """dF/dt = B C D F_z/sigma v_slip, the longitudinal stiffness of the carcass."""
    tyre = TransientTyre(**TYRE, sigma=0.25)
    given = {"slip": 0.0, "der(rod.s)": 0.0, "der(shaft.phi)": 0.1}
    check_law(tyre, given=given, expected={"der(F)": 10.0 * 1.9 * 4000.0 / 0.25 * 0.03})


class Launch(Component):
    """A wheel that starts a car."""

    torque: SignalTorque
    step: Step
    rim: Inertia
    tyre: TransientTyre
    car: Vehicle

    def connections(self) -> Connections:
        return (
            connect(self.step.y, self.torque.u),
            connect(self.torque.flange, self.rim.a),
            connect(self.rim.b, self.tyre.shaft),
            connect(self.tyre.rod, self.car.flange),
        )


def test_the_energy_of_a_launch_closes() -> None:
    launch = Launch(
        torque=SignalTorque(),
        step=Step(height=600.0, start_time=0.1),
        rim=Inertia(J=2.0),
        tyre=TransientTyre(radius=0.3, F_z=7000.0, sigma=0.3),
        car=Vehicle(m=1500.0, area=2.2, c_d=0.28, c_r=0.01),
    )
    run = simulate(launch, 5.0, save="end", energy=True, rtol=1e-8)
    assert run.energy.dissipated["tyre"] > 0.0
    assert abs(run.energy.imbalance) < 1e-5 * run.energy.supplied["torque"]


class Road(Component):
    """A car on a road whose slope is known over the distance; a controlled force keeps it near its speed."""

    car: Vehicle
    place: PositionSensor
    road: Table1D
    drive: translational.SignalForce
    speed: translational.SpeedSensor
    setpoint: Constant
    difference: Sum
    control: Gain

    def connections(self) -> Connections:
        return (
            connect(self.place.flange, self.speed.flange, self.drive.flange, self.car.flange),
            connect(self.place.y, self.road.u),
            connect(self.road.y, self.car.grade),  # pyright: ignore[reportArgumentType]
            connect(self.setpoint.y, self.difference.u1),
            connect(self.speed.y, self.difference.u2),
            connect(self.difference.y, self.control.u),
            connect(self.control.y, self.drive.u),
        )


@pytest.mark.parametrize("gain", [2e3, 1e4])
def test_the_altitude_belongs_to_the_place(gain: float) -> None:
    """Whatever the speed, the car has climbed the integral of sin(atan(tangent)) over its distance."""
    places, slopes = np.array([0.0, 100.0, 300.0, 500.0, 700.0]), np.array([0.0, 0.06, 0.08, -0.05, -0.05])
    model = Road(
        car=Vehicle(m=1500.0, area=2.2, c_d=0.28, c_r=0.01, grade=Input(), v=20.0),
        place=PositionSensor(),
        road=Table1D(points=places, values=slopes, smooth=False),
        drive=translational.SignalForce(),
        speed=translational.SpeedSensor(),
        setpoint=Constant(k=20.0),
        difference=Sum(k2=-1.0),
        control=Gain(k=gain),
    )
    run = simulate(model, 40.0, save=np.linspace(0.0, 40.0, 41), rtol=1e-9, energy=True)
    s = np.linspace(0.0, 700.0, 70001)
    tangent = np.interp(s, places, slopes)
    rises = cumulative_trapezoid(tangent / np.hypot(1.0, tangent), s, initial=0.0)
    s_run = np.asarray(run["car.flange.s"])
    inside = s_run <= 700.0
    assert inside.sum() > 30
    np.testing.assert_allclose(run["car.altitude"][inside], np.interp(s_run[inside], s, rises), atol=1e-5)
    assert abs(run.energy.imbalance) < 1e-4 * abs(run.energy.supplied["drive"])
