"""Modes of linear systems: poles, shapes, participation, energy, derivatives, redundant states."""

from typing import Any, Self

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _linear_models import C, J, K, L, R, helmholtz, motor_rig, rlc, two_mass
from _mechanisms import PointOnRod
from _models import oscillator

from acausal import (
    Component,
    Connections,
    Energy,
    Equations,
    ModelError,
    Param,
    Scalar,
    UnknownNameError,
    Var,
    connect,
    eq,
    linearise,
    positive,
    prefer,
    structure,
)
from acausal._analyse.eigenmodes import Shares, modes_of
from acausal._analyse.redundant import curvature, reduced
from components import translational
from components.rotational import Flange, Inertia

M = np.diag([2.0, 1.0])
STIFFNESS = np.array([[400.0, -100.0], [-100.0, 100.0]])


@pytest.mark.thorough
def test_two_masses() -> None:
    """Frequencies and shapes of M x'' + K x = 0."""
    modes = linearise(two_mass()).modes
    squares, shapes = np.linalg.eigh(np.diag(M.diagonal() ** -0.5) @ STIFFNESS @ np.diag(M.diagonal() ** -0.5))
    np.testing.assert_allclose(modes.frequency[::2], np.sqrt(squares) / (2 * np.pi), rtol=1e-12)
    np.testing.assert_allclose(modes.poles[::2], np.sqrt(squares) * 1j, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(modes.poles[1::2], np.conj(modes.poles[::2]), rtol=1e-14)
    np.testing.assert_allclose(modes.damping_ratio, 0.0, atol=1e-14)
    positions = [modes.participation.names.index(name) for name in ("first.a.s", "outer.s_rel")]
    found = np.array(modes.shapes)[positions][:, ::2]
    expected = np.diag(M.diagonal() ** -0.5) @ shapes
    np.testing.assert_allclose(found[1] / found[0], expected[1] / expected[0] - 1.0, rtol=1e-10)


def test_energy_of_two_masses() -> None:
    """Half of the energy is in the masses and half in the springs, in the proportions of the mode shape."""
    energy = linearise(two_mass()).energy
    assert set(energy.names) == {"first", "second", "inner", "outer"}
    squares, shapes = np.linalg.eigh(np.diag(M.diagonal() ** -0.5) @ STIFFNESS @ np.diag(M.diagonal() ** -0.5))
    x = np.diag(M.diagonal() ** -0.5) @ shapes
    kinetic = M.diagonal()[:, None] * x**2 * squares
    potential = np.array([300.0 * x[0] ** 2, 100.0 * (x[1] - x[0]) ** 2])
    total = kinetic.sum(axis=0) + potential.sum(axis=0)
    rows = [energy.names.index(name) for name in ("first", "second", "inner", "outer")]
    expected = np.concatenate([kinetic, potential]) / total
    np.testing.assert_allclose(np.array(energy.values)[rows][:, ::2], expected, rtol=1e-10)
    np.testing.assert_allclose(energy["first"] + energy["second"], 0.5, rtol=1e-10)


def test_damped_oscillator() -> None:
    m, c, d = 2.0, 50.0, 3.0
    modes = linearise(oscillator(m=m, c=c, d=d)).modes
    np.testing.assert_allclose(modes.frequency, np.sqrt(c / m) / (2 * np.pi), rtol=1e-13)
    np.testing.assert_allclose(modes.damping_ratio, d / (2 * np.sqrt(m * c)), rtol=1e-13)
    np.testing.assert_allclose(modes.time_constant, 2 * m / d, rtol=1e-13)
    np.testing.assert_allclose(modes.participation.values, 0.5 / np.sqrt(1 - d**2 / (4 * m * c)), rtol=0.05)


def test_shares_of_all_states_in_a_mode_sum_to_one() -> None:
    """Also if modes and states differ, so that the shares of a state do not; they do not depend on units."""
    A, sizes = np.array([[-1.0, 20.0, 0.0], [-5.0, -0.5, 3.0], [0.0, 0.2, -4.0]]), np.array([1.0, 10.0, 1e-3])
    names = ("x", "y", "z")
    shares = modes_of(jnp.asarray(A), np.ones(3), names).participation.values
    np.testing.assert_allclose(shares.sum(axis=0), 1.0, rtol=1e-12)
    assert np.max(np.abs(shares.sum(axis=1) - 1.0)) > 1e-3
    poles, right = np.linalg.eig(A)
    weights = np.abs(right * np.linalg.inv(right).T)[:, np.argsort(np.abs(poles), kind="stable")]
    np.testing.assert_allclose(shares, weights / np.sum(weights, axis=0), rtol=1e-9)
    scaled = modes_of(jnp.asarray(A / sizes[:, None] * sizes), sizes, names).participation.values
    np.testing.assert_allclose(scaled, shares, rtol=1e-9)


def test_participation_of_a_motor() -> None:
    """Against left and right eigenvectors of the two-by-two matrix, and columns that sum to 1."""
    modes = linearise(motor_rig()).modes
    A = np.array([[-R / L, -K / L], [K / J, -C / J]])
    poles, right = np.linalg.eig(A)
    left = np.linalg.inv(right)
    order = np.argsort(np.abs(poles))
    weights = np.abs(right * left.T)[:, order]
    current, speed = modes.participation["motor.inductor.i"], modes.participation["motor.rotor.w"]
    np.testing.assert_allclose(modes.poles, [0.0, *poles[order]], rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(np.array([current, speed])[:, 1:], weights / weights.sum(axis=0), rtol=1e-10)
    np.testing.assert_allclose(modes.participation.values.sum(axis=0), 1.0, rtol=1e-14)


def test_rlc() -> None:
    system = linearise(rlc(R=10.0, L=1e-3, C=1e-6))
    expected = np.roots([1e-9, 1e-5, 1.0])
    np.testing.assert_allclose(system.poles, expected[np.argsort(-expected.imag)], rtol=1e-12)
    np.testing.assert_allclose(system.energy.values.sum(axis=0), 1.0, rtol=1e-12)
    # v = i / (C s) has |s|^2 = 1 / (L C), so both store the same.
    np.testing.assert_allclose(system.energy.values, 0.5, rtol=1e-12)


def test_helmholtz() -> None:
    """Pascals beside cubic millimetres; the third pole belongs to the volume that stays enclosed."""
    system = linearise(helmholtz())
    assert system.poles[-2].imag == pytest.approx(1e-3 * np.sqrt(1.4e9 / 1e-4), rel=1e-12)
    assert system.poles[-2].imag == pytest.approx(3741.66, abs=5e-3)
    assert abs(float(system.poles[0].real)) < 1e-9
    np.testing.assert_allclose(system.energy.values[:, -2:], 0.5, rtol=1e-10)
    text = str(system.modes)
    assert "595.5" in text
    assert text.splitlines()[1].split()[:3] == ["0", "0", "inf"]


def test_a_share_of_no_component_is_refused() -> None:
    energy = linearise(motor_rig()).energy
    with pytest.raises(UnknownNameError, match="'moto' has no energy share of its own"):
        energy["moto"]


def test_tables() -> None:
    system = linearise(two_mass(d1=1.0))
    lines = str(system.modes).splitlines()
    assert len(lines) == 3
    assert "±" in lines[1]
    head, *rows = str(system.energy).splitlines()
    assert head.count("Hz") == 2
    assert [row.split()[0] for row in rows] == list(system.energy.names)
    assert str(system.participation).splitlines()[0].startswith("participation")
    many = Shares(jnp.eye(20)[:, :14], -jnp.arange(1.0, 15.0) + 0j, tuple("abcdefghijklmnopqrst"), "share")
    assert str(many).splitlines()[-1] == "2 more modes, 6 rows below 0.005 not shown"


def _pole(resistance: Scalar) -> Any:
    return linearise(motor_rig(R=resistance)).poles[1].real


def _first_frequency(c1: Scalar) -> Any:
    return linearise(two_mass(c1=c1, d1=1.0)).poles[0].imag


def _share(c1: Scalar) -> Any:
    return linearise(two_mass(c1=c1, d1=1.0)).energy["inner"][0]


def _participation(c1: Scalar) -> Any:
    return linearise(two_mass(c1=c1, d1=1.0)).participation["first.v"][0]


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("function", "x"), [(_pole, 0.3), (_first_frequency, 300.0), (_share, 300.0), (_participation, 300.0)]
)
def test_derivatives(function: Any, x: float) -> None:
    """Both modes against central differences."""
    h = 1e-4 * x
    difference = float((function(x + h) - function(x - h)) / (2 * h))
    assert float(jax.jit(jax.jacfwd(function))(x)) == pytest.approx(difference, rel=1e-6)
    assert float(jax.grad(function)(x)) == pytest.approx(difference, rel=1e-6)


def test_derivative_in_closed_form() -> None:
    """d(omega)/dc = 1 / (2 sqrt(c m)) of an undamped oscillator, for a batch under jit."""

    def omega(c: Scalar) -> Any:
        return linearise(oscillator(m=2.0, c=c)).poles[0].imag

    stiffness = jnp.array([10.0, 40.0])
    np.testing.assert_allclose(
        jax.jit(jax.vmap(jax.grad(omega)))(stiffness), 0.5 / np.sqrt(2.0 * stiffness), rtol=1e-12
    )


LENGTH, GRAVITY = 0.5, 9.81


def _pendulum(y: Any, down: float = 0.0) -> Any:
    """A point on a rod in Cartesian coordinates as an underlying ordinary differential equation: x, y, u, v.

    `down` is the angle of gravity with -y.
    """
    x, y, u, v = y
    gx, gy = GRAVITY * jnp.sin(down), -GRAVITY * jnp.cos(down)
    force = (u**2 + v**2 + gx * x + gy * y) / LENGTH**2
    return jnp.array([u, v, gx - force * x, gy - force * y])


def _invariants(y: Any) -> Any:
    x, y, u, v = y
    return jnp.array([x**2 + y**2 - LENGTH**2, x * u + y * v])


@pytest.mark.parametrize("angle", [0.0, np.pi])
def test_redundant_states_of_a_pendulum(angle: float) -> None:
    """Two of four eigenvalues remain, those of the two degrees of freedom: s^2 = -g / L hanging, g / L upside down."""
    point = LENGTH * jnp.array([jnp.sin(angle), -jnp.cos(angle), 0.0, 0.0])
    A, G = jax.jacfwd(_pendulum)(point), jax.jacfwd(_invariants)(point)
    B, C = jnp.array([[0.0], [0.0], [1.0], [0.0]]), jnp.eye(4)
    found = reduced(A, B, C, G, np.array([0.01, 0.01, 0.1, 0.1]))
    assert found.independent.tolist() == [0, 2]
    np.testing.assert_allclose(found.A @ found.A, -np.cos(angle) * GRAVITY / LENGTH * np.eye(2), atol=1e-12)
    np.testing.assert_allclose(found.B, [[0.0], [1.0]])
    np.testing.assert_allclose(G @ found.basis, 0.0, atol=1e-15)
    np.testing.assert_allclose(found.C, found.basis)
    traced = jax.jit(lambda A: reduced(A, B, C, G, np.ones(4), found.independent).A)(A)
    np.testing.assert_allclose(traced, found.A, rtol=1e-14)


def test_redundant_states_away_from_an_axis() -> None:
    """A pendulum that hangs at 1 rad in an inclined field: the poles do not depend on the choice of states."""
    point = LENGTH * jnp.array([jnp.sin(1.0), -jnp.cos(1.0), 0.0, 0.0])
    A, G = jax.jacfwd(_pendulum)(point, 1.0), jax.jacfwd(_invariants)(point)
    poles = [
        np.linalg.eigvals(reduced(A, jnp.zeros((4, 0)), jnp.eye(4), G, np.ones(4), choice).A)
        for choice in ([0, 2], [1, 3], [0, 3], None)
    ]
    np.testing.assert_allclose(np.square(poles), -GRAVITY / LENGTH, rtol=1e-12)


class Bob(PointOnRod):
    """The point of a pendulum with its kinetic energy, and its height for another component."""

    m: Param[Scalar, "kg", positive] = 3.0
    height: translational.Flange = translational.Flange()

    def equations(self, d: Self) -> Equations:
        return super().equations(d) | dict(height=eq(self.height.s, self.y))

    def energy(self) -> Energy:
        return Energy(stored=0.5 * self.m * (self.u**2 + self.v**2))


class Weight(Component):
    """The potential energy m g s."""

    weight: Param[Scalar, "N"] = 3.0 * GRAVITY
    flange: translational.Flange = translational.Flange()

    def equations(self, d: Self) -> Equations:
        return dict(free=eq(self.flange.f))

    def energy(self) -> Energy:
        return Energy(stored=self.weight * self.flange.s)


class HeavyBob(Component):
    bob: Bob
    weight: Weight

    def connections(self) -> Connections:
        return (connect(self.bob.height, self.weight.flange),)


@pytest.mark.thorough
def test_system_with_invariants() -> None:
    """Two poles at the pendulum's frequency remain of four, and its energy is shared along the circle."""
    model = HeavyBob(bob=Bob(L=LENGTH, x=0.0, y=-LENGTH, u=0.0), weight=Weight())
    assert len(structure(model).states) == 4
    linear = linearise(model, outputs=["bob.y", "bob.x"])
    assert set(linear.states) == {"bob.x", "bob.u"}
    np.testing.assert_allclose(linear.poles, np.array([1j, -1j]) * np.sqrt(GRAVITY / LENGTH), rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(linear.C @ linear.A @ linear.A, -GRAVITY / LENGTH * linear.C, atol=1e-12)
    np.testing.assert_allclose(linear.C[0], 0.0, atol=1e-15)
    np.testing.assert_allclose(linear.energy["bob"], 0.5, rtol=1e-12)
    np.testing.assert_allclose(linear.energy["weight"], 0.5, rtol=1e-12)


def test_pendulum_upside_down() -> None:
    """s^2 = g / L; the energy of a motion that runs away is zero in sum."""
    linear = linearise(HeavyBob(bob=Bob(L=LENGTH, x=0.0, y=LENGTH, u=0.0), weight=Weight()))
    np.testing.assert_allclose(
        np.sort(linear.poles.real), np.array([-1.0, 1.0]) * np.sqrt(GRAVITY / LENGTH), rtol=1e-12
    )
    np.testing.assert_allclose(linear.energy["bob"], 0.5, rtol=1e-12)
    np.testing.assert_allclose(linear.energy["weight"], -0.5, rtol=1e-12)


def test_energy_along_a_constraint() -> None:
    """The weight rises on the circle: d2(m g y)/dx2 = m g / L, though m g y itself is linear."""
    point, direction = jnp.array([0.0, -LENGTH, 0.0, 0.0]), jnp.array([1.0, 0.0, 0.0, 0.0])
    bend = curvature(_invariants, point, direction, np.array([0, 2]))
    np.testing.assert_allclose(bend, [0.0, 1.0 / LENGTH, 0.0, 0.0], atol=1e-15)


def test_redundant_states_that_cannot_be_reduced() -> None:
    A, B, C = jnp.eye(3), jnp.zeros((3, 0)), jnp.eye(3)
    with pytest.raises(ModelError, match="not independent"):
        reduced(A, B, C, jnp.array([[1.0, 2.0, 0.0], [2.0, 4.0, 0.0]]), np.ones(3))
    with pytest.raises(ModelError, match="outside jit"):
        jax.jit(lambda G: reduced(A, B, C, G, np.ones(3)).A)(jnp.array([[1.0, 0.0, 0.0]]))


def test_free_oscillation_keeps_its_energy_shares() -> None:
    """A chain that is free at one end has a mode at zero, which stores nothing; the others share as in closed form."""
    system = linearise(two_mass(c1=0.0))
    rigid = np.abs(np.array(system.poles)) < 1e-4
    assert rigid.sum() == 2
    shares = np.array(system.energy.values)[:, ~rigid]
    np.testing.assert_allclose(shares[system.energy.names.index("outer")], 0.5, rtol=1e-8)
    np.testing.assert_allclose(shares[system.energy.names.index("first")], 0.5 / 3.0, rtol=1e-8)


class TopWeight(Component):
    """A point mass on top of a rod, whose weight turns the rod further: tau = -m g l sin(phi)."""

    moment: Param[Scalar, "N.m"] = 5.0  # m g l
    phi: Var[Scalar, "rad", prefer] = 0.0
    flange: Flange = Flange()

    def equations(self, d: Self) -> Equations:
        return dict(angle=eq(self.phi, self.flange.phi), weight=eq(self.flange.tau, -self.moment * jnp.sin(self.phi)))

    def energy(self) -> Energy:
        return Energy(stored=self.moment * jnp.cos(self.phi))


class Inverted(Component):
    weight: TopWeight
    rotor: Inertia

    def connections(self) -> Connections:
        return (connect(self.weight.flange, self.rotor.a),)


def test_mode_that_stores_nothing() -> None:
    """The angle of a motor that turns freely."""
    energy = linearise(motor_rig()).energy
    np.testing.assert_array_equal(energy.values[:, 0], 0.0)
    np.testing.assert_allclose(energy.values[:, 1:].sum(axis=0), 1.0, rtol=1e-12)


@pytest.mark.thorough
def test_weight_that_drives_a_mode() -> None:
    """An unstable motion has no energy in sum: what the rotor gains the weight gives."""
    system = linearise(Inverted(weight=TopWeight(), rotor=Inertia(J=0.2)))
    np.testing.assert_allclose(np.sort(system.poles.real), [-5.0, 5.0], rtol=1e-13)
    np.testing.assert_allclose(system.energy["rotor"], 0.5, rtol=1e-12)
    np.testing.assert_allclose(system.energy["weight"], -0.5, rtol=1e-12)
    assert np.any(system.modes.damping_ratio == -1.0)
