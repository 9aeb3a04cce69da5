"""Parameters with an effect that the derivatives of a fit do not show."""

from collections.abc import Iterator, Sequence

import jax.numpy as jnp
import numpy as np

from .._compute.evaluator import CHANGED
from .._problem.free import Free
from .entries import Channel
from .fit_problem import REFUSED, FitProblem
from .least_squares import Minimum, solved


def unexplained(
    problem: FitProblem, free: Free, minimum: Minimum, channels: Sequence[Channel], tolerance: float, most: int
) -> Iterator[str]:
    """Sentences about predictions that change with a parameter although their derivatives are zero, here and there.

    Predictions that round or count are constant in steps. A rank, an interval or an estimate then says nothing about
    the parameter. It is compared with the bounds, or with values a size away without bounds.
    """
    n, held = len(minimum.z), jnp.ones(len(minimum.z), bool)
    low, high = (np.asarray(bound) for bound in problem.bounds)
    for i in np.flatnonzero(~np.any(minimum.jacobian[:-n], axis=0)).tolist():
        ends = [low[i] if np.isfinite(low[i]) else minimum.z[i] - 1.0]
        ends += [high[i] if np.isfinite(high[i]) else minimum.z[i] + 1.0]
        for end in (ends[0], 0.5 * (ends[0] + ends[1]), ends[1]):
            z = np.where(np.arange(n) == i, end, minimum.z)
            _, residuals, jacobian, *_ = (np.asarray(value) for value in solved(problem, z, held, tolerance, most))
            if np.any(np.abs(residuals) >= REFUSED) or np.any(jacobian[:-n, i]):
                continue
            if label := _changed(problem, channels, minimum.residuals, residuals):
                x, y = (free.variables[i].text(float(np.asarray(free.unscaled(one))[i])) for one in (minimum.z, z))
                name = free.names[i]
                yield (
                    f"{label} changes from {name} = {x} to {y}, but its derivatives are zero. Functions that count or "
                    f"round say nothing about {name} by derivatives: compare chi2 for several fixed values of it"
                )
                break


def _changed(problem: FitProblem, channels: Sequence[Channel], before: np.ndarray, after: np.ndarray) -> str:
    """The first channel with other predictions; empty if there is none."""
    for channel in channels:
        sigma = np.ravel(problem.groups[channel.group].sigma[channel.name][channel.place])
        one, other = (problem.loss.weighted(residuals[channel.rows]) for residuals in (before, after))
        change = np.where(np.isnan(channel.measured), 0.0, np.abs(other - one) * sigma)
        if np.max(change) > CHANGED * np.nanmax(np.abs(channel.measured)):
            return channel.label
    return ""
