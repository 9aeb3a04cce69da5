"""Learned laws: passive for all weights, differentiable in both modes, and trained through a simulation."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from acausal import ArgumentError, Component, Connections, ParameterError, connect, parameters, replace, simulate
from acausal.testing import solved
from components.blocks import MonotoneCurve, Network
from components.rotational import Inertia, LearnedFriction, LearnedSpring, SmoothLearnedFriction

SEEDS = st.integers(0, 2**31 - 1)


def mlp(seed: int, width: int = 4, size: str | int = "scalar") -> Any:
    return eqx.nn.MLP(size, size, width, 1, jax.lax.tanh, key=jax.random.key(seed))  # pyright: ignore[reportArgumentType]


class RunDown(Component):
    """A wheel with learned friction."""

    wheel: Inertia
    friction: SmoothLearnedFriction

    def connections(self) -> Connections:
        return (connect(self.wheel.b, self.friction.flange),)


def run_down(seed: int = 0) -> RunDown:
    friction = SmoothLearnedFriction(network=Network(mlp(seed)), T=0.1, ws=10.0, w0=1.0)
    return RunDown(wheel=Inertia(J=0.01, w=20.0), friction=friction)


def test_a_network_computes_what_its_module_does() -> None:
    module = mlp(3)
    network, x = Network(module), jnp.array(0.7)
    assert network(x) == module(x)
    assert network.weights.shape == (13,)
    assert all(bool(jnp.array_equal(a, b)) for a, b in zip(leaves(network.module), leaves(module), strict=True))


def leaves(module: Any) -> list[Any]:
    return jax.tree_util.tree_leaves(eqx.filter(module, eqx.is_array))


def test_networks_that_differ_in_weights_alone_have_one_structure() -> None:
    first, second, wide = Network(mlp(0)), Network(mlp(1)), Network(mlp(0, width=5))
    assert jax.tree_util.tree_structure(first) == jax.tree_util.tree_structure(second)
    assert first.form != wide.form
    assert repr(first.form) == "MLP with 13 weights"  # without addresses, which would differ between processes


def test_a_network_with_one_hidden_layer() -> None:
    network = Network.of(4, jax.random.key(0))
    assert network.weights.shape == (13,)
    assert network(jnp.array(0.7)) == mlp(0)(jnp.array(0.7))


def test_a_network_with_several_inputs() -> None:
    module = mlp(0, size=2)
    assert jnp.array_equal(Network(module)(jnp.ones(2)), module(jnp.ones(2)))


@pytest.mark.parametrize("module", [3.0, jnp.tanh, jnp.ones(3)], ids=["number", "function", "array"])
def test_other_modules_are_refused(module: Any) -> None:
    with pytest.raises(ArgumentError, match="Network takes a callable module with arrays of floats"):
        Network(module)


def test_a_network_for_another_shape_is_refused() -> None:
    with pytest.raises(ParameterError, match=r"LearnedFriction\.network must map a number to a number"):
        LearnedFriction(network=Network(mlp(0, size=1)), T=1.0, ws=1.0)


def test_weights_of_another_number_are_refused() -> None:
    with pytest.raises(ParameterError, match=r"weights must be a vector for an MLP with 13 weights"):
        simulate(replace(run_down(), {"friction.network.weights": jnp.ones(12)}), 0.1)


def test_terms_of_a_curve_must_match() -> None:
    with pytest.raises(ParameterError, match=r"MonotoneCurve\.heights must have the shape of slopes and offsets"):
        MonotoneCurve(heights=[0.0, 1.0], slopes=[0.0], offsets=[0.0])


SPEEDS = jnp.linspace(-40.0, 40.0, 101)


@jax.jit
def smooth_and_dry(weights: Any) -> tuple[Any, Any]:
    """The torques of smooth friction, and the levels of dry friction, at some speeds."""
    network = eqx.tree_at(lambda n: n.weights, Network(mlp(0)), weights)
    smooth = SmoothLearnedFriction(network=network, T=0.1, ws=10.0, w0=1.0)
    dry = LearnedFriction(network=network, T=0.1, ws=10.0)
    return jax.vmap(smooth.torque)(SPEEDS), jax.vmap(dry.sliding)(jnp.abs(SPEEDS))


@settings(max_examples=50, deadline=None)
@given(seed=SEEDS, size=st.floats(0.1, 30.0))
def test_friction_never_supplies_power(seed: int, size: float) -> None:
    """For all weights, also large ones."""
    torques, levels = map(np.asarray, smooth_and_dry(size * np.random.default_rng(seed).standard_normal(13)))
    assert np.all(torques * SPEEDS >= 0.0)
    assert np.allclose(torques, -torques[::-1], rtol=1e-12)
    assert np.all(levels >= 0.0)


@jax.jit
def risen(terms: Any) -> Any:
    """A curve with these terms at some points."""
    heights, slopes, offsets = terms
    curve = MonotoneCurve(heights=heights, slopes=slopes, offsets=offsets, linear=-2.0)
    return jax.vmap(curve)(jnp.linspace(-3.0, 3.0, 61))


@settings(max_examples=50, deadline=None)
@given(seed=SEEDS, size=st.floats(0.1, 5.0))
def test_a_monotone_curve_rises_through_zero(seed: int, size: float) -> None:
    y = np.asarray(risen(size * np.random.default_rng(seed).standard_normal((3, 5))))
    assert np.all(np.diff(y) > 0.0)
    assert y[30] == 0.0


def test_the_torque_of_a_spring_is_the_slope_of_its_energy() -> None:
    spring = LearnedSpring(network=Network(mlp(0)), T=2.0, phi0=0.1)

    def energy(phi: Any) -> Any:
        return spring.T * spring.phi0 * spring.stored(phi / spring.phi0)

    found = solved(spring, {"phi_rel": 0.03})["tau"]
    assert float(found) == pytest.approx(float(jax.grad(energy)(0.03)), rel=1e-12)
    assert energy(0.03) > 0.0


def test_gradients_of_a_run_are_right() -> None:
    """Reverse mode over all weights, forward mode and central differences along one direction."""
    model = run_down()
    weights = parameters(model)["friction.network.weights"]
    along = jnp.asarray(np.random.default_rng(0).standard_normal(len(weights)))

    def final_speed(weights: Any) -> Any:
        changed = replace(model, {"friction.network.weights": weights})
        return simulate(changed, 0.5, save="end", rtol=1e-9).final.wheel.w

    slopes = jax.jit(jax.grad(final_speed))(weights)
    forward = jax.jit(lambda weights: jax.jvp(final_speed, (weights,), (along,)))
    assert float(forward(weights)[1]) == pytest.approx(float(slopes @ along), rel=1e-7)
    h = 1e-4
    central = (forward(weights + h * along)[0] - forward(weights - h * along)[0]) / (2.0 * h)
    assert float(slopes @ along) == pytest.approx(float(central), rel=1e-5)
