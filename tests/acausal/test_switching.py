"""The choice between implicit and explicit steps in a run of a large model."""

import functools as ft
import types
from collections.abc import Iterator
from typing import Any

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from acausal import Array, Component, Connections, Rodas5P, connect, repeat, replace, simulate
from acausal._evaluate.building import system_of
from acausal._integrate.setup import pattern
from acausal._integrate.simulate import _solver_for
from acausal._integrate.solvers._dopri5 import dopri5_step
from acausal._integrate.solvers._rosenbrock import RosenbrockInterpolation
from acausal._integrate.solvers._switching import PATIENCE, TRIAL, MethodChoice, SwitchingRodas5P
from components.rotational import Fixed, Inertia, SpringDamper
from components.thermal import FixedTemperature, HeatCapacitor, ThermalConductor

N, END, RTOL = 3, 3.0, 1e-9


class Chain(Component):
    """Inertias with springs between them and to a wall."""

    wall: Fixed
    springs: Array[SpringDamper]
    inertias: Array[Inertia]

    def connections(self) -> Connections:
        return (
            connect(self.wall.flange, self.springs[0].a),
            connect(self.inertias[:-1].b, self.springs[1:].a),
            connect(self.springs[:].b, self.inertias[:].a),
        )


class Wall(Component):
    """Capacities in a row, heated at one end."""

    hot: FixedTemperature
    conductors: Array[ThermalConductor]
    capacities: Array[HeatCapacitor]

    def connections(self) -> Connections:
        return (
            connect(self.hot.port, self.conductors[0].a),
            connect(self.conductors[:].b, self.capacities[:].port),
            connect(self.capacities[:-1].port, self.conductors[1:].a),
        )


@ft.cache
def chain(n: int = N) -> Chain:
    springs, inertias = repeat(SpringDamper(c=100.0, d=0.1), n), repeat(Inertia(J=1.0, w=1.0), n)
    return Chain(wall=Fixed(), springs=springs, inertias=inertias)


@pytest.fixture
def small_models_are_large() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pattern, "LARGEST_INVERSE", 0)
        yield


def run(
    c: Any,
    solver: diffrax.AbstractSolver | None = None,
    rtol: float = RTOL,
    times: tuple[float, ...] = (0.0, 0.1, 0.25, END),
    **options: Any,
) -> Any:
    """Waves with a stop condition, an integral, an energy account, a peak and saved times."""
    t0, *between, t1 = times
    return simulate(
        replace(chain(), {"springs.item.c": c * jnp.ones(N)}),
        t1,
        t0=t0,
        rtol=rtol,
        until=lambda s: s.springs[0].tau - 0.3 * s.springs[1].tau - 2.0,
        direction="down",
        integrals=lambda s: {"square": s.inertias[1].w ** 2},
        peaks=lambda s: {"torque": s.springs[0].tau},
        energy=True,
        save=jnp.array(between),
        solver=solver,
        **options,
    )


def results(c: Any, solver: diffrax.AbstractSolver | None = None, rtol: float = RTOL, **options: Any) -> jax.Array:
    found = run(c, solver, rtol, **options)
    peak = found.peaks["torque"]
    values = [found.t1, found.integrals["square"][-1], peak.value, peak.time, *found["inertias[2].a.phi"]]
    return jnp.stack([*values, *found["springs[1].tau"]])


def steps(solution: Any) -> tuple[int, int]:
    """The numbers of explicit and implicit steps."""
    explicit, implicit = (int(solution.stats[f"num_{kind}_steps"]) for kind in ("explicit", "implicit"))
    assert explicit + implicit == int(solution.stats["num_accepted_steps"])
    return explicit, implicit


def solver_of(model: Component) -> diffrax.AbstractSolver:
    return _solver_for(system_of(model), None)


def test_only_large_models_without_a_mass_matrix_switch() -> None:
    assert type(solver_of(chain())) is Rodas5P
    assert type(solver_of(chain(30))) is SwitchingRodas5P
    with_mass: Any = types.SimpleNamespace(mass=np.ones(60), nominals=np.ones(60), solved=None)
    assert type(_solver_for(with_mass, None)) is Rodas5P
    given = diffrax.Tsit5()
    assert _solver_for(system_of(chain(30)), given) is given


@pytest.mark.usefixtures("small_models_are_large")
def test_waves_take_explicit_steps_with_the_same_results() -> None:
    """Also for events, integrals, peaks and saved times; and the dense output agrees with the stop condition."""
    found = run(100.0)
    explicit, implicit = steps(found)
    assert explicit > 5 * implicit > 0
    np.testing.assert_allclose(results(100.0), results(100.0, Rodas5P()), rtol=1e-6)
    np.testing.assert_allclose(found.energy.totals[1:], run(100.0, Rodas5P()).energy.totals[1:], atol=1e-6)
    assert abs(found.at(found.t1).springs[0].tau - 0.3 * found.at(found.t1).springs[1].tau - 2.0) < 1e-6


@pytest.mark.usefixtures("small_models_are_large")
def test_the_error_follows_the_tolerance() -> None:
    exact = results(100.0, rtol=1e-12)
    errors = [float(jnp.max(jnp.abs(results(100.0, rtol=rtol) / exact - 1.0))) for rtol in (1e-5, 1e-7, 1e-9)]
    assert np.all(np.array(errors) < [2e-3, 2e-5, 2e-7])


@pytest.mark.slow
@pytest.mark.usefixtures("small_models_are_large")
def test_derivatives_in_both_modes() -> None:
    forward = jax.jvp(results, (100.0,), (1.0,))[1]
    step = 1e-3
    numeric = (results(100.0 + step, rtol=1e-12) - results(100.0 - step, rtol=1e-12)) / (2.0 * step)
    np.testing.assert_allclose(forward, numeric, rtol=1e-4, atol=1e-7)
    weights = jnp.arange(1.0, 1.0 + len(forward))
    backward = jax.grad(lambda c: weights @ results(c, adjoint=diffrax.DirectAdjoint(), max_steps=128))(100.0)
    np.testing.assert_allclose(backward, weights @ forward, rtol=1e-7)


@pytest.mark.usefixtures("small_models_are_large")
def test_a_run_backwards_switches_too() -> None:
    found, expected = (run(100.0, solver, times=(0.0, -0.1, -0.25, -0.4), throw=False) for solver in (None, Rodas5P()))
    assert steps(found)[0] > steps(found)[1]
    np.testing.assert_allclose(found["inertias[2].a.phi"], expected["inertias[2].a.phi"], rtol=1e-7)


@pytest.mark.thorough
@pytest.mark.usefixtures("small_models_are_large")
def test_a_batch_takes_implicit_steps() -> None:
    def final(c: Any, solver: diffrax.AbstractSolver | None = None) -> Any:
        found = simulate(replace(chain(), {"springs.item.c": c * jnp.ones(N)}), 1.0, save="end", solver=solver)
        return found["inertias[0].w"][-1], found.stats

    values, stats = jax.vmap(final)(jnp.array([100.0, 200.0]))
    assert stats["num_explicit_steps"].tolist() == [0, 0]
    np.testing.assert_allclose(values[0], final(100.0, Rodas5P())[0], rtol=1e-12)


def test_a_stiff_model_takes_implicit_steps() -> None:
    n = 60
    wall = Wall(
        hot=FixedTemperature(temperature=400.0),
        conductors=repeat(ThermalConductor(G=10.0), n),
        capacities=repeat(HeatCapacitor(C=1.0, T=293.15), n),
    )
    found = simulate(wall, 2000.0, save="end")  # Rodas5P alone takes 40 steps
    assert steps(found)[1] > 25
    assert int(found.stats["num_steps"]) < 50
    np.testing.assert_allclose(found.final.capacities.item.T, 400.0, rtol=1e-4)


def choices(choice: MethodChoice, fit: str) -> str:
    """The kinds of steps (explicit, implicit) for which each explicit step, where one is tried, is fit (+) or not."""
    kinds = ""
    for is_fit in fit:
        is_tried = choice.tries_explicit
        kinds += "e" if is_tried and is_fit == "+" else "i"
        choice = choice.after(is_tried, jnp.asarray(is_fit == "+"))
    return kinds


def test_trials_become_rare_while_they_confirm_the_choice() -> None:
    start = SwitchingRodas5P().init(None, 0.0, 1.0, jnp.zeros(1), None)
    with jax.disable_jit():
        first, second = "e" * (1 + PATIENCE) + "i" * TRIAL, "e" * (1 + 2 * PATIENCE) + "i" * TRIAL
        assert choices(start, "+" * len(first + second)) == first + second
        assert choices(start, "-" + "-" * 3 * PATIENCE) == "i" * (1 + 3 * PATIENCE)
        assert choices(start, "-" + "+" * (1 + 2 * PATIENCE)) == "i" * (1 + 2 * PATIENCE) + "e"
        assert choices(start, "++-" + "+" * PATIENCE) == "ee" + "i" * (1 + PATIENCE)


def test_an_explicit_step_is_one_of_dormand_and_prince() -> None:
    """With a dense output of order 4."""

    def field(t: Any, y: jax.Array) -> jax.Array:
        return jnp.stack([y[1], -jnp.sin(y[0]) + jnp.cos(t)])

    y0 = jnp.array([0.5, -0.3])
    term, solver = diffrax.ODETerm(lambda t, y, args: field(t, y)), diffrax.Dopri5()
    state = solver.init(term, 0.0, 0.1, y0, None)
    y1, error, *_ = solver.step(term, 0.0, 0.1, y0, None, state, made_jump=False)
    found = dopri5_step(field, 0.0, 0.1, y0)
    np.testing.assert_allclose(found.end, y1, rtol=1e-14)
    np.testing.assert_allclose(found.error, error, rtol=1e-6, atol=1e-16)

    def dense_error(h: float) -> float:
        step = dopri5_step(field, 0.0, h, y0)
        path = RosenbrockInterpolation(t0=jnp.asarray(0.0), t1=jnp.asarray(h), **step.info)
        exact = dopri5_step(field, 0.0, 0.3 * h, y0).end
        return float(jnp.max(jnp.abs(path.evaluate(0.3 * h) - exact)))

    assert dense_error(0.1) / dense_error(0.05) == pytest.approx(2.0**5, rel=0.3)
