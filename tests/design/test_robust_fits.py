"""Fits of data with outliers: estimates, covariance and noise, and what is refused."""

from typing import Any, Literal

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.stats import binom

from acausal import Component, ModelError, Param, ParameterError, Scalar
from acausal.design import Experiment, Fit, Normal, identify

LOSSES = ("huber", "soft_l1")
TIMES = np.linspace(0.0, 3.0, 40)
TRUE, NOISE = (2.0, 0.7), 0.05
FREE = {"size": (0.1, 10.0), "rate": (0.1, 5.0)}


class Decay(Component):
    """y = size exp(-rate t)."""

    size: Param[Scalar, "m"] = 1.5
    rate: Param[Scalar, "1/s"] = 1.0

    def at(self, t: Any) -> Any:
        return self.size * jnp.exp(-self.rate * t)


def curve(model: Decay) -> dict[str, Any]:
    return {"y": model.at(TIMES)}


def data(seed: int, outliers: float = 0.1) -> np.ndarray:
    """Noise of the normal distribution, of which a share is twenty times as large."""
    rng = np.random.default_rng(seed)
    noise = NOISE * rng.standard_normal(len(TIMES))
    return TRUE[0] * np.exp(-TRUE[1] * TIMES) + np.where(rng.random(len(TIMES)) < outliers, 20.0 * noise, noise)


def fitted(y: np.ndarray, loss: Any = "linear", sigma: float | None = NOISE, **options: Any) -> Fit[Decay]:
    given = {} if sigma is None else {"y": sigma}
    return identify(Decay(), FREE, Experiment(curve, {"y": y}, given), loss=loss, **options)


@pytest.mark.parametrize("loss", LOSSES)
@pytest.mark.parametrize("scale", [0.5, 1.345])
def test_estimates_are_those_of_scipy(loss: Literal["huber", "soft_l1"], scale: float) -> None:
    y = data(1)
    fit = fitted(y, loss, f_scale=scale, tolerance=1e-12)
    known = least_squares(
        lambda x: (x[0] * np.exp(-x[1] * TIMES) - y) / NOISE, TRUE, loss=loss, f_scale=scale,
        xtol=1e-15, ftol=1e-15, gtol=1e-12,
    )  # fmt: skip
    np.testing.assert_allclose(fit.estimates, known.x, rtol=1e-6)
    assert fit.chi2 == pytest.approx(2.0 * known.cost, rel=1e-9)
    residuals = (fit.predicted["experiment 1: y"] - y) / NOISE
    np.testing.assert_allclose(fit.residuals["experiment 1: y"], residuals, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(residuals, np.asarray(curve(fit.model)["y"] - y) / NOISE, rtol=1e-6, atol=1e-6)
    assert f"sum of {loss} losses" in str(fit)
    assert not any(test.name == "size" for test in fit.tests)


@pytest.mark.parametrize("loss", LOSSES)
def test_covariance_is_the_sandwich(loss: str) -> None:
    """A and B written out with derivatives of the losses by jax."""
    fit = fitted(data(2), loss)

    def rho(r: Any) -> Any:
        return 2.0 * (jnp.sqrt(1.0 + r**2) - 1.0) if loss == "soft_l1" else jnp.where(abs(r) > 1, 2 * abs(r) - 1, r**2)

    r = jnp.asarray(fit.residuals["experiment 1: y"])
    j = np.asarray(jax.jacfwd(lambda x: x[0] * jnp.exp(-x[1] * TIMES) / NOISE)(jnp.asarray(fit.estimates)))
    psi = np.asarray(jax.vmap(jax.grad(rho))(r)) / 2.0
    slope = np.asarray(jax.vmap(jax.grad(jax.grad(rho)))(r)) / 2.0
    inverse = np.linalg.inv(j.T @ (slope[:, None] * j))
    expected = inverse @ (j.T @ (psi[:, None] ** 2 * j)) @ inverse * 40 / 38
    np.testing.assert_allclose(fit.covariance, expected, rtol=1e-6)
    np.testing.assert_allclose(fit.jacobian[:40], j, rtol=1e-6, atol=1e-9)
    np.testing.assert_array_equal(fit.std, fit.std_scaled_by_residual)
    by_shares = [np.array(list(c.shares.values())) * fit.estimates for c in fit.combinations]
    for combination, direction in zip(fit.combinations, by_shares, strict=True):
        along = np.linalg.inv(np.diag(fit.estimates)) @ direction
        relative = fit.covariance / np.outer(fit.estimates, fit.estimates)
        assert combination.std == pytest.approx(np.sqrt(along @ relative @ along), rel=1e-9)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("loss", "sigma"), [("huber", NOISE), ("soft_l1", NOISE), ("huber", None)],
    ids=["huber", "soft_l1", "huber, noise estimated"],
)  # fmt: skip
def test_intervals_hold_the_true_values_at_their_rate(loss: str, sigma: float | None) -> None:
    """Many replications with intervals of 90 %: as many hold as a binomial distribution allows, at either end 0.1 %."""
    n = 200 if sigma else 100
    fits = [fitted(data(100 + i), loss, sigma, level=0.9) for i in range(n)]
    low, high = binom.ppf([0.001, 0.999], n, 0.9)
    hits = np.sum([(fit.low <= TRUE) & (fit.high >= TRUE) for fit in fits], axis=0)
    assert np.all((low <= hits) & (hits <= high)), hits
    spread = np.std([fit.estimates for fit in fits], axis=0, ddof=1)
    np.testing.assert_allclose(spread, np.mean([fit.std for fit in fits], axis=0), rtol=0.2)


@pytest.mark.parametrize("loss", LOSSES)
def test_outliers_hardly_change_estimates_and_noise(loss: str) -> None:
    clean = fitted(data(3, 0.0), loss, None)
    y = data(3, 0.0)
    y[[5, 20, 33]] += 100.0
    robust, plain = fitted(y, loss, None), fitted(y, "linear", None)
    assert np.all(np.abs(robust.estimates - clean.estimates) < 3.0 * clean.std)
    assert robust.sigma["experiment 1: y"][0] == pytest.approx(NOISE, rel=0.5)
    assert plain.sigma["experiment 1: y"][0] > 100.0 * NOISE
    assert int(np.sum(np.abs(robust.residuals["experiment 1: y"]) > 100.0)) == 3


@pytest.mark.parametrize("loss", LOSSES)
def test_a_large_scale_is_the_sum_of_squares(loss: str) -> None:
    for sigma in (NOISE, None):
        wide, plain = fitted(data(4), loss, sigma, f_scale=1e5), fitted(data(4), "linear", sigma)
        np.testing.assert_allclose(wide.estimates, plain.estimates, rtol=1e-6)
        np.testing.assert_allclose(wide.sigma["experiment 1: y"], plain.sigma["experiment 1: y"], rtol=1e-6)


def test_priors_keep_the_square() -> None:
    """The influence of the data is bounded, and that of a prior that is far off is not: 2 psi(x - 1) = (9 - x)/4."""

    def predict(model: Decay) -> dict[str, Any]:
        return {"y": jnp.stack([model.size, model.size])}

    def fit(loss: Any, std: float) -> Fit[Decay]:
        experiment = Experiment(predict, {"y": [1.0, 1.0]}, {"y": 1.0})
        return identify(Decay(), {"size": (0.0, 10.0)}, experiment, priors={"size": Normal(9.0, std)}, loss=loss)

    np.testing.assert_allclose(fit("huber", 2.0).estimates, 17.0 / 9.0, rtol=1e-6)
    r = fit("soft_l1", 2.0).estimates[0] - 1.0
    np.testing.assert_allclose(2.0 * r / np.sqrt(1.0 + r**2), (8.0 - r) / 4.0, rtol=1e-6)
    for loss in LOSSES:
        np.testing.assert_allclose(fit(loss, 1e-3).std, 1e-3, rtol=0.3)


def test_density_is_that_of_the_loss() -> None:
    fit = fitted(data(5), "huber")
    assert float(fit.log_density(fit.estimates)) == pytest.approx(-0.5 * fit.chi2, rel=1e-9)
    np.testing.assert_allclose(np.asarray(jax.grad(fit.log_density)(fit.estimates)) * fit.std, 0.0, atol=1e-4)


def test_what_is_refused() -> None:
    with pytest.raises(ParameterError, match=r"loss must be linear, soft_l1 or huber, got 'cauchy'. Losses that"):
        fitted(data(6), "cauchy")
    for scale in (0.0, -1.0, np.inf, True):
        with pytest.raises(ParameterError, match=r"f_scale must be a positive number of standard deviations"):
            fitted(data(6), "huber", f_scale=scale)
    with pytest.raises(ParameterError, match="f_scale must be a real number"):
        fitted(data(6), "huber", f_scale="one")
    with pytest.raises(ModelError, match=r"no profile likelihood with the loss huber.* Use the interval"):
        fitted(data(6), "huber").profile("rate")
    two = Experiment(lambda m: {"y": jnp.stack([m.size, m.rate])}, {"y": [1.0, 1.0]}, {"y": 1.0})
    with pytest.raises(ParameterError, match=r"2 measured values cannot determine 2 parameters with their covariance"):
        identify(Decay(), FREE, two, loss="huber")
