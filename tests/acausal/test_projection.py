"""Mechanisms for which no choice of states is good in every position: all are states, and the run is projected."""

from typing import Any, Self

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _mechanisms import FourBar, Pendulum, SliderCrank, Swing
from scipy.special import ellipj, ellipk

from acausal import (
    Component,
    Discrete,
    Equations,
    Events,
    Nominal,
    Param,
    Scalar,
    SimulationError,
    StructureError,
    Var,
    at,
    choose_states,
    eq,
    initialise,
    never,
    simulate,
    structure,
    when,
)
from acausal._integrate.solvers import Rodas3P

G = 9.81


@pytest.fixture(scope="module")
def released() -> Any:
    """From rest at the horizontal, at the times of the published values."""
    return simulate(Pendulum(x=1.0, y=0.0), 10.0, save=np.array([0.5, 1.0, 2.0, 10.0]), rtol=1e-10, max_steps=10_000)


@pytest.mark.thorough
def test_pendulum(released: Any) -> None:
    k = np.sin(np.pi / 4)
    angle = 2.0 * np.arcsin(k * ellipj(ellipk(k**2) - np.sqrt(G) * np.asarray(released.ts), k**2)[0])
    np.testing.assert_allclose(released.x, np.sin(angle), atol=1e-9)
    np.testing.assert_allclose(released.y, -np.cos(angle), atol=1e-9)
    np.testing.assert_allclose(released.x[:3], [0.391048791551, -0.986291751132, 0.793566195343], atol=1e-9)


@pytest.mark.thorough
def test_pendulum_turning_over() -> None:
    """Fast enough to go round: w^2 = w0^2 - 2 g (1 - cos(angle)), a motion in cn and dn with modulus below 1."""
    w0 = 8.0
    times = np.linspace(0.0, 5.0, 11)
    sol = simulate(Pendulum(x=0.0, y=-1.0, u=w0), 5.0, save=times, rtol=1e-10, max_steps=10_000)
    m = 4.0 * G / w0**2
    sn, cn, _, _ = ellipj(w0 * times / 2.0, m)
    np.testing.assert_allclose(sol.x, 2.0 * sn * cn, atol=1e-8)
    np.testing.assert_allclose(sol.y, 2.0 * sn**2 - 1.0, atol=1e-8)
    assert np.max(np.asarray(sol.y)) > 0.9


@pytest.mark.thorough
def test_no_drift_over_a_thousand_oscillations() -> None:
    period = 4.0 * ellipk(np.sin(np.pi / 4) ** 2) / np.sqrt(G)
    rtol = 1e-6
    times = np.linspace(0.0, 1000.0 * period, 2001)
    sol = simulate(Pendulum(x=1.0, y=0.0), times[-1], save=times, rtol=rtol, max_steps=1_000_000)
    # Saved values between steps are interpolated, to the tolerance; the ends of steps lie on the constraint.
    np.testing.assert_allclose(sol.x**2 + sol.y**2, 1.0, atol=10 * rtol)
    np.testing.assert_allclose(sol.x * sol.u + sol.y * sol.v, 0.0, atol=10 * rtol * np.sqrt(2.0 * G))
    np.testing.assert_allclose(sol.final.x**2 + sol.final.y**2, 1.0, atol=1e-13)
    np.testing.assert_allclose(sol.final.x * sol.final.u + sol.final.y * sol.final.v, 0.0, atol=1e-12)


def swing(length: Any, x0: Any) -> Any:
    """The place of a pendulum after two passes over y = 0. It starts from a place that its rod allows."""
    model = initialise(Pendulum(L=length, x=x0, y=0.3), free=["y"])
    return simulate(model, 1.3, save="end", rtol=1e-10).final.x


@pytest.mark.thorough
def test_gradients() -> None:
    point = (jnp.asarray(1.1), jnp.asarray(0.9))
    forward = jax.jit(jax.jacfwd(swing, argnums=(0, 1)))(*point)
    reverse = jax.jit(jax.grad(swing, argnums=(0, 1)))(*point)
    run, h = jax.jit(swing), 1e-5
    numeric = [
        (run(point[0] + h, point[1]) - run(point[0] - h, point[1])) / (2.0 * h),
        (run(point[0], point[1] + h) - run(point[0], point[1] - h)) / (2.0 * h),
    ]
    np.testing.assert_allclose(forward, numeric, rtol=1e-6)
    np.testing.assert_allclose(reverse, forward, rtol=1e-9)


@pytest.mark.slow
def test_batch() -> None:
    lengths = jnp.linspace(1.0, 2.0, 3)
    together = jax.jit(jax.vmap(lambda length: swing(length, 0.9)))(lengths)
    np.testing.assert_allclose(together, [jax.jit(swing)(length, 0.9) for length in lengths], rtol=1e-10)


@pytest.mark.thorough
def test_slider_crank_turns_over() -> None:
    model = SliderCrank(phi=0.0, psi=0.0, x=0.4, w=30.0)
    assert len(structure(model).invariants) >= 2
    sol = simulate(model, 1.0, save=np.linspace(0.0, 1.0, 41), rtol=1e-9)
    phi = np.asarray(sol.phi)
    assert phi[-1] > 4.0 * np.pi
    np.testing.assert_allclose(sol.x, 0.1 * np.cos(phi) + np.sqrt(0.3**2 - (0.1 * np.sin(phi)) ** 2), atol=1e-9)
    energy = jax.vmap(lambda s: s.kinetic_energy(), in_axes=(_over_time(model),))(sol.values)
    np.testing.assert_allclose(energy, energy[0], rtol=1e-7)


def _over_time(model: Component) -> Any:
    """The time axis of each leaf in a view of the model; None for leaves without one."""
    from acausal._declare.layout import rebuilt

    return rebuilt(model, lambda path, declaration, value: None if declaration.role == "param" else 0)


@pytest.mark.slow
def test_four_bar_linkage() -> None:
    """Arrays are taken apart where their elements are determined one by one."""
    start = initialise(
        FourBar(lengths=[1.0, 3.0, 2.5, 3.0], J=[0.5, 1.0, 0.8], angles=[0.3, 0.8, 1.6], w=[6.0, 0.0, 0.0]),
        lambda s, d: dict(crank=eq(s.angles[0], 0.3), speed=eq(s.w[0], 6.0)),
        free="all",
    )
    sol = simulate(start, 3.0, save=np.linspace(0.0, 3.0, 31), rtol=1e-9)
    assert np.ptp(np.asarray(sol.angles[:, 0])) > 2.0 * np.pi
    closure = jax.vmap(lambda s: s.closure(), in_axes=(_over_time(start),))(sol.values)
    np.testing.assert_allclose(closure, 0.0, atol=1e-8)
    energy = jax.vmap(lambda s: s.kinetic_energy(), in_axes=(_over_time(start),))(sol.values)
    np.testing.assert_allclose(energy, energy[0], rtol=1e-6)


@pytest.mark.slow
def test_another_solver() -> None:
    import diffrax

    model = Pendulum(x=1.0, y=0.0)
    for solver, rtol in ((diffrax.Tsit5(), 1e-9), (Rodas3P(), 1e-8)):
        sol = simulate(model, 2.0, save="end", rtol=rtol, solver=solver, max_steps=20_000)
        np.testing.assert_allclose(sol.final.x, 0.793566195343, atol=1e-6)
        np.testing.assert_allclose(sol.final.x**2 + sol.final.y**2, 1.0, atol=1e-13)


@pytest.mark.thorough
def test_the_mass_matrix_form() -> None:
    model = Pendulum(x=1.0, y=0.0)
    sol = simulate(model, 2.0, save="end", rtol=1e-9, system=choose_states(model, algebraic="integrate"))
    np.testing.assert_allclose(sol.final.x, 0.793566195343, atol=1e-7)


@pytest.mark.slow
def test_never_forces_a_choice() -> None:
    report = structure(Swing())
    assert report.invariants == ()
    assert set(report.states) <= {"x", "u", "der(x)"}
    sol = simulate(Swing(x=0.5), 1.0, save="end", rtol=1e-10)
    full = simulate(Pendulum(x=0.5, y=-np.sqrt(0.75)), 1.0, save="end", rtol=1e-10)
    np.testing.assert_allclose(sol.final.x, full.final.x, rtol=1e-8)


def test_never_without_a_choice() -> None:
    class Lone(Component):
        x: Var[Scalar, "m", never] = 1.0
        T: Param[Scalar, "s"] = 1.0

        def equations(self, d: Self) -> Equations:
            return dict(decay=eq(self.T * d.x, -self.x))

    with pytest.raises(StructureError, match="x must be a state although it is declared `never`"):
        simulate(Lone(), 1.0)


def test_start_off_the_constraint() -> None:
    """The given start contradicts the rod, and the message names it."""
    with pytest.raises(Exception, match=r"contradict.* [xy] cannot have the value"):
        simulate(Pendulum(x=1.0, y=1.0), 1.0)


@pytest.mark.thorough
def test_compiled_once() -> None:
    @eqx.filter_jit
    def run(x0: Any) -> Any:
        return simulate(Pendulum(x=x0, y=0.0, L=x0), 0.1, save="end").final.y

    np.testing.assert_allclose(run(jnp.asarray(1.0)), run(jnp.asarray(2.0)), rtol=0.02)


class Reeled(Component, partial=True):
    """A pendulum whose rod is as long as events say."""

    share: Param[Scalar, "1"] = 0.8
    g: Param[Scalar, "m/s2"] = G
    L: Discrete[Scalar, "m"] = 1.0
    x: Var[Scalar, "m"] = 1.0
    y: Var[Scalar, "m"] = 0.0
    u: Var[Scalar, "m/s"] = 0.0
    v: Var[Scalar, "m/s"] = 0.0
    force: Var[Scalar, "1/s2", Nominal(100.0)] = 0.0

    def falls(self) -> Any:
        """Whether it has fallen by 0.5 m on its first rod."""
        return (self.y < -0.5) & (self.L > 0.9)

    def equations(self, d: Any) -> Equations:
        return dict(
            speed_x=eq(self.u, d.x),
            speed_y=eq(self.v, d.y),
            newton_x=eq(d.u, -self.force * self.x),
            newton_y=eq(d.v, -self.force * self.y - self.g),
            rod=eq(self.x**2 + self.y**2, self.L**2),
        )


class Shortened(Reeled):
    """Straight in on the way down, so that only the place jumps. At the lowest point an event sets one speed."""

    def events(self) -> Events:
        return dict(
            reel=when(self.falls(), L=self.share * self.L),
            slow=when(self.x < 0.0, u=0.5 * self.u),
        )


class Drawn(Reeled):
    """In at constant angular momentum: the event sets all that it changes."""

    def events(self) -> Events:
        k = self.share
        return dict(
            reel=when(self.falls(), L=k * self.L, x=k * self.x, y=k * self.y, u=self.u / k, v=self.v / k),
        )


class ReeledAtTheStart(Reeled):
    """Short from the start on, where it is given on the longer circle."""

    def events(self) -> Events:
        return dict(reel=at(0.0, L=self.share * self.L))


class Torn(Reeled):
    """An event sets a place that the rod, which it shortens, does not reach."""

    def events(self) -> Events:
        return dict(tear=when(self.falls(), L=self.share * self.L, x=0.9))


@pytest.mark.parametrize(
    ("model", "after"),
    [
        (Shortened(), 0.5 * G - 0.4 * G),
        pytest.param(Drawn(), 0.5 * G / 0.64 - 0.4 * G, marks=pytest.mark.slow),
        pytest.param(ReeledAtTheStart(), 0.0, marks=pytest.mark.slow),
    ],
)
def test_the_rod_is_as_long_as_the_last_event_says(model: Any, after: float) -> None:
    """From the event on the mass is on the new circle, with an energy per mass that follows from its place and speed.

    It has fallen by 0.5 m then, so that the square of its speed is g times 1 m.
    """
    times = np.linspace(0.0, 1.0, 21)
    sol = simulate(model, 1.0, save=times, rtol=1e-9)
    length = np.asarray(sol.L)
    assert length[-1] == 0.8
    np.testing.assert_allclose(np.hypot(sol.x, sol.y), length, rtol=1e-8)
    np.testing.assert_allclose(sol.x * sol.u + sol.y * sol.v, 0.0, atol=1e-7)
    energy = 0.5 * (np.asarray(sol.u) ** 2 + np.asarray(sol.v) ** 2) + G * np.asarray(sol.y)
    falls = np.asarray(sol.x) > 0.0
    expected = np.where(length < 1.0, after, 0.0)
    np.testing.assert_allclose(energy[falls], expected[falls], atol=1e-6)


@pytest.mark.thorough
def test_derivatives_with_a_rod_that_changes() -> None:
    """By the share that is left of the rod, in both modes."""

    def end(share: Scalar) -> Scalar:
        return simulate(Shortened(share=share), 0.6, save="end", rtol=1e-10).final.x

    slope, h = jax.jacfwd(end)(0.8), 1e-4
    np.testing.assert_allclose(slope, (end(0.8 + h) - end(0.8 - h)) / (2.0 * h), rtol=1e-6)
    np.testing.assert_allclose(jax.grad(end)(0.8), slope, rtol=1e-8)


@pytest.mark.thorough
def test_values_that_a_rod_forbids() -> None:
    with pytest.raises(SimulationError, match="An event sets variables to values that contradict the constraints"):
        simulate(Torn(), 1.0)
