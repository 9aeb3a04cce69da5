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
    Equations,
    Param,
    Scalar,
    StructureError,
    Var,
    choose_states,
    eq,
    initialise,
    never,
    simulate,
    structure,
)
from acausal._integrate.solvers import Rodas3P

G = 9.81


@pytest.fixture(scope="module")
def released() -> Any:
    """From rest at the horizontal, at the times of the published values."""
    return simulate(Pendulum(x=1.0, y=0.0), 10.0, save=np.array([0.5, 1.0, 2.0, 10.0]), rtol=1e-10, max_steps=10_000)


def test_pendulum(released: Any) -> None:
    k = np.sin(np.pi / 4)
    angle = 2.0 * np.arcsin(k * ellipj(ellipk(k**2) - np.sqrt(G) * np.asarray(released.ts), k**2)[0])
    np.testing.assert_allclose(released.x, np.sin(angle), atol=1e-9)
    np.testing.assert_allclose(released.y, -np.cos(angle), atol=1e-9)
    np.testing.assert_allclose(released.x[:3], [0.391048791551, -0.986291751132, 0.793566195343], atol=1e-9)


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
    """Where a pendulum is after some time, having gone over y = 0 twice; it starts from where its rod allows."""
    model = initialise(Pendulum(L=length, x=x0, y=0.3), free=["y"])
    return simulate(model, 1.3, save="end", rtol=1e-10).final.x


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
    """Which leaves of a view of the model have a time axis."""
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

    with pytest.raises(StructureError, match="x must be a state although declared `never`"):
        simulate(Lone(), 1.0)


def test_start_off_the_constraint() -> None:
    """What is given contradicts the rod; the message names it."""
    with pytest.raises(Exception, match=r"contradict.* [xy] cannot have the value"):
        simulate(Pendulum(x=1.0, y=1.0), 1.0)


def test_compiled_once() -> None:
    @eqx.filter_jit
    def run(x0: Any) -> Any:
        return simulate(Pendulum(x=x0, y=0.0, L=x0), 0.1, save="end").final.y

    np.testing.assert_allclose(run(jnp.asarray(1.0)), run(jnp.asarray(2.0)), rtol=0.02)
