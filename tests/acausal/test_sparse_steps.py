"""Steps with a sparse Jacobian: the same results as with a dense one."""

import contextlib
import functools as ft
from collections.abc import Iterator

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from acausal import Array, Component, Connections, connect, repeat, replace, simulate, structure
from acausal._evaluate.building import system_of
from acausal._evaluate.dependence import dependence
from acausal._integrate.loop import steps
from acausal._integrate.setup import pattern
from components.hydraulic import ConstantPressure, Pipe, iso_vg_46
from components.rotational import Fixed, Inertia, SpringDamper

N = 5


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


@ft.cache
def chain() -> Chain:
    return Chain(
        wall=Fixed(),
        springs=repeat(SpringDamper(c=100.0, d=0.1), N),
        inertias=repeat(Inertia(J=1.0, w=1.0), N),
    )


def results(c: float, model: Chain) -> jax.Array:
    """Speeds at the end, an integral over a run, and the instant of a stop condition."""
    model = replace(model, {"springs.item.c": jnp.full(N, c)})
    solution = simulate(
        model,
        1.0,
        rtol=1e-8,
        integrals=lambda s: {"square": s.inertias[1].w ** 2},
        until=lambda s: s.springs[0].tau ** 2 - 25.0,
        save="end",
    )
    return jnp.stack([solution[f"inertias[{N - 1}].a.phi"][-1], solution.integrals["square"][-1], solution.t1])


class Line(Component):
    """A pipe between a closed end and a given pressure."""

    source: ConstantPressure
    pipe: Pipe

    def connections(self) -> Connections:
        return (connect(self.source.port, self.pipe.a),)


LINE = Line(source=ConstantPressure(pressure=1e6), pipe=Pipe(n=9, length=1.0, diameter=0.01, liquid=iso_vg_46()))


@pytest.mark.parametrize("model", [chain(), LINE], ids=["array of components", "array variables"])
def test_the_structure_is_that_of_the_jacobian(model: Component) -> None:
    system = system_of(model)
    structure = dependence(system.plan, system.rates).toarray() != 0
    y = jnp.asarray(np.random.default_rng(0).normal(size=len(system.nominals)) * system.nominals)
    inputs = system.pack(model)
    jacobian = np.asarray(jax.jacfwd(lambda y: system.vector_field(0.0, y, inputs))(y))
    assert not (jacobian[~structure] != 0.0).any()
    assert structure.sum() < 5 * len(y)


def test_structure_says_how_sparse_a_step_is() -> None:
    springs, inertias = repeat(SpringDamper(c=1.0, d=1.0), 40), repeat(Inertia(J=1.0), 40)
    # Two speeds give the rate of an angle, and two angles and three speeds that of a speed, except at the ends.
    long = Chain(wall=Fixed(), springs=springs, inertias=inertias)
    assert "Steps: sparse, 276 entries in 6 colours; elimination fills in" in str(structure(long))
    assert "Steps" not in str(structure(chain()))


def test_integrals_do_not_count_as_states() -> None:
    assert pattern.pattern_of_rates(system_of(chain()), (), 100) is None


@contextlib.contextmanager
def sparse_steps() -> Iterator[None]:
    """Steps of small models are sparse too."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pattern, "LARGEST_INVERSE", 0)
        patch.setattr(pattern, "SERIAL", 1e-6)
        pattern.pattern_of_rates.cache_clear()
        yield
    pattern.pattern_of_rates.cache_clear()


@pytest.fixture
def small_models_are_sparse() -> Iterator[None]:
    with sparse_steps():
        yield


@pytest.fixture(scope="module")
def with_sparse_steps() -> tuple[jax.Array, jax.Array]:
    with sparse_steps():
        assert pattern.pattern_of_rates(system_of(chain())) is not None
        return computed()


def computed() -> tuple[jax.Array, jax.Array]:
    """Results and their derivatives in forward mode."""
    return jax.jit(lambda c: jax.jvp(lambda c: results(c, chain()), (c,), (jnp.ones(()),)))(jnp.asarray(100.0))


@pytest.mark.thorough
def test_results_and_derivatives_are_those_of_dense_steps(
    with_sparse_steps: tuple[jax.Array, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(steps, "jacobian_pattern", lambda settings: None)
    jax.clear_caches()
    for found, expected in zip(with_sparse_steps, computed(), strict=True):
        np.testing.assert_allclose(found, expected, rtol=1e-9)


@pytest.mark.thorough
@pytest.mark.usefixtures("small_models_are_sparse")
def test_reverse_mode_agrees_with_forward_mode(with_sparse_steps: tuple[jax.Array, ...]) -> None:
    backward = jax.grad(lambda c: results(c, chain())[2])(100.0)
    np.testing.assert_allclose(backward, with_sparse_steps[1][2], rtol=1e-8)


@pytest.mark.thorough
@pytest.mark.usefixtures("small_models_are_sparse")
def test_a_batch_gives_the_results_of_single_runs(with_sparse_steps: tuple[jax.Array, ...]) -> None:
    many = jax.jit(jax.vmap(lambda c: results(c, chain())))(jnp.array([100.0, 150.0]))
    np.testing.assert_allclose(many[0], with_sparse_steps[0], rtol=1e-9)
