"""`identify`: parameters from measurements."""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any, NoReturn, TypeVar

import jax.numpy as jnp
import numpy as np

from ..._declare.component import Component
from ..._errors import ModelError, ParameterError, SimulationError, suggestion
from ..._integrate.setup.options import count
from .._problem.distributions import Normal
from .._problem.free import Free
from .._problem.free_parameters import free_parameters
from .._problem.types import ByPath
from .entries import Channel
from .estimate import RANK
from .experiment import Experiment, Prepared
from .fit import Fit
from .fit_problem import FitProblem, Loss, LossName, stacked
from .least_squares import Minimum, Multistart, least, minimise, multistart, starts_between, unexplained
from .prepare import Labels, prepared, raise_start, with_own

M = TypeVar("M", bound=Component)
SAME_NOISE = 1e-8  # relative change of the noise below which it has converged
LEAST_NOISE = 1e-12  # smallest noise relative to the measured values, for an exact fit


def identify(
    model: M,
    free: ByPath[object],
    experiments: Experiment | Sequence[Experiment],
    *,
    priors: ByPath[Normal] | None = None,
    loss: LossName = "linear",
    f_scale: float = 1.0,
    starts: int = 1,
    level: float = 0.95,
    tolerance: float = 1e-9,
    max_steps: int = 200,
) -> Fit[M]:
    """Estimates parameters by weighted least squares.

    The Levenberg-Marquardt method with exact derivatives minimises the sum of ((predicted - measured)/sigma)^2 over all
    experiments and of ((p - mean)/std)^2 over all priors, starting from the values in `model`.

    - `free`: bounds of the free parameters by path, in declared units or with units, as in
      `{"motor.resistor.R": (0.1, 1.0), "line.stiffness": (None, None)}`. A tuple of paths shares one value. Parameters
      with bounds more than a decade apart are scaled logarithmically.
    - `experiments`: one or several. They share the values of `free`; a parameter that is free in one experiment is
      called "experiment: path". Experiments of the same kind with equally many samples share one compiled run.
    - `priors`: prior distributions `Normal(mean, std)`, by the keys of `free` or by the name "experiment: path".
    - `loss` and `f_scale`: as in `scipy.optimize.least_squares`. "huber" and "soft_l1" limit the influence of outliers,
      which are residuals larger than `f_scale` standard deviations of the noise. Priors keep the square.
    - `starts`: number of starts: the values in `model`, and points of a Sobol sequence between the bounds. The searches
      run on all cores, and `ends` of the fit has their results.
    - `level`: of the confidence intervals. `tolerance`: of the parameters, relative to the distance of their bounds.
    - `max_steps`: most iterations of a search, and most rounds of fit and estimated noise.

    A parameter that the data push against its bound stays there, and the covariance of the others is conditional on its
    value. Intervals end at the bounds, which does not change their coverage. If all noise is given, the covariance is
    (J^T J)^-1 with the derivatives J of the weighted residuals, and the intervals are those of the normal distribution.
    Otherwise the noise of a channel is estimated from its residuals and their degrees of freedom, fit and noise are
    iterated to convergence, and the intervals are those of Student's t distribution.

    With a loss that limits outliers, the covariance is the sandwich A^-1 B A^-1 of M-estimators:
    A = J^T diag(psi') J and B = J^T diag(psi^2) J n/(n - p). Here, psi is half the derivative of the loss, n the number
    of values and p that of parameters. It holds for all distributions of outliers that are as often high as low. Noise
    is estimated by Huber's proposal 2, and the intervals are those of Student's t distribution.

    The search steps back from parameters with which a run fails, whatever its `throw`, or a prediction is not finite.
    If predictions change with a parameter although their derivatives are zero, `unexplained` of the fit says so.

    Sources: Bates and Watts, Nonlinear Regression Analysis and Its Applications, ch. 1 to 3; Huber and Ronchetti,
    Robust Statistics, 2nd ed., ch. 6 and 7.

    Raises `ModelError` or `ParameterError` for invalid data, and `SimulationError` if the model cannot be run from the
    values in `model` or the search does not converge.
    """
    chosen_loss = Loss.of(loss, f_scale)
    many = [experiments] if isinstance(experiments, Experiment) else list(experiments)
    ready, labels = prepared(many, model)
    has_own = any(experiment.free for experiment in many)
    shared = free_parameters(model, free) if free or not has_own else Free(())
    chosen, ready = with_own(many, ready, labels, model, shared)
    mean, std = _priors(priors or {}, chosen)
    _check_count(ready, labels, chosen, int(np.sum(np.isfinite(std))), chosen_loss)
    groups, members = stacked(ready)
    # The compiled program does not depend on the start values, so that other starts compile nothing.
    still = Free(tuple(v._replace(start=1.0) if np.isfinite(v.high - v.low) else v for v in chosen.variables))
    problem = FitProblem(still, len(shared.variables), model, groups, chosen_loss, jnp.asarray(mean), jnp.asarray(std))
    channels = _channels(problem, members, labels)
    first = np.array([variable.start for variable in chosen.variables])
    places = starts_between(problem, np.asarray(chosen.scaled(first)), count(starts, "starts"))
    problem, minimum, freedom, ends = _weighted(problem, channels, places, tolerance, max_steps)
    if not minimum.computed:
        raise_start(problem, chosen, ready, labels, channels, len(places))
    if not minimum.converged:
        reached = chosen.text(np.asarray(chosen.unscaled(minimum.z)))
        raise SimulationError(
            f"The fit has not converged after {minimum.evaluations} evaluations. It reached {reached} with chi2 "
            f"{minimum.chi2:.6g}. Start closer, narrow the bounds, or hold parameters that the data cannot distinguish."
        )
    hidden = tuple(unexplained(problem, chosen, minimum, channels, tolerance, max_steps))
    return Fit(problem, chosen, minimum, tuple(channels), freedom, level, tolerance, ends, hidden)


def _priors(priors: Mapping[Any, Any], chosen: Free) -> Any:
    """Mean and standard deviation for each free parameter; infinite without a prior."""
    mean = np.array([variable.start for variable in chosen.variables])
    std = np.full(len(mean), np.inf)
    keys = {variable.name: i for i, variable in enumerate(chosen.variables)}
    for key, prior in priors.items():
        name = ", ".join(key) if isinstance(key, tuple) else key
        if name not in keys:
            raise ModelError(f"priors names {name!r}, which is not free.{suggestion(name, keys)}")
        if not isinstance(prior, Normal):
            raise ModelError(f"The prior of {name} must be Normal(mean, std), got {prior!r}.")
        one = prior.resolved(chosen.units[keys[name]], name, mean[keys[name]])
        mean[keys[name]], std[keys[name]] = one.mean, one.std
    return mean, std


def _check_count(ready: Sequence[Prepared], labels: Sequence[Labels], free: Free, priors: int, loss: Loss) -> None:
    values = sum(int(np.sum(~np.isinf(sigma))) for experiment in ready for sigma in experiment.sigma.values())
    noises = sum(len(label.estimated) for label in labels)
    n = len(free.variables)
    if values + priors < n + max(noises, int(loss.is_robust)):
        said = f", {priors} priors" if priors else ""
        wanted = f"{n} parameters" + (f" and the noise of {noises} channels" if noises else "")
        wanted += f" with their covariance, for the loss {loss.name}" if loss.is_robust else ""
        raise ParameterError(
            f"{values} measured values{said} cannot determine {wanted}. Free fewer parameters, give sigma, or measure "
            "more."
        )


def _channels(problem: FitProblem, places: Sequence[tuple[int, int]], labels: Sequence[Labels]) -> list[Channel]:
    """The channels of all experiments with the rows of their residuals."""
    offsets, first = [], 0
    for group in problem.groups:
        offsets.append({})
        for name in group.names:
            offsets[-1][name] = first
            first += np.size(group.measured[name])
    channels = []
    for (number, place), label in zip(places, labels, strict=True):
        group = problem.groups[number]
        times = None if group.times is None else np.asarray(group.times[place])
        for name in group.names:
            values = np.asarray(group.measured[name][place])
            values = np.where(np.isinf(group.sigma[name][place]), np.nan, values)
            first = offsets[number][name] + place * values.size
            channels.append(
                Channel(
                    experiment=label.name,
                    name=name,
                    unit=label.units[name],
                    scale=label.scales[name],
                    times=times,
                    measured=values.ravel(),
                    rows=slice(first, first + values.size),
                    is_estimated=name in label.estimated,
                    group=number,
                    place=place,
                )
            )
    return channels


def _with_noise(problem: FitProblem, channels: Sequence[Channel], sigmas: np.ndarray) -> FitProblem:
    """A copy of the problem with the noise of some channels."""
    noises = [dict(group.sigma) for group in problem.groups]
    for channel, sigma in zip(channels, sigmas, strict=True):
        noise = noises[channel.group]
        every = jnp.asarray(noise[channel.name])
        own = jnp.where(jnp.isinf(every[channel.place]), jnp.inf, sigma)
        noise[channel.name] = every.at[channel.place].set(own)
    groups = tuple(dataclasses.replace(g, sigma=noise) for g, noise in zip(problem.groups, noises, strict=True))
    return dataclasses.replace(problem, groups=groups)


def _weighted(
    problem: FitProblem, channels: Sequence[Channel], starts: np.ndarray, tolerance: float, most: int
) -> tuple[FitProblem, Minimum, float, Multistart | None]:
    """The fit with estimated noise, the degrees of freedom of the noise, and the ends of several searches."""
    held, loss = np.zeros(starts.shape[1], bool), problem.loss
    unknown = [channel for channel in channels if channel.is_estimated]
    sizes = np.array([float(np.nanmax(np.abs(channel.measured))) or 1.0 for channel in unknown])
    # The first weight of a channel is the standard deviation of its values.
    sigmas = np.array([float(np.nanstd(channel.measured)) for channel in unknown])
    sigmas = np.where(sigmas > 0.0, sigmas, sizes)
    problem = _with_noise(problem, unknown, sigmas)
    ends = multistart(problem, starts, tolerance, most) if len(starts) > 1 else None
    start = starts[0] if ends is None else ends.z[np.argmin(ends.chi2)]
    minimum, freedom = least(problem, start, tolerance, most), np.inf
    before = sigmas
    for _ in range(most if unknown else 0):
        left = np.array([channel.n_values for channel in unknown]) - _taken_up(minimum, unknown)
        errors = [s * loss.weighted(minimum.residuals[c.rows]) for s, c in zip(sigmas, unknown, strict=True)]
        new = loss.noises(errors, left, LEAST_NOISE * sizes)
        settled = not minimum.computed or np.all(np.abs(new - sigmas) <= SAME_NOISE * new)
        if settled:
            break
        before, sigmas = sigmas, new
        freedom, problem = float(np.sum(left)), _with_noise(problem, unknown, new)
        again = minimise(problem, minimum.z, held, tolerance, most)
        minimum = again._replace(evaluations=again.evaluations + minimum.evaluations)
    else:
        if unknown:
            _raise_noise(problem, minimum, unknown, before, sigmas, most)
    return problem, minimum, freedom, ends


def _raise_noise(
    problem: FitProblem,
    minimum: Minimum,
    channels: Sequence[Channel],
    before: np.ndarray,
    after: np.ndarray,
    rounds: int,
) -> NoReturn:
    """Raises `SimulationError` with the channel whose noise changed most in the last round."""
    i = int(np.argmax(np.abs(after - before) / after))
    reached = problem.free.text(np.asarray(problem.free.unscaled(minimum.z)))
    channel, change = channels[i], f"from {before[i]:.6g} to {after[i]:.6g} {channels[i].unit}".rstrip()
    raise SimulationError(
        f"The noise of {channel.label} has not converged after {rounds} rounds of fit and noise: the last one changed "
        f"it {change}, at {reached}. The parameters follow its {channel.n_values} values too closely to leave an "
        "estimate. Give its sigma, measure more values, or hold parameters that these values alone determine."
    )


def _taken_up(minimum: Minimum, channels: Sequence[Channel]) -> np.ndarray:
    """Degrees of freedom that the parameters take from each channel: the sum of its leverages."""
    left, values, _ = np.linalg.svd(minimum.jacobian[:, ~minimum.at_bound], full_matrices=False)
    left = left[:, values > RANK * np.max(values, initial=0.0)]
    return np.array([np.sum(left[channel.rows] ** 2) for channel in channels])
