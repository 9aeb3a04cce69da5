"""The log-density of a fit for samplers: value, derivatives, bounds and priors."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from _problems import GearedLoad

from acausal import ArgumentError
from acausal.design import Experiment, Fit, Normal, identify

MEASURED, SIGMA = {"time": 0.31, "speed": 190.0}, {"time": 0.01, "speed": 5.0}
PRIOR = (0.02, 0.002)


@pytest.fixture(scope="module")
def fit() -> Fit[GearedLoad]:
    def predict(model: GearedLoad) -> dict[str, Any]:
        return {"time": model.time, "speed": model.motor_speed}

    data = Experiment(predict, MEASURED, SIGMA, units={"time": "s", "speed": "rad/s"})
    free = {"J_load": (1e-3, 1.0), "torque": (0.01, 1.0)}
    return identify(GearedLoad(), free, data, priors={"J_load": Normal(*PRIOR)})


def by_hand(x: Any) -> Any:
    """Likelihood and prior, written out."""
    model = GearedLoad(J_load=x[0], torque=x[1])
    found = ((model.time - 0.31) / 0.01, (model.motor_speed - 190.0) / 5.0, (x[0] - PRIOR[0]) / PRIOR[1])
    return -0.5 * sum(residual**2 for residual in found)


X = jnp.array([0.03, 0.3])


def test_density_and_gradient(fit: Fit[GearedLoad]) -> None:
    value, slopes = jax.jit(jax.value_and_grad(fit.log_density))(X)
    assert float(value) == pytest.approx(float(by_hand(X)), rel=1e-12)
    np.testing.assert_allclose(slopes, jax.grad(by_hand)(X), rtol=1e-9)
    along = jnp.array([1e-3, -1e-2])
    forward = jax.jvp(fit.log_density, (X,), (along,))[1]
    h = 1e-4
    central = (fit.log_density(X + h * along) - fit.log_density(X - h * along)) / (2.0 * h)
    assert float(forward) == pytest.approx(float(slopes @ along), rel=1e-12)
    assert float(forward) == pytest.approx(float(central), rel=1e-6)


def test_the_estimates_are_the_maximum(fit: Fit[GearedLoad]) -> None:
    assert float(fit.log_density(fit.estimates)) == pytest.approx(-0.5 * fit.chi2, rel=1e-9)
    np.testing.assert_allclose(np.asarray(jax.grad(fit.log_density)(fit.estimates)) * fit.std, 0.0, atol=1e-5)


def test_outside_the_bounds_the_density_is_zero(fit: Fit[GearedLoad]) -> None:
    for x in ([1e-4, 0.3], [0.03, 1.1]):
        value, slopes = jax.value_and_grad(fit.log_density)(jnp.array(x))
        assert value == -jnp.inf
        assert np.all(np.isfinite(slopes))


def test_a_point_that_is_not_a_number_has_no_density(fit: Fit[GearedLoad]) -> None:
    assert fit.log_density([jnp.nan, 0.3]) == -jnp.inf


def test_where_a_prediction_fails_the_density_is_practically_zero() -> None:
    def predict(model: GearedLoad) -> dict[str, Any]:
        return {"speed": jnp.where(jnp.asarray(model.J_load) > 0.1, jnp.nan, model.motor_speed)}

    data = Experiment(predict, {"speed": 190.0}, {"speed": 5.0}, units={"speed": "rad/s"})
    fit = identify(GearedLoad(), {"J_load": (1e-3, 1.0)}, data)
    value, slope = jax.value_and_grad(fit.log_density)(jnp.array([0.5]))
    assert np.isfinite(value)
    assert value < -1e10
    assert np.isfinite(slope).all()


@pytest.mark.parametrize("x", [0.1, [0.1], [[0.03, 0.3]], [0.03, 0.3, 1.0]], ids=["number", "one", "batch", "three"])
def test_a_point_of_another_shape_is_refused(fit: Fit[GearedLoad], x: Any) -> None:
    with pytest.raises(ArgumentError, match=r"log_density takes a vector of 2 numbers \(J_load, torque\)"):
        fit.log_density(x)


@pytest.mark.slow
def test_a_sampler_finds_the_intervals_of_a_fit(fit: Fit[GearedLoad]) -> None:
    """The posterior of a nearly linear problem is that of the fit."""
    blackjax: Any = pytest.importorskip("blackjax")
    warm, run = jax.random.split(jax.random.key(0))
    adaptation = blackjax.window_adaptation(blackjax.nuts, fit.log_density)
    (state, settings), _ = adaptation.run(warm, jnp.asarray(fit.estimates), num_steps=300)
    kernel = blackjax.nuts(fit.log_density, **settings)

    def step(state: Any, key: Any) -> tuple[Any, Any]:
        state, _ = kernel.step(key, state)
        return state, state.position

    draws = np.asarray(jax.lax.scan(step, state, jax.random.split(run, 2000))[1])
    np.testing.assert_allclose(draws.std(axis=0), fit.std, rtol=0.15)
    np.testing.assert_allclose(draws.mean(axis=0), fit.estimates, atol=0.2 * np.max(fit.std), rtol=0.1)
