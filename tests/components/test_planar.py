"""Mechanisms in the plane against closed forms."""

import itertools
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _rig import Rig
from scipy.integrate import solve_ivp
from scipy.special import ellipk

from acausal import Connections, connect, initialise, simulate
from acausal.testing import check_law
from components.planar import (
    Bar,
    Body,
    ConstantForce,
    DistanceSensor,
    Fixed,
    FixedTranslation,
    ForceSensor,
    LineForce,
    PositionSensor,
    Prismatic,
    Revolute,
    SpeedSensor,
)
from components.rotational import ConstantTorque, Flange
from components.translational import Flange as Rod

G = 9.80665


def _chain(wall: Any, *links: Any) -> Connections:
    """Joints and links in turn."""
    joints = [connect(one.b, other.a) for one, other in itertools.pairwise(links)]
    return (connect(wall.frame, links[0].a), *joints)


@pytest.mark.thorough
def test_a_bar_falls_from_the_horizontal() -> None:
    """w^2 = 3 g/L at the bottom, after K(1/2) sqrt(2 L/(3 g))."""
    rig = Rig(parts=(Fixed(), Revolute(), Bar(m=0.7, L=0.4)), wiring=_chain)
    sol = simulate(rig, 2.0, until=lambda s: s.parts[1].phi + 0.5 * jnp.pi, rtol=1e-10, save="end")
    np.testing.assert_allclose(sol.final.parts[1].w, -np.sqrt(3.0 * G / 0.4), rtol=1e-8)
    np.testing.assert_allclose(sol.t1, ellipk(0.5) * np.sqrt(0.8 / (3.0 * G)), rtol=1e-8)


def _hung(wall: Fixed, *parts: Any) -> Connections:
    j1, l1, b1, j2, l2, b2 = parts
    return (
        *_chain(wall, j1, l1, j2, l2),
        connect(l1.b, b1.frame),
        connect(l2.b, b2.frame),
    )


@pytest.mark.thorough
def test_double_pendulum() -> None:
    """Lagrange's equations of two bodies on massless links, in the absolute angles."""
    m, J, L = (2.0, 1.0), (0.1, 0.05), (0.7, 0.4)

    def rates(_: float, z: Any) -> Any:
        a, b, wa, wb = z
        c, s = m[1] * L[0] * L[1] * np.cos(a - b), m[1] * L[0] * L[1] * np.sin(a - b)
        mass = [[J[0] + sum(m) * L[0] ** 2, c], [c, J[1] + m[1] * L[1] ** 2]]
        loads = [-s * wb**2 - sum(m) * G * L[0] * np.cos(a), s * wa**2 - m[1] * G * L[1] * np.cos(b)]
        return [wa, wb, *np.linalg.solve(mass, loads)]

    links = [part for i in range(2) for part in (FixedTranslation(rx=L[i]), Body(m=m[i], J=J[i]))]
    joints = (Revolute(phi=-0.5, w=1.0), Revolute(phi=0.3, w=-0.4))
    rig = Rig(parts=(Fixed(), joints[0], *links[:2], joints[1], *links[2:]), wiring=_hung)
    end = simulate(rig, 1.0, save="end", rtol=1e-9).final.parts
    there = solve_ivp(rates, (0.0, 1.0), [-0.5, -0.2, 1.0, 0.6], rtol=1e-11, atol=1e-12).y[:, -1]
    np.testing.assert_allclose([end[2].a.phi, end[5].a.phi, end[3].w, end[6].w], there, rtol=1e-6)


def _driven(wall: Fixed, joint: Any, bar: Bar, motor: ConstantTorque) -> Connections:
    return (*_chain(wall, joint, bar), connect(motor.flange, joint.shaft))


@pytest.mark.thorough
def test_a_motor_turns_a_bar_and_its_sensitivity() -> None:
    """phi = tau t^2/(2 J) with J = m L^2/3 in a horizontal plane, so that dphi/dL = -2 phi/L."""

    def turned(L: Any) -> Any:
        parts = (Fixed(), Revolute(shaft=Flange()), Bar(m=0.6, L=L, g=0.0), ConstantTorque(torque=0.5))
        return simulate(Rig(parts=parts, wiring=_driven), 1.0, save="end", rtol=1e-9).final.parts[1].phi

    angle, slope = jax.value_and_grad(turned)(0.5)
    np.testing.assert_allclose([angle, slope], [5.0, -20.0], rtol=1e-7)


def test_forces_on_joints_and_along_lines() -> None:
    """A torque on the shaft turns b on, and a force on the rod moves b away from a."""
    turn = {"a.phi": 0.2, "b.phi": 0.7, "shaft.tau": 3.0}
    check_law(Revolute(shaft=Flange()), given=turn, expected={"shaft.phi": 0.5, "a.tau": 3.0, "b.tau": -3.0})
    c, s = np.cos(0.4), np.sin(0.4)
    slide = {"a.x": 1.0, "a.y": 2.0, "a.phi": 0.1, "rod.s": 0.5, "rod.f": 4.0, "b.fx": -4.0 * c, "b.tau": 0.0}
    pushed = {"b.x": 1.0 + 0.5 * c, "b.y": 2.0 + 0.5 * s, "b.fy": -4.0 * s, "a.tau": 0.0}
    check_law(Prismatic(angle=0.3, rod=Rod()), given=slide, expected=pushed)
    line = {"a.x": 1.0, "a.y": 1.0, "b.x": 4.0, "b.y": 5.0, "rod.f": 10.0}
    check_law(LineForce(), given=line, expected={"rod.s": 5.0, "a.fx": 6.0, "a.fy": 8.0, "b.fx": -6.0, "b.fy": -8.0})


def test_a_constant_force_acts_on_the_connected_part() -> None:
    check_law(
        ConstantForce(fx=1.0, fy=2.0, tau=3.0),
        given={},
        expected={"frame.fx": -1.0, "frame.fy": -2.0, "frame.tau": -3.0},
    )


def test_sensors_read_their_frames() -> None:
    """Positions, speeds, distance and the force from a to b; no sensor takes a force."""
    place, nothing = (
        {"frame.x": 1.0, "frame.y": 2.0, "frame.phi": 3.0},
        {"frame.fx": 0.0, "frame.fy": 0.0, "frame.tau": 0.0},
    )
    check_law(PositionSensor(), given=place, expected={"x.value": 1.0, "y.value": 2.0, "phi.value": 3.0} | nothing)
    rates = {f"der({name})": value for name, value in place.items()}
    check_law(SpeedSensor(), given=rates, expected={"vx.value": 1.0, "vy.value": 2.0, "w.value": 3.0} | nothing)
    ends = {"a.x": 1.0, "a.y": 1.0, "b.x": 4.0, "b.y": 5.0}
    check_law(DistanceSensor(), given=ends, expected={"reading.value": 5.0, "a.fx": 0.0, "b.fy": 0.0})
    loads = {"b.fx": -1.0, "b.fy": -2.0, "b.tau": -3.0}
    check_law(ForceSensor(), given=loads, expected={"fx.value": 1.0, "fy.value": 2.0, "tau.value": 3.0})


FRAME, CRANK, COUPLER, ROCKER = 0.5, 0.2, 0.5, 0.4


def _four_bar(ends: Any, joints: Any, bars: Any) -> Connections:
    (left, right), (a, b, c, d), (crank, coupler, rocker) = ends, joints, bars
    return (
        *_chain(left, a, crank, b, coupler, c),
        connect(right.frame, d.a),
        connect(d.b, rocker.a),
        connect(rocker.b, c.b),
    )


def four_bar() -> Rig:
    """A crank that turns fully and a rocker, assembled from guesses of two joint angles."""
    bars = (Bar(m=1.0, L=CRANK), Bar(m=2.0, L=COUPLER), Bar(m=1.5, L=ROCKER))
    joints = (Revolute(phi=1.0, w=12.0), Revolute(phi=-0.8), Revolute(), Revolute(phi=1.3))
    rig = Rig(parts=((Fixed(), Fixed(x0=FRAME)), joints, bars), wiring=_four_bar)
    return initialise(rig, free=["parts[1][1].phi", "parts[1][3].phi"])


@pytest.fixture(scope="module")
def turning() -> Any:
    return simulate(four_bar(), 1.0, save=jnp.linspace(0.0, 1.0, 21), rtol=1e-8, energy=True)


@pytest.mark.slow
def test_four_bar_linkage_keeps_freudensteins_equation(turning: Any) -> None:
    """K1 cos(psi) - K2 cos(phi) + K3 = cos(phi - psi) between crank and rocker, over whole turns."""
    phi, psi = np.asarray(turning["parts[1][0].phi"]), np.asarray(turning["parts[1][3].phi"])
    K3 = (CRANK**2 - COUPLER**2 + ROCKER**2 + FRAME**2) / (2.0 * CRANK * ROCKER)
    left = FRAME / CRANK * np.cos(psi) - FRAME / ROCKER * np.cos(phi) + K3
    assert np.ptp(phi) > 2.0 * np.pi
    np.testing.assert_allclose(left, np.cos(phi - psi), atol=1e-8)


@pytest.mark.slow
def test_four_bar_linkage_keeps_its_energy(turning: Any) -> None:
    assert abs(turning.energy.imbalance) < 1e-5


def _slider_crank(wall: Fixed, crank: Any, rod: Any, slide: Prismatic, slider: Body, *joints: Any) -> Connections:
    a, b, c = joints
    return (
        *_chain(wall, a, crank, b, rod, c),
        connect(wall.frame, slide.a),
        connect(slide.b, slider.frame, c.b),
    )


def slider_crank(crank: Any) -> Rig:
    links = (Fixed(), Bar(m=1.0, L=crank), Bar(m=2.0, L=0.5), Prismatic(s=0.6), Body(m=1.5, J=0.01))
    joints = (Revolute(phi=0.7, w=15.0), Revolute(phi=-1.0), Revolute())
    rig = Rig(parts=(*links, *joints), wiring=_slider_crank)
    return initialise(rig, free=["parts[3].s", "parts[6].phi"])


@pytest.mark.slow
def test_slider_crank_and_its_sensitivity() -> None:
    """s = r cos(phi) + sqrt(l^2 - r^2 sin(phi)^2) through whole turns, and ds/dr at the start."""
    r, rod = 0.2, 0.5
    sol = simulate(slider_crank(r), 0.6, save=jnp.linspace(0.0, 0.6, 13), rtol=1e-8)
    phi, s = np.asarray(sol["parts[5].phi"]), np.asarray(sol["parts[3].s"])
    assert np.ptp(phi) > 2.0 * np.pi
    np.testing.assert_allclose(s, r * np.cos(phi) + np.sqrt(rod**2 - (r * np.sin(phi)) ** 2), atol=1e-8)

    def placed(crank: Any) -> Any:
        return simulate(slider_crank(crank), 0.0, save="end").final.parts[3].s

    slope = np.cos(0.7) - r * np.sin(0.7) ** 2 / np.sqrt(rod**2 - (r * np.sin(0.7)) ** 2)
    np.testing.assert_allclose(jax.grad(placed)(r), slope, rtol=1e-8)
