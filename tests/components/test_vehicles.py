"""Weight, driving resistances, tyres and sampled dampers against closed forms."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from acausal import Component, Connections, ParameterError, Scalar, connect, simulate
from acausal.testing import check_law, solved
from components import rotational, translational
from components.blocks import Constant, Input
from components.rotational import ConstantTorque, Inertia, Tyre
from components.translational import Mass, TabulatedDamper, Vehicle

G = 9.80665  # standard gravity, m/s2
SLOPE = np.arctan(0.05)
CAR: dict[str, Any] = dict(m=1500.0, area=2.2, c_d=0.28, c_r=0.01)


def test_a_mass_on_a_slope() -> None:
    """Thrown up a slope, it rises by v^2 / (2 g) and is back after 2 v / (g sin(incline))."""
    mass, back = Mass(m=2.0, incline=0.3, s=0.0, v=3.0), 2.0 * 3.0 / (G * np.sin(0.3))
    run = simulate(mass, back, save=[back / 2.0, back], energy=True)
    np.testing.assert_allclose(run["a.s"] * np.sin(0.3), [3.0**2 / (2.0 * G), 0.0], atol=1e-9)
    np.testing.assert_allclose(run["v"], [0.0, -3.0], atol=1e-9)
    assert abs(run.energy.imbalance) < 1e-9


def test_the_weight_follows_the_mass() -> None:
    """One number of the mass for inertia and weight: the fall does not depend on it."""

    def fallen(m: float) -> Scalar:
        return simulate(Mass(m=m, incline=jnp.pi / 2.0), 1.0, save="end").final.s

    value, slope = jax.value_and_grad(fallen)(2.0)
    np.testing.assert_allclose([value, slope], [-G / 2.0, 0.0], atol=1e-9)


def test_coasting() -> None:
    """dv/dt = -a - b v^2 has the solution v = sqrt(a/b) tan(atan(v sqrt(b/a)) - sqrt(a b) t)."""
    car = Vehicle(**CAR, v=30.0)
    a, b = 0.01 * G, 0.5 * 1.2 * 0.28 * 2.2 / 1500.0
    times = np.array([10.0, 60.0, 120.0])
    run = simulate(car, 120.0, save=times, rtol=1e-9)
    exact = np.sqrt(a / b) * np.tan(np.arctan(30.0 * np.sqrt(b / a)) - np.sqrt(a * b) * times)
    np.testing.assert_allclose(run["v"], exact, rtol=1e-7)


class Climb(Component):
    """A wheel driven by a constant torque moves a car up a road."""

    car: Vehicle
    tyre: Tyre
    torque: ConstantTorque
    grade: Constant
    rim: Inertia

    def connections(self) -> Connections:
        return (
            connect(self.torque.flange, self.rim.a),
            connect(self.rim.b, self.tyre.shaft),
            connect(self.tyre.rod, self.car.flange),
            connect(self.grade.y, self.car.grade),  # pyright: ignore[reportArgumentType]
        )


def test_a_car_climbs_by_the_slip_of_its_tyres() -> None:
    """At a constant speed the tyre carries torque / radius, at the slip of the formula; its loss heats the tyre."""
    car = Vehicle(**CAR, grade=Input())
    climb = Climb(
        car=car,
        tyre=Tyre(radius=0.3, F_z=7000.0),
        torque=ConstantTorque(torque=300.0),
        grade=Constant(k=0.05),
        rim=Inertia(J=2.0),
    )
    run = simulate(climb, 2000.0, save=[2000.0], energy=True, rtol=1e-8)
    last = run.final
    np.testing.assert_allclose(last.tyre.F, 1000.0, rtol=1e-6)
    drag = 1000.0 - 1500.0 * G * (0.01 * np.cos(SLOPE) + np.sin(SLOPE))
    np.testing.assert_allclose(last.car.v, np.sqrt(drag / (0.5 * 1.2 * 0.28 * 2.2)), rtol=1e-5)
    np.testing.assert_allclose(last.car.altitude, last.car.flange.s * np.sin(SLOPE), rtol=1e-6)
    assert abs(run.energy.imbalance) < 1e-6 * 300.0 * last.tyre.shaft.phi


def test_the_magic_formula() -> None:
    """Slip stiffness B C D F_z at the origin; peak D F_z where the argument of the sine is pi/2; locked wheel."""
    tyre = Tyre(radius=0.3, F_z=4000.0)

    def force(slip: Any) -> np.ndarray:
        """At 1000 m/s, where the width v_0 does not matter."""
        return solved(tyre, given={"der(rod.s)": 1000.0, "der(shaft.phi)": 1000.0 * (1.0 + slip) / 0.3})["F"]

    small, *forces, negative = force(np.array([1e-6, *np.linspace(0.05, 0.4, 71), -1.0]))
    np.testing.assert_allclose(small / 1e-6, 10.0 * 1.9 * 4000.0, rtol=1e-5)
    np.testing.assert_allclose(max(forces), 4000.0, rtol=1e-4)
    x = 10.0
    locked = np.sin(1.9 * np.arctan(x - 0.97 * (x - np.arctan(x))))
    np.testing.assert_allclose(negative, -4000.0 * locked, rtol=1e-6)


def test_a_sampled_damper() -> None:
    speeds, forces = [-1.0, -0.1, 0.0, 0.1, 1.0], [-800.0, -300.0, 0.0, 600.0, 2500.0]
    damper = TabulatedDamper(speeds=speeds, forces=forces)
    expected = {"f": forces, "b.f": forces, "a.f": -np.array(forces)}
    check_law(damper, given={"der(a.s)": 0.0, "der(b.s)": speeds}, expected=expected)
    shaft = rotational.TabulatedDamper(speeds=[-20.0, 0.0, 20.0], torques=[-150.0, 0.0, 150.0])
    check_law(shaft, given={"der(a.phi)": 0.0, "der(b.phi)": 30.0}, expected={"tau": 225.0})


def test_what_dampers_and_tyres_refuse() -> None:
    with pytest.raises(ParameterError, match="speeds must include 0"):
        TabulatedDamper(speeds=[-1.0, 1.0], forces=[-1.0, 1.0])
    with pytest.raises(ParameterError, match="forces must have the sign of speeds"):
        TabulatedDamper(speeds=[-1.0, 0.0], forces=[1.0, 0.0])
    with pytest.raises(ParameterError, match="forces must have shape"):
        translational.TabulatedDamper(speeds=[-1.0, 0.0], forces=[1.0])
    with pytest.raises(ParameterError, match="speeds must include 0"):
        rotational.TabulatedDamper(speeds=[-1.0, 1.0], torques=[-1.0, 1.0])
    with pytest.raises(ParameterError, match="torques must have the sign of speeds"):
        rotational.TabulatedDamper(speeds=[-1.0, 0.0, 1.0], torques=[-1.0, 0.1, 1.0])
    with pytest.raises(ParameterError, match="C must be at most 2, so that the force has the direction of the slip"):
        Tyre(radius=0.3, F_z=1.0, C=2.1)
    with pytest.raises(ParameterError, match="E must be at most 1"):
        Tyre(radius=0.3, F_z=1.0, E=1.5)
